"""How the swarm of nanobot answers to its parameters: maps, one parameter at a time,
and pictures.
"""

from collections.abc import Sequence
from functools import partial

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sweep.analysis import mean_interval
from sweep.figures import (
    BLUE,
    SKY,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    draw_map,
    draw_values,
    legend,
    name_rows,
    note,
)
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

from .pseudocode import (  # noqa: F401 (for published.yaml)
    DEFAULT,
    TERMS,
    Floats,
    Studies,
    off_the_pseudocode,
)

METRICS = (
    "polarization",
    "flock_count",
    "largest_flock_share",
    "nearest_neighbour_distance",
)
ROOM = 20.0
"""Pixels about what is drawn."""
LARGE = 0.8
"""Cohen's bound of a large effect, in standard deviations between trials: what we take
"significantly" to mean.
"""


def _table(study: StoredStudy, names: Sequence[str]) -> pd.DataFrame:
    """One row a trial that is done: the named settings, the replicate, and each
    metric's mean over the second half.
    """
    trials = study.trials[study.trials["status"] == "done"]
    columns = {metric: trials[f"{metric}_mean"] for metric in METRICS}
    return trials[["replicate", *names]].assign(**columns)


def _at(table: pd.DataFrame, **changes: float) -> pd.DataFrame:
    """The rows in which the settings of DEFAULT that the table has are as there, but
    for `changes`; by replicate.
    """
    for name, value in {
        **{name: value for name, value in DEFAULT.items() if name in table},
        **changes,
    }.items():
        table = table[np.isclose(table[name], value, rtol=1e-9)]
    return table.set_index("replicate")[list(METRICS)]


def _effect(
    studies: Studies, setting: str, step: float, metrics: Sequence[str] = METRICS
) -> Floats:
    """The strongest change that a setting raised, rather than lowered, by the part
    `step` brings to one of `metrics`.

    In standard deviations between trials at the default. Which metric changes most, and
    with what sign, is decided for each half of the replicates, odd and even, by the
    other half, so that the choice cannot flatter the values returned.
    """
    table = _table(studies["one_at_a_time"], list(DEFAULT))
    low, high = (
        _at(table, **{setting: DEFAULT[setting] * factor})
        for factor in (1.0 - step, 1.0 + step)
    )
    change = (high - low) / _at(table).std()
    odd = change.index % 2 == 1
    halves = []
    for choosing, measured in ((odd, ~odd), (~odd, odd)):
        means = change.loc[choosing, list(metrics)].mean()
        strongest = means.abs().idxmax()
        halves.append(np.sign(means[strongest]) * change.loc[measured, strongest])
    return np.concatenate(halves)


protected_range_10 = partial(_effect, setting="separation_range", step=0.1)
protected_range_25 = partial(_effect, setting="separation_range", step=0.25)
protected_range_25_structure = partial(
    _effect, setting="separation_range", step=0.25, metrics=METRICS[:3]
)
centering_factor_10 = partial(_effect, setting="cohesion_weight", step=0.1)
centering_factor_25 = partial(_effect, setting="cohesion_weight", step=0.25)


def _words(study: StoredStudy, metric: str) -> str:
    """A metric's name with its unit on a second line."""
    unit = study.units.get(metric, "")
    return metric.replace("_", " ") + (f"\n({unit})" if unit else "")


def sensitivity(studies: Studies) -> Figure:
    """Each metric by protected range and centering factor: its mean, and half the width
    of its interval.
    """
    study = studies["sensitivity"]
    columns = [f"{metric}_mean" for metric in METRICS]
    table = study.means(columns, ["separation_range", "cohesion_weight"])
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(11.0, 5.3))
        panels = figure.subplots(2, len(METRICS), sharex=True, sharey=True)
        for (above, below), metric in zip(panels.T, METRICS, strict=True):
            mean, low, high = (
                table.pivot(
                    index="cohesion_weight",
                    columns="separation_range",
                    values=f"{metric}_mean{end}",
                )
                for end in ("", "_low", "_high")
            )
            words = _words(study, metric)
            _heat(figure, above, mean, "viridis", words)
            _heat(
                figure, below, (high - low) / 2.0, "magma", f"half interval of\n{words}"
            )
            below.set_xlabel("ProtectedRange (px)")
        for axes in panels[:, 0]:
            axes.set_ylabel("CenteringFactor (1/step²)")
        panels[0, 0].set_title("means", loc="left", fontsize=9)
        panels[1, 0].set_title("half the 95 % interval", loc="left", fontsize=9)
        counts = sorted(
            set(study.trials[study.trials["status"] == "done"].groupby("point").size())
        )
        number = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
        note(
            figure,
            f"{study.name}: {number} trials of 100 boids a cell, mean over steps 300 to"
            " 600; cross: default",
        )
    return figure


def _heat(
    figure: Figure, axes: Axes, table: pd.DataFrame, colours: str, label: str
) -> None:
    x, y = table.columns.to_numpy(np.float64), np.log(table.index.to_numpy(np.float64))
    mesh = axes.pcolormesh(
        _edges(x), np.exp(_edges(y)), table.to_numpy(), cmap=colours, rasterized=True
    )
    axes.set_yscale("log")
    axes.grid(visible=False)
    for colour, width in (("white", 3.2), ("black", 1.4)):
        axes.plot(
            DEFAULT["separation_range"],
            DEFAULT["cohesion_weight"],
            "+",
            color=colour,
            ms=9,
            mew=width,
        )
    figure.colorbar(mesh, ax=axes, fraction=0.06).set_label(label, fontsize=8)


def _edges(values: Floats) -> Floats:
    """The edges of cells about ascending values: half-way between two, and as far
    beyond the outer ones.
    """
    middle = (values[1:] + values[:-1]) / 2 if len(values) > 1 else values
    first, last = (
        (2 * values[0] - middle[0], 2 * values[-1] - middle[-1])
        if len(values) > 1
        else (-1.0, 1.0)
    )
    return np.concatenate([[first], middle, [last]])


def one_at_a_time(studies: Studies) -> Figure:
    """What each parameter alone does to each metric, in standard deviations between
    trials at the default.
    """
    study = studies["one_at_a_time"]
    table = _table(study, list(DEFAULT))
    default = _at(table)
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(11.0, 5.4))
        panels = figure.subplots(1, len(METRICS), sharey=True)
        for axes, metric in zip(panels, METRICS, strict=True):
            axes.axvspan(-LARGE, LARGE, color="0.93", lw=0, zorder=0)
            axes.axvline(0.0, color="0.5", lw=0.8)
            for k, (part, marker) in enumerate(((0.1, "o"), (0.25, "s"), (0.5, "^"))):
                for sign, colour in ((-1, VERMILION), (1, BLUE)):
                    found = [
                        _change(table, default, metric, name, sign * part)
                        for name in DEFAULT
                    ]
                    places = np.arange(len(DEFAULT)) + 0.13 * (2 * k - 2 + 0.5 * sign)
                    draw_values(
                        axes,
                        places,
                        tuple(zip(*found, strict=True)),
                        colour,
                        marker,
                        f"{100 * sign * part:+g} %",
                    )
            axes.set_xlabel(
                f"change of {metric.replace('_', ' ')}\n(standard deviations at the"
                " default)",
                fontsize=8,
            )
            axes.set_xscale("symlog", linthresh=2.0, linscale=1.5)
            axes.set_xticks(
                [-10, -2, -1, 0, 1, 2, 10], ["-10", "-2", "-1", "0", "1", "2", "10"]
            )
        for axes in panels:
            name_rows(
                axes, [f"{TERMS[name]} {value:g}" for name, value in DEFAULT.items()]
            )
        legend(figure, panels[0], 6)
        note(
            figure,
            f"{study.name}: {len(default)} trials a value, paired by start, mean over"
            " steps 300 to 600, 95 % interval\nlinear within 2, logarithmic beyond;"
            f" grey: below {LARGE} standard deviations",
        )
    return figure


def _change(
    table: pd.DataFrame, default: pd.DataFrame, metric: str, name: str, part: float
) -> tuple[float, float, float]:
    """The mean standardised change of a metric with its interval, for a setting changed
    by a part of itself.
    """
    changed = _at(table, **{name: float(f"{DEFAULT[name] * (1 + part):.6g}")})
    values = (changed[metric] - default[metric]) / default[metric].std()
    return mean_interval(values, distribution="skewed")[:3]


def corners(studies: Studies) -> Figure:
    """The swarm at the end of one trial each, with the last 40 steps of its way."""
    study = studies["corners"]
    with matplotlib.style.context(STYLE):
        trials = study.trials.sort_values(
            ["cohesion_weight", "separation_range"], ascending=[False, True]
        )
        rows = trials["cohesion_weight"].nunique()
        figure = Figure(figsize=(9.6, 2.5 * rows + 0.8))
        panels = figure.subplots(rows, len(trials) // rows, sharex=True, sharey=True)
        low, high = np.zeros(2), trials[["width", "height"]].iloc[0].to_numpy()
        for axes, trial in zip(panels.ravel(), trials.itertuples(), strict=True):
            frames, flight = study.trajectory(trial.trial_id)
            low = np.minimum(low, flight[-11:, :2].min(axis=(0, 2)))
            high = np.maximum(high, flight[-11:, :2].max(axis=(0, 2)))
            draw_map(axes, study.world(trial.trial_id), "px")
            axes.plot(flight[-11:, 0], flight[-11:, 1], color=SKY, lw=0.7, zorder=1)
            draw_flock(axes, flight[-1], 14.0)
            for edge, style in ((0.0, "-"), (DEFAULT["border_margin"], "--")):
                size = (trial.width - 2 * edge, trial.height - 2 * edge)
                axes.add_patch(
                    Rectangle(
                        (edge, edge),
                        *size,
                        fill=False,
                        ec="0.75",
                        lw=0.8,
                        ls=style,
                        zorder=0,
                    )
                )
            axes.set_title(
                f"ProtectedRange {trial.separation_range:g} px, CenteringFactor"
                f" {trial.cohesion_weight:g}\npolarization {trial.polarization:.2f},"
                f" {trial.flock_count:.0f} flocks",
                fontsize=8,
            )
            axes.label_outer()
        for axes in panels.ravel():  # all that is drawn, beyond the borders too
            axes.set_xlim(low[0] - ROOM, high[0] + ROOM)
            axes.set_ylim(high[1] + ROOM, low[1] - ROOM)
        note(
            figure,
            f"{study.name}: one trial each, same start, {trial.steps} steps; lines: the"
            f" last {frames[-1] - frames[-11]}; middle: default; dashed: margins",
        )
    return figure


def rules(studies: Studies) -> Figure:
    """What each rule is for: the metrics with all rules, without one of them, and
    without any.
    """
    study = studies["rules"]
    metrics = (
        "polarization",
        "largest_flock_share",
        "nearest_neighbour_distance",
        "in_contact",
    )
    settings = ["separation_weight", "alignment_weight", "cohesion_weight"]
    columns = [f"{metric}_mean" for metric in metrics]
    table = study.means(columns, settings)
    names = [_missing(row) for row in table[settings].to_numpy()]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(11.0, 2.6))
        panels = figure.subplots(1, len(metrics), sharey=True)
        for axes, metric, column in zip(panels, metrics, columns, strict=True):
            draw_values(
                axes,
                range(len(table)),
                tuple(table[f"{column}{end}"] for end in ("", "_low", "_high")),
                BLUE,
            )
            name_rows(axes, names)
            axes.set(xlabel=_words(study, metric), xlim=(0, None))
        reach = study.trials["contact_distance"].iloc[0]
        panels[3].set_xlabel(
            f"time in contact, nearer than\n{reach:g} px to another (%)"
        )
        number = len(study.trials) // len(table)
        note(
            figure,
            f"{study.name}: {number} trials a value, mean over steps 300 to 600, 95 %"
            " interval",
        )
    return figure


def _missing(weights: Floats) -> str:
    off = [
        name
        for name, weight in zip(
            ("separation", "alignment", "cohesion"), weights, strict=True
        )
        if weight == 0
    ]
    return {0: "all rules", 3: "no rule"}.get(len(off), f"no {off[0] if off else ''}")


recorded_as_defined = partial(as_defined, spec="pseudocode")

FIGURES = {
    "sensitivity": Drawing(
        sensitivity,
        ("sensitivity",),
        "Four metrics by ProtectedRange and CenteringFactor, with intervals.",
    ),
    "one_at_a_time": Drawing(
        one_at_a_time,
        ("one_at_a_time",),
        "Each parameter alone, 10, 25 and 50 % off its default.",
    ),
    "corners": Drawing(
        corners, ("corners",), "The swarm at the corners, edges and middle of the grid."
    ),
    "rules": Drawing(rules, ("rules",), "The swarm without each of its rules."),
}
