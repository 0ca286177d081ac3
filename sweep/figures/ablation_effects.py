"""What each detail in which two presets differ does: paired effects of an axis that
ablates, and their figure.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import paired_contrast, simultaneous_confidence
from sweep.figures.drawing import draw_values, legend, name_rows, note, span, words
from sweep.figures.style import BLUE, GREEN, STYLE, VERMILION
from sweep.tables.stored_study import StoredStudy

MARKS = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"))
ALL = "all"
SMALLEST_LOGARITHMIC = 8.0


def paired_effects(
    study: StoredStudy,
    preset: str,
    metrics: Sequence[str],
    by: str,
    *,
    factor: bool = False,
) -> pd.DataFrame:
    """The mean change of each metric that each detail of `preset` makes, with its
    simultaneous 95 % interval.

    A trial is paired with the trial of the same seed, replicate and value of `by` in
    which no detail is changed. The change is their difference. With `factor` it is
    their ratio, for metrics above zero, and its mean is the geometric one. Columns:
    `by`, detail, metric, value, low, high, n. The intervals hold together (Bonferroni).
    A pair counts only if both of its trials are done.
    """
    trials = study.trials.assign(detail=study.details(preset).to_numpy())
    trials = trials[trials["status"] == "done"]
    start = [by, "seed", "replicate"]
    values = trials[[*start, "detail", *metrics]].astype(
        dict.fromkeys(metrics, np.float64)
    )
    if factor:
        values[list(metrics)] = np.log(values[list(metrics)])
    before = values[values["detail"] == ""].set_index(start)[list(metrics)]
    after = values[values["detail"] != ""]
    comparisons = len(metrics) * after.groupby([by, "detail"]).ngroups
    rows = []
    for (value, detail), group in after.groupby([by, "detail"], sort=False):
        changed = group.set_index(start)
        for metric in metrics:
            pairs = paired_contrast(
                changed[metric],
                before[metric],
                # Logarithms are about normal.
                distribution="normal" if factor else study.distributions[metric],
            )
            found = (
                pairs.value,
                *pairs.interval(simultaneous_confidence(comparisons)),
            )
            n = len(pairs.first)
            rows.append(
                (value, detail, metric, *(np.exp(found) if factor else found), n)
            )
    return pd.DataFrame(
        rows, columns=[by, "detail", "metric", "value", "low", "high", "n"]
    )


def effects_figure(
    study: StoredStudy,
    preset: str,
    metrics: Mapping[str, str],
    by: str,
    names: Mapping[object, str],
    *,
    factor: bool = False,
) -> Figure:
    """A forest of `paired_effects`: a panel a metric and a row a detail. The last row
    has all details together.

    `metrics` gives the words for each column, and `names` those for each value of `by`.
    Both are in the order in which they are drawn.
    """
    table = paired_effects(study, preset, list(metrics), by, factor=factor)
    rows = _rows(study, preset, table)
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 0.3 * len(rows) + 1.95))
        panels = figure.subplots(1, len(metrics), sharey=True, squeeze=False)[0]
        for axes, (metric, text) in zip(panels, metrics.items(), strict=True):
            _panel(
                axes,
                table[table["metric"] == metric],
                list(rows),
                by,
                names,
                factor=factor,
            )
            unit = f" ({study.units[metric]})" if metric in study.units else ""
            before = _unchanged(study, preset, metric, by, names)
            axes.set_title(f"{text}\nunchanged{unit}:\n{before}", fontsize=7.5)
            axes.set_xlabel(
                "factor" if factor else f"change{unit}".replace("%", "% points"),
                fontsize=8,
            )
        for axes in panels:
            name_rows(axes, list(rows.values()))
        legend(figure, panels[0])
        kind = "geometric mean" if factor else "mean"
        note(
            figure,
            f"{study.name}: {span(table['n'])} pairs of trials with the same start a"
            f" row,\n{kind} with simultaneous 95 % interval (Bonferroni,"
            f" {len(table)} comparisons)",
        )
    return figure


def _panel(
    axes: Axes,
    table: pd.DataFrame,
    rows: Sequence[str],
    by: str,
    names: Mapping[object, str],
    *,
    factor: bool,
) -> None:
    axes.axvline(1.0 if factor else 0.0, color="0.5", linewidth=0.8)
    axes.axhline(len(rows) - 1.5, color="0.8", linewidth=0.8)
    for number, (value, name) in enumerate(names.items()):
        chosen = table[table[by] == value].set_index("detail").reindex(list(rows))
        places = np.arange(len(rows)) + 0.28 * (number - (len(names) - 1) / 2)
        colour, marker = MARKS[number]
        values = (chosen["value"], chosen["low"], chosen["high"])
        draw_values(axes, places, values, colour, marker, name)
    if factor:
        _logarithmic(axes)
    axes.tick_params(axis="both", labelsize=8)


def _logarithmic(axes: Axes) -> None:
    """A logarithmic axis of factors, from 1/8 to 8 or more: small ones look small."""
    axes.set_xscale("log")
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 1.0 / SMALLEST_LOGARITHMIC), max(high, SMALLEST_LOGARITHMIC))
    axes.minorticks_off()


def _unchanged(
    study: StoredStudy, preset: str, metric: str, by: str, names: Mapping[object, str]
) -> str:
    """The metric's mean where nothing is changed, for each value of `by`."""
    before = study.trials[study.details(preset).to_numpy() == ""]
    means = before.groupby(by)[metric].mean()
    return " and ".join(
        f"{means[value]:,.0f}" if means[value] > 1000 else f"{means[value]:.3g}"
        for value in names
    )


def _rows(study: StoredStudy, preset: str, table: pd.DataFrame) -> dict[str, str]:
    """Every detail in the order of the axis, and what it changes, in words."""
    trials = study.trials.assign(detail=study.details(preset).to_numpy())
    values = trials.groupby("detail", sort=False).first()
    found = [name for name in dict.fromkeys(table["detail"]) if name != ALL]
    rows = {name: f"{words(name)}: {words(values.loc[name, name])}" for name in found}
    return rows | (
        {ALL: f"all: {words(preset)}"} if ALL in set(table["detail"]) else {}
    )
