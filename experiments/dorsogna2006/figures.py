"""What D'Orsogna et al. (2006) say of rings, mills and collapse, beside what follows
exactly from the forces.
"""

import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sweep.analysis import mean_interval
from sweep.figures import (
    BLUE,
    GREY,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    legend,
    note,
)
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]
Studies = Mapping[str, StoredStudy]

PROGRAMS = Path(__file__).with_name("programs.csv")
"""Means of whole flights by programs that were written from the equations alone, with
Runge-Kutta steps, and share no code with this one: constants A are those of preset
as_written, B those of preset mill.
"""
SIZES = 50, 200
"""The numbers of boids whose areas are compared."""


def area_growth(
    studies: Studies, repulsion_strength: float, repulsion_length: float
) -> Floats:
    """How fast the area of the swarm grows with the number of boids, by replicate: the
    power of N. 0 where more boids take no more room, 1 where each has its own.
    """
    trials = studies["stability"].trials
    here = trials[
        np.isclose(trials["repulsion_strength"], repulsion_strength)
        & np.isclose(trials["repulsion_length"], repulsion_length)
    ]
    radii = here.pivot(index="replicate", columns="n", values="flock_radius")
    few, many = SIZES
    ratio = (radii[many] / radii[few]).to_numpy(np.float64)
    return 2.0 * np.log(ratio) / math.log(many / few)


def pull(n: int, radius: Floats, constants: Mapping[str, float]) -> Floats:
    """The force towards the centre of a ring on each of its `n` boids, by Eq. (3)."""
    sines = np.sin(math.pi * np.arange(1, n) / n)
    r = 2.0 * radius[:, None] * sines
    slopes = {
        kind: constants[f"{kind}_strength"]
        / constants[f"{kind}_length"]
        * np.exp(-r / constants[f"{kind}_length"])
        for kind in ("attraction", "repulsion")
    }
    total: Floats = ((slopes["attraction"] - slopes["repulsion"]) * sines).sum(axis=1)
    return total


def rings(studies: Studies) -> Figure:
    """The balance of forces on a ring of n boids by its radius, and the radii at which
    random boxes of boids end.
    """
    study = studies["rings"]
    trials = study.trials
    first = trials.iloc[0]
    constants = {
        f"{kind}_{what}": float(first[f"{kind}_{what}"])
        for kind in ("attraction", "repulsion")
        for what in ("strength", "length")
    }
    square = float(first["propulsion"] / first["friction"])
    radius = np.geomspace(0.1, 8.0, 400)
    with style.context(STYLE):
        figure = Figure(figsize=(6.4, 3.8))
        axes = figure.subplots()
        colours = ("0.45", BLUE, VERMILION, "0.1")
        for colour, (n, here) in zip(colours, trials.groupby("n"), strict=True):
            count = int(np.float64(n))  # type: ignore[arg-type]
            axes.plot(
                radius,
                radius * pull(count, radius, constants) / square,
                color=colour,
                label=f"N = {count}",
            )
            ends = here["flock_radius"].to_numpy(np.float64)
            ends = ends[ends < radius[-1]]
            axes.plot(ends, np.ones_like(ends), "o", color=colour, ms=6, mfc="none")
        axes.axhline(1.0, color=GREY, lw=0.8)
        axes.set(
            xscale="log",
            xlabel=f"radius ({study.units['flock_radius']})",
            ylabel="pull / what holds a boid on the ring",
        )
        axes.set_xticks([0.1, 0.2, 0.5, 1, 2, 5], ["0.1", "0.2", "0.5", "1", "2", "5"])
        axes.minorticks_off()
        legend(figure, axes)
        replicates = trials.groupby("point").size().max()
        note(
            figure,
            f"{study.name}: a ring is possible where a curve crosses 1; circles: where"
            f" {replicates} random boxes of each N ended; those of N = 20 flew apart",
        )
    return figure


def patterns(studies: Studies) -> Figure:
    """Where boids are in the end: a ring, a mill, and swarms without propulsion of two
    sizes, on either side of C l^2 = 1.
    """
    panels: tuple[tuple[str, dict[str, float], str], ...] = (
        ("rings", {"n": 60}, "ring, N = 60"),
        ("mill", {"n": 100}, "mill, N = 100"),
        *(
            (
                "stability",
                {"n": n, "repulsion_strength": strength, "repulsion_length": 0.5},
                f"C l² = {strength / 4:g}, N = {n}",
            )
            for strength in (2.8, 5.6)
            for n in SIZES
        ),
    )
    with style.context(STYLE):
        figure = Figure(figsize=(8.4, 5.8))
        for axes, (spec, settings, title) in zip(
            figure.subplots(2, 3).ravel(), panels, strict=True
        ):
            _draw_end(axes, studies[spec], settings)
            axes.set_title(title, loc="left", fontsize=8)
        note(
            figure,
            "one trial each; lengths in the unit of the paper; boids of the last four"
            " panels have come to rest",
        )
    return figure


def _draw_end(axes: Axes, study: StoredStudy, settings: Mapping[str, float]) -> None:
    """The last frame of the first trial with such settings, about its centre."""
    trials = study.trials
    for name, value in settings.items():
        trials = trials[np.isclose(trials[name], value)]
    trial = trials.sort_values("replicate").iloc[0]
    bodies = study.trajectory(trial["trial_id"])[1][-1].copy()
    bodies[:2] -= bodies[:2].mean(axis=1, keepdims=True)
    side = 1.15 * float(np.abs(bodies[:2]).max())
    draw_flock(axes, bodies, side / 18)
    axes.set(xlim=(-side, side), ylim=(-side, side), aspect="equal")
    axes.set(xlabel="x (l)", ylabel="y (l)")


def stability(studies: Studies) -> Figure:
    """The growth of the area with the number of boids, against C l^2."""
    study = studies["stability"]
    pairs = study.trials[["repulsion_strength", "repulsion_length"]].drop_duplicates()
    with style.context(STYLE):
        figure = Figure(figsize=(5.6, 3.6))
        axes = figure.subplots()
        axes.axvline(1.0, color=GREY, lw=0.8)
        lengths = np.unique(pairs["repulsion_length"]).tolist()
        for length, colour in zip(lengths, (BLUE, VERMILION), strict=True):
            strengths = pairs["repulsion_strength"][pairs["repulsion_length"] == length]
            found = pd.DataFrame(
                [_growth_row(studies, one, length) for one in sorted(strengths)]
            )
            axes.errorbar(
                found["place"],
                found["value"],
                (found["value"] - found["low"], found["high"] - found["value"]),
                fmt="o-",
                ms=4,
                lw=0.8,
                color=colour,
                label=f"l = {length:g}",
            )
        axes.set(xlabel="C l²", ylabel="power of N in the area")
        legend(figure, axes)
        few, many = SIZES
        count = study.trials.groupby("point").size().max()
        note(
            figure,
            f"{study.name}: {many} boids against {few}, {count} trials each, 95 %"
            " intervals; line: the exact boundary for infinitely many",
        )
    return figure


def _growth_row(studies: Studies, strength: float, length: float) -> dict[str, float]:
    growths = area_growth(studies, strength, length)
    interval = mean_interval(growths, distribution="normal")
    place = strength * length**2
    return {
        "place": place,
        "value": interval.value,
        "low": interval.low,
        "high": interval.high,
    }


recorded_as_defined = partial(as_defined, spec="rings")

FIGURES = {
    "rings": Drawing(
        rings, ("rings",), "Where rings are possible, and where random boxes end."
    ),
    "patterns": Drawing(
        patterns,
        ("rings", "mill", "stability"),
        "A ring, a mill, and swarms on either side of C l^2 = 1.",
    ),
    "stability": Drawing(
        stability,
        ("stability",),
        "The area of a swarm by its number of boids, against C l^2.",
    ),
}
