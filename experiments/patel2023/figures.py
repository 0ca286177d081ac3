"""Figures 10 to 18 of patel2023 from flights of our own, and what the document means by
potential and equilibrium.
"""

from functools import partial

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sweep.figures import (
    BLUE,
    GREEN,
    LINE_STYLES,
    ORANGE,
    PURPLE,
    SKY,
    STYLE,
    VERMILION,
    Drawing,
    draw_flock,
    draw_map,
    legend,
    name_rows,
    note,
)
from sweep.published.definitions import as_defined
from sweep.trial.world import TrialWorld

from .flights import (  # noqa: F401 (for published.yaml)
    FRAMES_A_SECOND,
    TOLERANCE,
    WINDOW,
    Flight,
    Floats,
    Studies,
    Truths,
    border_as_run,
    flights,
    flocks_as_intended,
    flocks_as_run,
    flocks_as_written,
    late_as_run,
    late_as_written,
    long_as_intended,
    long_as_run,
    long_as_written,
    lower_as_run,
    restored_as_run,
    restored_as_written,
    rock_as_run,
    settled_as_intended,
    settled_as_run,
    settled_as_written,
    several_as_intended,
    several_as_run,
    several_as_written,
    spacing_as_run,
    turns_as_intended,
    turns_as_run,
    turns_as_written,
    unlimited_as_intended,
    unlimited_as_run,
    unlimited_as_written,
)
from .populations import SECONDS, detector, equilibrium, potential, safety, weights

ROVERS = (
    *(BLUE, VERMILION, GREEN, PURPLE, "0.15"),
    *("#8C510A", "#542788", "#01665E", "#C51B7D", "#7F7F00"),
)
"""One colour each."""
ARROW = 0.4
"""Seconds: a line from a rover is its way in that time."""
ROCK = "#B2182B"
CHOICES = {
    1: "the first as run with a rover in equilibrium at 15 s",
    2: "the first as run with two rovers within reach of a rock at 5 s",
}


def _trial(studies: Studies, number: int) -> tuple[Flight, str]:
    """Our trial 1 or 2, chosen by CHOICES, and what it is; the very first where none
    fits.
    """
    found = flights(studies["trials"], "always")
    fits = [
        (f.settled[150].any() if number == 1 else f.rock[50].sum() >= 2) for f in found
    ]
    chosen = int(np.argmax(fits))
    return (
        found[chosen],
        f"trial {number}: replicate {chosen} of {len(found)}, {CHOICES[number]}",
    )


def trajectories(studies: Studies) -> Figure:
    """Figures 10, 13 and 14: where the rovers are, whence
    they came and where they go.
    """
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(10.2, 4.1))
        panels = figure.subplots(1, 3)
        for axes, (number, second, name) in zip(
            panels, ((2, 5, "10"), (1, 15, "13"), (1, 23, "14")), strict=True
        ):
            flight, _ = _trial(studies, number)
            _scene(axes, flight, second * FRAMES_A_SECOND)
            axes.set_title(f"trial {number} at {second} s (figure {name})")
        legend(figure, panels[0], 5)
        note(
            figure,
            "Ours, not the published draws.\n"
            + "; ".join(_trial(studies, number)[1] for number in (1, 2)),
        )
    return figure


def _scene(axes: Axes, flight: Flight, frame: int) -> None:
    rocks = np.column_stack(
        [flight.rocks, np.ones_like(flight.rocks), np.ones(len(flight.rocks))]
    )
    draw_map(axes, TrialWorld(100.0, 100.0, rocks), "m", face=ROCK, downwards=False)
    axes.plot([], [], "o", color=ROCK, label="rock")
    for x, y in flight.rocks:
        axes.add_patch(
            matplotlib.patches.Circle((x, y), 6.0, fill=False, ls=":", ec=ROCK, lw=0.8)
        )
    for edge, side, style, label in (
        (0, 100, "-", ""),
        (7.5, 85, "--", "margin of the border rule"),
    ):
        axes.add_patch(
            Rectangle(
                (edge, edge),
                side,
                side,
                fill=False,
                ec="0.4",
                lw=0.9,
                ls=style,
                label=label,
            )
        )
    axes.plot(
        flight.x[: frame + 1],
        flight.y[: frame + 1],
        color=ORANGE,
        lw=0.8,
        alpha=0.75,
        zorder=1,
    )
    axes.plot([], [], color=ORANGE, label="previous positions")
    x, y, (vx, vy) = flight.x[frame], flight.y[frame], flight.moves[frame]
    for i in range(len(x)):
        colour = ROVERS[i]
        axes.plot(
            [x[i], x[i] + ARROW * vx[i]],
            [y[i], y[i] + ARROW * vy[i]],
            color=colour,
            lw=1.2,
            zorder=3,
        )
        draw_flock(
            axes,
            np.array([x[i : i + 1], y[i : i + 1], vx[i : i + 1], vy[i : i + 1]]),
            5.0,
            colour,
        )
        axes.annotate(
            str(i + 1),
            (x[i], y[i]),
            (4, -8),
            textcoords="offset points",
            fontsize=7,
            color=colour,
            zorder=4,
        )
    settled = flight.settled[frame]
    axes.plot(
        x[settled],
        y[settled],
        "o",
        ms=13,
        mfc="none",
        mec=SKY,
        mew=1.6,
        zorder=2,
        label="in equilibrium",
    )
    axes.plot(
        [],
        [],
        color="0.15",
        marker=(3, 0, -90),
        label=f"rover, and its way in the next {ARROW:g} s",
    )
    axes.set(xlim=(-8, 108), ylim=(-8, 108))


def rovers(studies: Studies, number: int, first: int) -> Figure:
    """Figures 11, 12 and 15 to 18: what these plot, positions, and what their titles
    say, velocities.
    """
    flight, about = _trial(studies, number)
    chosen = range(first - 1, first + 4)
    columns = (("x", flight.x, flight.moves[:, 0]), ("y", flight.y, flight.moves[:, 1]))
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(8.2, 5.0))
        panels = figure.subplots(2, 2, sharex=True, sharey="row")
        for column, (name, position, velocity) in enumerate(columns):
            for axes, values in zip(
                panels[:, column], (position, velocity), strict=True
            ):
                _lines(axes, values, flight.settled, chosen)
            panels[0, column].set_title(
                f'{name} position: plotted as "{name.upper()} velocity"'
            )
            panels[1, column].set_title(f"{name} velocity")
            panels[1, column].set_xlabel(SECONDS)
        panels[0, 0].set(ylabel="position (m)", ylim=(-5, 105))
        panels[1, 0].set(ylabel="velocity (m/s)", ylim=(-10.5, 10.5))
        figure.legend(
            *panels[0, 0].get_legend_handles_labels(),
            loc="outside upper center",
            ncols=6,
        )
        note(figure, f"Ours, not the published draw: {about}")
    return figure


def _lines(axes: Axes, values: Floats, settled: Truths, chosen: range) -> None:
    times = np.arange(len(values)) / FRAMES_A_SECOND
    for i, style in zip(chosen, LINE_STYLES, strict=False):
        colour = ROVERS[i]
        axes.plot(
            times,
            np.where(settled[:, i], values[:, i], np.nan),
            color=colour,
            lw=5,
            alpha=0.3,
        )
        axes.plot(
            times,
            values[:, i],
            color=colour,
            ls=style,
            lw=1.1,
            label=f"rover {i + 1}",
        )
    axes.plot([], [], color="0.4", lw=5, alpha=0.3, label="in equilibrium")
    axes.margins(x=0)


def equilibrium_trial(studies: Studies) -> Figure:
    """When each rover of our trial 1 has company, when it is in equilibrium, and what
    acts on it.
    """
    flight, about = _trial(studies, 1)
    settled = np.zeros_like(flight.settled)
    for lag in range(round(WINDOW * FRAMES_A_SECOND)):
        settled[: len(settled) - lag] |= flight.settled[lag:]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(8.2, 3.8))
        axes = figure.subplots()
        for i in range(flight.x.shape[1]):
            _bars(axes, flight.company[:, i], i, "0.85", "another within 8 m")
            _bars(
                axes,
                settled[:, i],
                i,
                BLUE,
                f"in step with all within 8 m: {WINDOW:g} s, {100 * TOLERANCE:g} %",
            )
            for acts, marker, colour, label in (
                (flight.margin, "|", "0.1", "the border rule acts"),
                (flight.rock, "x", ROCK, "a rock acts"),
            ):
                frames = np.flatnonzero(acts[:, i])
                axes.plot(
                    frames / FRAMES_A_SECOND,
                    np.full(len(frames), i),
                    marker,
                    ms=6,
                    color=colour,
                    label=label,
                )
        name_rows(axes, [f"rover {i + 1}" for i in range(flight.x.shape[1])])
        axes.set(xlabel=SECONDS, xlim=(0, (len(flight.x) - 1) / FRAMES_A_SECOND))
        handles = dict(zip(*reversed(axes.get_legend_handles_labels()), strict=True))
        figure.legend(
            handles.values(), handles.keys(), loc="outside upper center", ncols=4
        )
        note(figure, about)
    return figure


def _bars(axes: Axes, true: Truths, row: int, colour: str, label: str) -> None:
    edges = (
        np.flatnonzero(np.diff(np.concatenate([[False], true, [False]]).astype(int)))
        / FRAMES_A_SECOND
    )
    spans = [
        (start, end - start) for start, end in zip(edges[::2], edges[1::2], strict=True)
    ]
    axes.broken_barh(spans, (row - 0.36, 0.72), facecolor=colour, label=label)


recorded_as_defined = partial(as_defined, spec="presets")

FIGURES = {
    "trajectories": Drawing(
        trajectories, ("trials",), "Figures 10, 13, 14: rovers, their trails and rocks."
    ),
    **{
        f"trial{number}_rovers_{first}_{first + 4}": Drawing(
            partial(rovers, number=number, first=first),
            ("trials",),
            f"{figures}: positions, which the document calls velocities, and velocities"
            " of five rovers.",
        )
        for number, first, figures in (
            (2, 1, "Figure 11"),
            (2, 6, "Figure 12"),
            (1, 1, "Figures 15 and 16"),
            (1, 6, "Figures 17 and 18"),
        )
    },
    "potential": Drawing(
        potential,
        ("presets",),
        "The pair potential of the rules, and potentials against time.",
    ),
    "equilibrium_trial": Drawing(
        equilibrium_trial, ("trials",), "Local equilibrium of each rover in one trial."
    ),
    "equilibrium": Drawing(
        equilibrium,
        ("presets",),
        "How much of the time rovers are in equilibrium.",
    ),
    "detector": Drawing(
        detector,
        ("trials", "detector"),
        "Rovers in equilibrium by what counts as one: tolerance, window and duration.",
    ),
    "weights": Drawing(
        weights,
        ("weights", "limits"),
        "Distances with twice the weight of a rule, and speeds without their limit.",
    ),
    "safety": Drawing(
        safety, ("safety",), "Collisions with rocks and exits from the arena."
    ),
}
