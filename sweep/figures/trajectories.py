"""Trajectories of trials: fading paths of boids, and their last positions."""

from collections.abc import Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
from matplotlib import style
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from sweep.errors import ChoiceError
from sweep.figures.drawing import (
    colours_of_kinds,
    draw_flock,
    draw_map,
    legend_of,
    note,
    number_goals,
    span,
    title_panel,
)
from sweep.figures.planning import Choices, FigureKind, Planned
from sweep.figures.selection import Facet, Selection, among, select
from sweep.figures.style import SKY, STYLE, VERMILION
from sweep.tables import StoredStudy, stored_parts
from sweep.trial import TrialWorld

Floats = NDArray[np.float64]

MOST_TRIALS = 4
BOID = 0.022
"""The length of the triangle of a boid, as a fraction of the width of the map."""
BOIDS = "0.1"
"""The colour of boids without a kind."""
FADING = 3


class Trajectories(NamedTuple):
    """The contents of a figure of trajectories: a panel per trial.

    Each trial has the facet of its point.
    """

    selection: Selection
    trials: list[tuple[Facet, "pd.Series[Any]"]]


def trajectories_figure(
    study: StoredStudy,
) -> Figure:
    """Draw the trajectories of up to four trials.

    The figure shows the first trial of each point, or the first few trials of one or
    two points. Trails fade from the last recorded frame back to the first. Triangles
    are the boids in the last frame. Each kind of boids has a colour. Obstacles are
    grey, and a goal that a rule seeks is a cross.

    Parameters
    ----------
    study : StoredStudy
        A study with stored trajectories.

    Returns
    -------
    Figure

    Raises
    ------
    ChoiceError
        If no trajectories are stored, or there are more than four points.

    Examples
    --------
    >>> figure = trajectories_figure(sweep.load("my/map"))
    >>> for axes in figure.axes[:2]:
    ...     print(axes.get_title())
    cohesion weight = 0.01, replicate 0
    cohesion weight = 0.01, replicate 1
    """
    return draw_trajectories(trajectories_layout(study))


def trajectories_layout(
    study: StoredStudy,
) -> Trajectories:
    """Return the layout of `trajectories_figure`, or raise ChoiceError."""
    selection = select(study)
    if (
        "vx"
        not in study.store.read(
            "trajectories", trial_ids=pa.array([], pa.string())
        ).column_names
    ):
        raise ChoiceError(
            "has no trajectories; record: {trajectories: true} stores trajectories",
            study.name,
        )
    settings = [*selection.apart(selection.sampled), *selection.sampled]
    facets = selection.facets(settings)
    if len(facets) > MOST_TRIALS:
        raise ChoiceError(
            f"of {len(facets):,} points, by"
            f" {', '.join(settings)}; allowed: up to {MOST_TRIALS}; choose with where,"
            f" {selection.example(settings)}",
            study.name,
            "trajectories",
        )
    done = selection.trials[selection.trials["status"] == "done"]
    chosen = [
        (facet, among(done, facet.points).head(MOST_TRIALS // len(facets)))
        for facet in facets
    ]
    return Trajectories(
        selection,
        [(facet, row) for facet, trials in chosen for _, row in trials.iterrows()],
    )


def draw_trajectories(layout: Trajectories) -> Figure:
    """Draw the figure of a layout."""
    selection, trials = layout
    (stored,) = stored_parts(selection.study)
    unit = selection.study.units.get("width", "")
    with style.context(STYLE):
        across = min(2, len(trials))
        down = -(-len(trials) // across)
        # Not from the rows of the trials, which are not checked.
        worlds = [stored.world(row["trial_id"]) for _, row in trials]
        height = max(world.height / world.width for world in worlds)
        width = 4.8 if across == 1 else 7.2
        figure = Figure(
            figsize=(
                width,
                0.7 + down * (0.75 + height * (width - 0.8 * across) / across),
            )
        )
        panels = figure.subplots(down, across, squeeze=False).ravel()
        frames = [
            _panel(
                axes,
                stored,
                row,
                world,
                unit=unit,
                title=[*facet.title.split(", "), _replicate(row)],
                across=across,
            )
            for axes, (facet, row), world in zip(panels, trials, worlds, strict=False)
        ]
        for axes in panels[len(trials) :]:
            axes.set_axis_off()
        _legend(figure, dict.fromkeys(kind for world in worlds for kind in world.kinds))
        goal = "; cross: goal" if any(world.goals for world in worlds) else ""
        text = (
            "one trial per panel, of {n} that are done;"
            f" frames 0 to {span(frames)}{goal}"
        )
        note(
            figure,
            selection.note(text, [int((selection.trials["status"] == "done").sum())]),
        )
    return figure


def _panel(
    axes: Axes,
    study: StoredStudy,
    trial: "pd.Series[Any]",
    world: TrialWorld,
    unit: str,
    title: list[str],
    across: int,
) -> int:
    """Draw a trial, and return the last frame."""
    frames, states = study.trajectory(trial["trial_id"])
    world = world.at(int(frames[-1]))
    draw_map(axes, world, unit, downwards=world.y_down)
    _widen(axes, states[:, :2], (world.width, world.height))
    points = world.obstacles[world.obstacles[:, 2] == 0.0]
    axes.plot(
        points[:, 0],
        points[:, 1],
        linestyle="none",
        marker="o",
        markersize=3,
        color="0.6",
    )
    by_kind = colours_of_kinds(world.kinds)
    colours = [by_kind[kind] for kind, n in world.kinds.items() for _ in range(n)]
    _trails(axes, states[:, :2], (world.width, world.height), colours or SKY)
    draw_flock(axes, states[-1], BOID * world.width, colours or BOIDS)
    if world.goals:
        axes.plot(
            *np.transpose(world.goals),
            "X",
            linestyle="none",
            markersize=7,
            color=VERMILION,
            markeredgecolor="white",
            zorder=4,
        )
        number_goals(axes, world, VERMILION)
    title_panel(axes, [", ".join(part for part in title if part)], across)
    return int(frames[-1])


def _widen(axes: Axes, places: Floats, size: tuple[float, float]) -> None:
    """Extend the limits to boids outside the world, if any, and draw the border."""
    low = np.minimum(places.min(axis=(0, 2)), 0.0)
    high = np.maximum(places.max(axis=(0, 2)), size)
    if (low < 0.0).any() or (high > size).any():
        axes.add_patch(
            Rectangle(
                (0.0, 0.0),
                *size,
                fill=False,
                edgecolor="0.5",
                linestyle="--",
                linewidth=0.8,
            )
        )
        downwards = axes.yaxis_inverted()
        axes.set(
            xlim=(low[0], high[0]),
            ylim=(high[1], low[1]) if downwards else (low[1], high[1]),
        )


def _legend(figure: Figure, kinds: Iterable[str]) -> None:
    """Put a legend of the kinds of boids above the figure, if there are any."""
    colours = colours_of_kinds(kinds)
    marks = [
        Line2D([], [], linestyle="none", marker=">", color=colour)
        for colour in colours.values()
    ]
    if marks:
        legend_of(figure, marks, list(colours))


def _trails(
    axes: Axes, places: Floats, size: tuple[float, float], colour: str | list[str]
) -> None:
    """Draw the paths of boids, positions (F, 2, N), in one colour or a colour per boid.

    Jumps across a periodic border are left out.
    """
    steps = np.stack([places[:-1], places[1:]], axis=1).transpose(0, 3, 1, 2)
    jumps = (np.abs(steps[:, :, 1] - steps[:, :, 0]) > np.array(size) / 2).any(axis=2)
    fade = np.broadcast_to(
        np.linspace(0.0, 1.0, len(steps) + 1)[1:, None] ** FADING, jumps.shape
    )
    colours = np.broadcast_to(np.array(colour), jumps.shape)
    lines = LineCollection(
        list(steps[~jumps]),
        colors=list(colours[~jumps]),
        alpha=0.8 * fade[~jumps],
        linewidths=0.8,
        rasterized=True,
    )
    axes.add_collection(lines)


def _replicate(trial: "pd.Series[Any]") -> str:
    return (
        f"seed {trial['seed']}"
        if trial["seed_listed"]
        else f"replicate {trial['replicate']}"
    )


def plan(study: StoredStudy, _: Choices) -> list[Planned]:
    """Plan one figure of a few trials. Raises ChoiceError if the kind does not suit."""
    return [
        Planned(
            "",
            partial(draw_trajectories, trajectories_layout(study)),
        )
    ]


KIND = FigureKind("trajectories of a few trials", (), plan)
