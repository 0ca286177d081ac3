"""The figure of the effects of the components in which two presets differ."""

from collections.abc import Mapping, Sequence
from functools import partial
from textwrap import wrap
from typing import Any

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import (
    COLOURS,
    MARKERS,
    STYLE,
    Choices,
    FigureKind,
    Planned,
    draw_values,
    legend,
    linear_part,
    make_logarithmic,
    metric_label,
    name_rows,
    note,
    quantity,
    span,
    words,
)
from sweep.methods.ablation.analysis import NOTHING, OTHERS, paired_effects
from sweep.spec import ALL, Over, column_over
from sweep.tables import StoredStudy

SMALLEST_LOGARITHMIC = 8.0
LETTERS = 40
"""Most characters of a line with the values of a component."""
LETTERS_OF_A_CHANGE = 26
"""Most characters of a line below a panel."""
MOST_PANELS = 3
IN_WORDS = {NOTHING: "added alone", OTHERS: "added to all others"}


def effects_figure(
    study: StoredStudy,
    preset: str,
    metrics: Mapping[str, str],
    by: str | None = None,
    names: Mapping[Any, str] | None = None,
    *,
    factor: bool = False,
    over: Over = "last",
) -> Figure:
    """Draw the effects of components as a forest plot, one panel per metric.

    Each component has a row. The components that change the first metric most are
    first. The last row has all components together. See `paired_effects`.

    Parameters
    ----------
    study : StoredStudy
    preset : str
        Preset whose components are added. If the spec names the components, the name of
        the axis.
    metrics : mapping of str to str
        Label of each metric, in the order of the panels.
    by : str, optional
        Parameter whose values are kept apart.
    names : mapping, optional
        Label of each value of `by`, in drawing order.
    factor : bool, default False
        Draw ratios instead of differences. For metrics above zero.
    over : {"last", "half"}, default "last"
        The last frame, or the mean over the second half of each trial.

    Returns
    -------
    Figure
    """
    metrics = {column_over(name, over): text for name, text in metrics.items()}
    table = paired_effects(study, preset, list(metrics), by, factor=factor)
    rows = _rows(study, preset, table, next(iter(metrics)), factor=factor)
    lines = max(text.count("\n") for text in rows.values()) + 1
    series = _series(table, by, names or {})
    with style.context(STYLE):
        height = (0.13 * lines + 0.17) * len(rows) + 1.95
        figure = Figure(figsize=(7.2, height))
        panels = figure.subplots(1, len(metrics), sharey=True, squeeze=False)[0]
        for axes, (metric, text) in zip(panels, metrics.items(), strict=True):
            shown = {
                name: part[part["metric"] == metric] for name, part in series.items()
            }
            _panel(axes, shown, list(rows), factor=factor)
            unit = f" ({study.units[metric]})" if study.units.get(metric) else ""
            before = _unchanged(study, preset, metric, by, labels=names or {})
            axes.set_title(f"{text}\nunchanged{unit}:\n{before}", fontsize=7.5)
            label = "factor" if factor else f"change{unit}".replace("%", "% points")
            changes = table.loc[table["metric"] == metric, "value"]
            linear = 0.0 if factor else linear_part(changes)
            if linear:
                make_logarithmic(axes, "x", linear=linear)
            text = "\n".join(wrap(metric_label(label, linear), LETTERS_OF_A_CHANGE))
            axes.set_xlabel(text, fontsize=8)
        for axes in panels:
            name_rows(axes, list(rows.values()))
            axes.tick_params(axis="y", labelsize=7)
        if any(series):
            legend(figure, panels[0])
        kind = "geometric mean" if factor else "mean"
        note(
            figure,
            f"{study.name}: {span(table['n'])} pairs of trials per row, with equal"
            f" initial conditions,\n{kind} with simultaneous 95 % confidence interval"
            f" (Bonferroni, {len(table)} comparisons)",
        )
    return figure


def _series(
    table: pd.DataFrame, by: str | None, labels: Mapping[Any, str]
) -> dict[str, pd.DataFrame]:
    """Return the rows of each marker and colour, by label."""
    series = {}
    sides = list(dict.fromkeys(table["added_to"]))
    for value, words_of in labels.items() if by else [(None, "")]:
        part = table[table[by] == value] if by else table
        for side in sides:
            parts = [words_of, IN_WORDS[side] if len(sides) > 1 else ""]
            name = ", ".join(filter(None, parts))
            series[name] = part[part["added_to"] == side]
    return series


def _panel(
    axes: Axes,
    series: Mapping[str, pd.DataFrame],
    rows: Sequence[str],
    *,
    factor: bool,
) -> None:
    axes.axvline(1.0 if factor else 0.0, color="0.5", linewidth=0.8)
    axes.axhline(len(rows) - 1.5, color="0.8", linewidth=0.8)
    for number, (name, table) in enumerate(series.items()):
        chosen = table.set_index("detail").reindex(list(rows))
        step = min(0.28, 0.8 / len(series))
        places = np.arange(len(rows)) + step * (number - (len(series) - 1) / 2)
        values = (chosen["value"], chosen["low"], chosen["high"])
        draw_values(
            axes,
            places,
            values,
            COLOURS[number % len(COLOURS)],
            marker=MARKERS[number % len(MARKERS)],
            label=name,
        )
    if factor:
        _logarithmic(axes)
    axes.tick_params(axis="both", labelsize=8)


def _logarithmic(axes: Axes) -> None:
    """Set a logarithmic axis of factors, at least from 1/8 to 8.

    On a shorter axis small factors would look large.
    """
    make_logarithmic(axes, "x")
    low, high = axes.get_xlim()
    axes.set_xlim(min(low, 1.0 / SMALLEST_LOGARITHMIC), max(high, SMALLEST_LOGARITHMIC))
    axes.minorticks_off()


def _unchanged(
    study: StoredStudy,
    preset: str,
    metric: str,
    by: str | None,
    labels: Mapping[Any, str],
) -> str:
    """Return the mean of a metric without a change, by value of `by`, in words."""
    before = study.trials[study.details(preset).to_numpy() == ""]
    if by:
        mean_of = before.groupby(by)[metric].mean()
        means = [mean_of[value] for value in labels]
    else:
        means = [before[metric].mean()]
    return " and ".join(
        f"{mean:,.0f}" if mean > 1000 else f"{mean:.3g}" for mean in means
    )


def _rows(
    study: StoredStudy,
    preset: str,
    table: pd.DataFrame,
    metric: str,
    *,
    factor: bool,
) -> dict[str, str]:
    """Return the components, each with its label.

    A component with a larger effect on the metric is earlier; all together are last.
    """
    trials = study.trials.assign(detail=study.details(preset).to_numpy())
    values = trials.drop_duplicates("detail").set_index("detail").to_dict("index")
    of_metric = table[(table["metric"] == metric) & (table["detail"] != ALL)]
    sizes = (np.log(of_metric["value"]) if factor else of_metric["value"]).abs()
    largest = sizes.groupby(of_metric["detail"], sort=False).max()
    details = largest.sort_values(ascending=False, kind="stable").index
    groups = study.about.ablated[preset]
    settings = dict(zip(study.detail_names(preset), groups, strict=True))
    rows = {
        name: _row(study, name, settings[name], values.get(name) or values[ALL])
        for name in details
    }
    last = ALL if study.about.details else f"{ALL}: {words(preset)}"
    return rows | ({ALL: last} if ALL in set(table["detail"]) else {})


def _row(
    study: StoredStudy, name: str, settings: Sequence[str], values: Mapping[Any, Any]
) -> str:
    """Return the label of a component: the name, and the parameters with units."""
    texts = {setting: _measure(study, setting, values[setting]) for setting in settings}
    if not study.about.details:
        return f"{words(name)}: {texts[settings[0]]}"
    text = ", ".join(f"{words(setting)} {value}" for setting, value in texts.items())
    return "\n".join([name, *wrap(text, LETTERS)])


def _measure(study: StoredStudy, setting: str, value: object) -> str:
    """Return the value of a parameter in words, with the unit of a finite value."""
    is_number = isinstance(value, int | float | np.number)
    unit = study.units.get(setting, "") if is_number and value != np.inf else ""
    return f"{words(value)} {unit}".rstrip().replace("^2", "²")


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return figures of up to MOST_PANELS metrics.

    Raises ChoiceError if no axis of the study ablates, or if the points differ by
    several parameters in addition to the component.
    """
    if not study.about.ablated:
        raise ChoiceError(
            "no axis ablates a preset or components", study.name, "effects"
        )
    (ablated,) = study.about.ablated
    metrics = choices.plain(study)
    by, labels = _apart(study, ablated, choices.by)
    parts = [
        metrics[first : first + MOST_PANELS]
        for first in range(0, len(metrics), MOST_PANELS)
    ]
    return [
        Planned(
            "-".join(part) if len(parts) > 1 or choices.metrics else "",
            partial(
                effects_figure,
                study,
                ablated,
                {name: quantity(study, name).partition(" (")[0] for name in part},
                by=by,
                names=labels,
            ),
        )
        for part in parts
    ]


def _apart(
    study: StoredStudy, ablated: str, by: str | None
) -> tuple[str | None, dict[object, str]]:
    """Return the parameter by which points differ in addition to the component.

    The mapping has the label of each value. None and an empty mapping if the points do
    not differ.
    """
    detail = study.detail(ablated)
    tried = study.points[study.tried]
    varied = [
        name for name in study.headings if name != detail and tried[name].nunique() > 1
    ]
    if not varied:
        return None, {}
    for name in [by] if by else varied:
        if name in varied and not tried.duplicated([name, detail]).any():
            values = dict.fromkeys(tried[name])
            return name, {value: f"{words(name)} {words(value)}" for value in values}
    raise ChoiceError(
        "the points differ by several parameters in addition to the component"
        f" ({', '.join(varied)}): choose with where until a single parameter is left",
        study.name,
        "effects",
    )


KIND = FigureKind("effect of each component that an axis ablates", ("by",), plan)
