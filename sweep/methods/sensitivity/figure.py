"""The figure of a table of `sweep.methods.sensitivity`.

The figure has bars with confidence intervals, one row per parameter, and one panel per
combination of the other axes.
"""

from collections.abc import Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.figures import (
    BLUE,
    GREEN,
    STYLE,
    VERMILION,
    Choices,
    FigureKind,
    Planned,
    draw_values,
    legend,
    name_rows,
    note,
    select,
    span,
)
from sweep.methods.sensitivity.analysis import every_sampler, sensitivity
from sweep.methods.sensitivity.sampled import sampled_axis
from sweep.tables import StoredStudy

MARKS = ((BLUE, "o"), (VERMILION, "s"), (GREEN, "^"))
COLUMNS = 3


class Bars(NamedTuple):
    """The bars of a kind of number.

    The fields are a label, names of rows, and a table of value, low and high, (rows,
    3).
    """

    label: str
    rows: list[str]
    values: pd.DataFrame


def sensitivity_figure(table: pd.DataFrame) -> Figure:
    """Draw a table that `sobol`, `morris` or `rank_correlations` returned.

    Sobol indices are drawn without replicate noise if known, otherwise as the indices
    of the unchanged means. An unknown confidence interval is not drawn.
    """
    panels = list(_panels(table))
    rows = list(
        dict.fromkeys(
            row for _, part in panels for bars in _bars(part) for row in bars.rows
        )
    )
    across = min(COLUMNS, len(panels))
    down = -(-len(panels) // across)
    with style.context(STYLE):
        figure = Figure(
            figsize=(
                1.6 + 2.8 * max(across, 1.5),
                1.5 + down * (0.36 * len(rows) + 0.7),
            )
        )
        grid = figure.subplots(
            down, across, sharex=True, sharey=True, squeeze=False
        ).ravel()
        for axes, (title, part) in zip(grid, panels, strict=False):
            _draw(axes, _bars(part), rows)
            axes.set_title(title, fontsize=8)
            axes.set_xlabel(_quantity(table), fontsize=8)
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        for axes in grid[: len(panels)]:
            name_rows(axes, [row.replace("_", " ") for row in rows])
        legend(figure, grid[0])
        note(figure, _note(table))
    return figure


def _panels(table: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    """Yield the parts of the table in which parameters of further axes are equal.

    Each part comes after these parameters in words.
    """
    first = "index" if "index" in table else "setting"
    grouping = list(table.columns[: list(table.columns).index(first)])
    if not grouping:
        yield "", table
        return
    for key, part in table.groupby(grouping, sort=False):
        yield (
            ", ".join(
                f"{name} = {value}" for name, value in zip(grouping, key, strict=True)
            ).replace("_", " "),
            part,
        )


def _bars(part: pd.DataFrame) -> list[Bars]:
    if "index" in part:
        shown = _shown(part)
        labels = {
            "S1": "S1, alone",
            "ST": "ST, with all interactions",
            "S2": "S2, of a pair",
        }
        return [
            _one(labels[str(kind)], rows, shown)
            for kind, rows in part.groupby("index", sort=False)
        ]
    names = ["mu_star", "sigma", "mu"] if "mu_star" in part else ["spearman", "partial"]
    labels = {"mu_star": "mu*, mean size", "sigma": "sigma, spread", "mu": "mu, mean"}
    return [_one(labels.get(name, name), part, name) for name in names]


def _one(label: str, part: pd.DataFrame, name: str) -> Bars:
    pairs = part["other"] if "other" in part else pd.Series("", index=part.index)
    rows = [
        f"{setting} x {other}" if other else setting
        for setting, other in zip(part["setting"], pairs, strict=True)
    ]
    return Bars(label, rows, part[[name, f"{name}_low", f"{name}_high"]])


def _shown(table: pd.DataFrame) -> str:
    """Return the column of indices to draw: without noise, if any is known."""
    return "corrected" if table["corrected"].notna().any() else "raw"


def _draw(axes: Axes, kinds: list[Bars], rows: list[str]) -> None:
    axes.axvline(0.0, color="0.5", linewidth=0.8)
    sharing = {row: [bars.label for bars in kinds if row in bars.rows] for row in rows}
    height = 0.8 / max(len(labels) for labels in sharing.values())
    for bars, (colour, marker) in zip(kinds, MARKS, strict=False):
        slots = [
            sharing[row].index(bars.label) - (len(sharing[row]) - 1) / 2
            for row in bars.rows
        ]
        places = np.array([rows.index(row) for row in bars.rows]) + height * np.array(
            slots
        )
        value, low, high = bars.values.to_numpy(np.float64).T
        axes.barh(places, value, height=0.9 * height, color=colour, alpha=0.25)
        values = (value, low, high)
        draw_values(axes, places, values, colour, marker=marker, label=bars.label)
    axes.tick_params(axis="both", labelsize=8, labelbottom=True)


def _quantity(table: pd.DataFrame) -> str:
    metric = str(table.attrs["metric"]).replace("_", " ")
    unit = table.attrs["unit"]
    if "index" in table:
        return f"fraction of the variance of {metric}"
    if "mu_star" in table:
        return f"effect of the whole range on {metric}" + (f" ({unit})" if unit else "")
    return f"rank correlation with {metric}"


def _note(table: pd.DataFrame) -> str:
    """Return the note of the figure.

    The note has the study, the numbers of blocks and trials, and the kind of confidence
    interval and number.
    """
    each = " per panel" if len(list(_panels(table))) > 1 else ""
    unit = "points" if "spearman" in table else "blocks of points"
    text = f"{table.attrs['study']}: {span(table['blocks'])} {unit}"
    if table["blocks_left_out"].any():
        text += f" ({span(table['blocks_left_out'])} more left out: no value)"
    text += f", {span(table['trials'])} trials{each};\n{_intervals(table)}"
    if "index" in table:
        kinds = {
            "corrected": "without replicate noise",
            "raw": "replicate noise not separated",
        }
        share = table["noise_share"].max()
        text += f"; {kinds[_shown(table)]}"
        text += f" (up to {share:.0%} of the variance of a mean)" if share > 0.0 else ""
    if (fewest := table.attrs["fewest"]) > table["blocks"].min():
        text += f"\nfewer than {fewest} {unit} are imprecise: use more"
    return text.replace("%", " %")


def _intervals(table: pd.DataFrame) -> str:
    """Return the kind of confidence intervals in words, or why there are none."""
    with_interval = [
        (bars.values.iloc[:, 1].notna()).any()
        for _, part in _panels(table)
        for bars in _bars(part)
    ]
    if not any(with_interval):
        return "no confidence intervals: some resamples of few blocks give no value"
    some = "" if all(with_interval) else ", where all resamples give a value"
    return (
        f"{table.attrs['confidence']:.0%} bootstrap confidence intervals, not"
        f" simultaneous{some}"
    )


def plan(study: StoredStudy, choices: Choices) -> list[Planned]:
    """Return a figure per metric.

    Raises ChoiceError if the study samples no parameters, or has too many panels.
    """
    selection = select(study)
    if not selection.sampled:
        raise ChoiceError(
            "needs an axis that samples parameters; the study has no such axis",
            study.name,
            "sensitivity",
        )
    axis = sampled_axis(study, None, every_sampler(study))
    sampled = study.axes[axis].settings
    selection.panels(selection.apart(sampled), "sensitivity")

    def draw(name: str) -> Figure:
        return sensitivity_figure(sensitivity(study, name, axis))

    return [Planned(name, partial(draw, name)) for name in choices.plain(study)]


KIND = FigureKind("sampled parameters on which a metric depends", (), plan)
