"""The states of Couzin et al. (2002) in the plane: by order and angular momentum, with
both readings of the rule.
"""

from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sweep.analysis import Declaration, Support, mean_interval
from sweep.figures import (
    BLUE,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    hysteresis_figure,
    note,
)
from sweep.methods.hysteresis import find_loops
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]
Studies = Mapping[str, StoredStudy]

PROGRAMS = Path(__file__).with_name("programs.csv")
"""Means over the last fifth of 16 flights each of programs that were written from the
rules alone and share no code with this one.
"""
LATE = 0.8
"""The share of a trial's frames before those that count."""
READINGS = {
    "plain_sums": ("plain sums", BLUE),
    "unit_vectors": ("unit vectors", VERMILION),
}
METRICS = {"polarization": "order p", "angular_momentum": "angular momentum m"}
SHARES = Declaration("normal", Support(low=0.0, high=1.0))
WHOLE = 99.99
"""The share of the largest group, per cent, from which on a group counts as whole."""


def late(study: StoredStudy) -> pd.DataFrame:
    """The trials, with the means of order, of angular momentum and of the share of the
    largest group over their last fifth.
    """
    series, trials = study.series, study.trials.set_index("trial_id")
    last = series[series["frame"] >= LATE * series["frame"].max()]
    means = last.groupby("trial_id")[[*METRICS, "largest_flock_share"]].mean()
    settings = trials[["zone_sums", "orientation_width", "replicate"]]
    return settings.join(means).dropna()


def _of(studies: Studies, metric: str, **settings: str | float) -> Floats:
    """The late means of a metric, of the trials with such settings."""
    rows = late(studies["states"])
    for name, value in settings.items():
        same = rows[name] == value
        rows = rows[same]
    return rows[metric].to_numpy(np.float64)


def order(studies: Studies, zone_sums: str, orientation_width: float) -> Floats:
    """The order over the last fifth, by trial."""
    settings = {"zone_sums": zone_sums, "orientation_width": orientation_width}
    return _of(studies, "polarization", **settings)


def momentum(studies: Studies, zone_sums: str, orientation_width: float) -> Floats:
    """The angular momentum over the last fifth, by trial."""
    settings = {"zone_sums": zone_sums, "orientation_width": orientation_width}
    return _of(studies, "angular_momentum", **settings)


def loosely_parallel(
    studies: Studies, zone_sums: str, orientation_width: float
) -> Floats:
    """100 for each trial that flies one way without being in full order, else 0."""
    found = order(studies, zone_sums, orientation_width)
    return np.where((found > 0.65) & (found < 0.98), 100.0, 0.0)


def memory_area(studies: Studies) -> Floats:
    """The area between the order on the way down and on the way up, by chain."""
    (one,) = find_loops(studies["memory"], "polarization", half=True)
    return np.trapezoid(one.down - one.up, one.values, axis=1)


def states(studies: Studies) -> Figure:
    """Order and angular momentum against the width of the zone of orientation: trials
    as dots, their means, and means of independent programs.
    """
    study = studies["states"]
    rows, known = late(study), pd.read_csv(PROGRAMS)
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 5.6))
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for line, (reading, (text, colour)) in zip(
            panels, READINGS.items(), strict=True
        ):
            for axes, (metric, label) in zip(line, METRICS.items(), strict=True):
                here = rows[rows["zone_sums"] == reading]
                _draw_means(axes, here, metric, colour)
                theirs = known[known["zone_sums"] == reading]
                axes.plot(
                    theirs["orientation_width"], theirs[metric], "kx", ms=8, zorder=4
                )
                axes.set_ylabel(f"{label}, {text}")
        for axes in panels[1]:
            axes.set_xlabel("width of the zone of orientation (r)")
        count = study.trials.groupby("point").size().max()
        note(
            figure,
            f"{study.name}: {count} trials a value, each a dot, means over the last"
            " fifth; lines: their means with 95 % intervals; crosses: independent"
            " programs",
        )
    return figure


def _draw_means(axes: Axes, rows: pd.DataFrame, metric: str, colour: str) -> None:
    """Each trial, and the means with intervals."""
    widths = rows["orientation_width"]
    axes.plot(widths, rows[metric], "o", color="0.6", ms=2.5)
    groups = rows.groupby("orientation_width")[metric]
    found = [
        mean_interval(values.to_numpy(np.float64), distribution=SHARES)
        for _, values in groups
    ]
    mean, low, high = np.array([(one.value, one.low, one.high) for one in found]).T
    axes.errorbar(
        sorted(set(widths)),
        mean,
        np.maximum([mean - low, high - mean], 0.0),
        fmt="-",
        lw=1.0,
        color=colour,
    )


PICTURES = (
    ("swarm", "plain_sums", 0.5, "polarization", False),
    ("torus", "plain_sums", 5.0, "angular_momentum", True),
    ("dynamic parallel", "unit_vectors", 12.0, "polarization", True),
    ("highly parallel", "plain_sums", 12.0, "polarization", True),
)
"""State, reading, width, and whether the trial shown has the most or the least of which
metric.
"""


def pictures(studies: Studies) -> Figure:
    """A trial of each state in its last frame."""
    study = studies["states"]
    rows = late(study)
    with style.context(STYLE):
        figure = Figure(figsize=(7.2, 7.6))
        for axes, (name, reading, width, metric, most) in zip(
            figure.subplots(2, 2).ravel(), PICTURES, strict=True
        ):
            here = rows[
                (rows["zone_sums"] == reading)
                & (rows["orientation_width"] == width)
                & (rows["largest_flock_share"] >= WHOLE)
            ]
            values = here[metric].to_numpy(np.float64)
            trial = here.iloc[values.argmax() if most else values.argmin()]
            bodies = study.trajectory(str(trial.name))[1][-1].copy()
            bodies[:2] -= np.median(bodies[:2], axis=1, keepdims=True)
            side = 1.1 * float(np.abs(bodies[:2]).max())
            draw_flock(axes, bodies, side / 16)
            axes.set(xlim=(-side, side), ylim=(-side, side), aspect="equal")
            axes.set(xlabel="x (r)", ylabel="y (r)")
            title = (
                f"{name}: p = {trial['polarization']:.2f},"
                f" m = {trial['angular_momentum']:.2f}\n"
                f"{READINGS[reading][0]}, width {width:g}"
            )
            axes.set_title(title, loc="left", fontsize=8)
        note(
            figure,
            f"{study.name}: of each state the trial that shows it most, by p or m over"
            " its last fifth, among those whose group is whole",
        )
    return figure


def memory(studies: Studies) -> Figure:
    """Order against a zone of orientation that widens, and then narrows."""
    return hysteresis_figure(studies["memory"], "polarization", half=True)


recorded_as_defined = partial(as_defined, spec="states")

FIGURES = {
    "states": Drawing(
        states,
        ("states",),
        "Order and angular momentum by the width of the zone of orientation.",
    ),
    "pictures": Drawing(pictures, ("states",), "A trial of each of the four states."),
    "memory": Drawing(
        memory,
        ("memory",),
        "Order by the width of the zone of orientation on the way up and down.",
    ),
}
