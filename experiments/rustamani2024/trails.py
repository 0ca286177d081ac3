"""Trails of boids as the document draws them, and its figures 6 and 7 with what is read
from them.
"""

from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from sweep.figures import (
    BLUE,
    ORANGE,
    STYLE,
    draw_flock,
    draw_map,
    draw_values,
    name_rows,
    note,
)
from sweep.tables.stored_study import StoredStudy

from .flights import (
    PRESETS,
    WAY,
    Floats,
    Studies,
    chosen,
    first_flight,
)

LEADER, FOLLOWER = BLUE, ORANGE
BEYOND = 1.0
"""How far behind the border of the world pictures show boids, m."""


def draw_trails(axes: Axes, flight: Floats, colours: Sequence[str]) -> None:
    """Where boids flew, paler the longer ago; where they started, hollow, and how they
    fly at the end.
    """
    fade = np.linspace(0.25, 0.9, len(flight) - 1)
    for i, colour in enumerate(colours):
        points = flight[:, :2, i]
        parts = np.stack([points[:-1], points[1:]], axis=1)
        axes.add_collection(
            LineCollection(
                list(parts), colors=colour, linewidths=0.9, alpha=fade, rasterized=True
            )
        )
        axes.plot(
            *points[0],
            "o",
            markersize=2.6,
            markerfacecolor="white",
            markeredgecolor=colour,
            markeredgewidth=0.7,
        )
    for colour in sorted(set(colours)):
        draw_flock(
            axes,
            flight[-1][:, np.array(colours) == colour],
            0.022 * np.ptp(axes.get_xlim()),
            colour,
        )


def _show_beyond(axes: Axes, width: float, height: float) -> None:
    """Draw the border, which boids may leave, and show BEYOND behind it."""
    axes.add_patch(
        Rectangle((0.0, 0.0), width, height, fill=False, edgecolor="0.3", linewidth=0.8)
    )
    axes.set(xlim=(-BEYOND, width + BEYOND), ylim=(-BEYOND, height + BEYOND))
    axes.locator_params(steps=[1, 2, 5, 10])
    axes.spines[:].set_visible(False)
    axes.tick_params(length=0)


def events(study: StoredStudy, metric: str, **settings: Any) -> str:
    """How often something happens in a trial with these settings, in words."""
    return f"{chosen(study, settings)[metric].mean():.2g}"


def draw_trial(axes: Axes, study: StoredStudy, **settings: Any) -> None:
    """The map of the first trial with these settings, its boids' trails and, where some
    boid knows it, the goal.
    """
    trial, flight = first_flight(study, **settings)
    world = study.world(trial["trial_id"])
    draw_map(axes, world, "m", downwards=False)
    _show_beyond(axes, world.width, world.height)
    leaders = int(np.floor(trial["leader_share"] * trial["n"] + 0.5))
    colours = [LEADER] * leaders + [FOLLOWER] * (trial["n"] - leaders)
    draw_trails(axes, flight, colours)
    if leaders:
        goal = trial["goal_x"], trial["goal_y"]
        axes.plot(
            *goal, "X", markersize=7, color="#CC0000", markeredgecolor="white", zorder=4
        )


SCENARIOS = {
    "safety_first": "scenario 1, safety first",
    "flocking_first": "scenario 2, flocking first",
}
MEASURES = {
    "collisions": "entries into walls",
    "boid_collisions": "contacts of boids",
    "dead_end_time": "time without a free\nheading (s)",
    "share_arrived": "arrived (%)",
    "time_to_goal": "time to the goal (s)",
    "least_clearance": "least distance\nfrom a wall (m) *",
    "nearest_neighbour_distance": "nearest\nneighbour (m) *",
    "polarization": "polarization *",
    "flock_radius": "flock radius (m) *",
    "flock_radius_mean": "flock radius from\n15 s on (m)",
}

MOST = {"share_arrived": 102.0, "polarization": 1.02}
"""Where axes end that have a largest value; all begin at zero."""


def mazes(studies: Studies) -> Figure:
    """Figures 6 and 7: trails in the maze of ours with safety first and with flocking
    first.
    """
    study = studies["priorities_paths"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.2, 4.3))
        for axes, (priority, title) in zip(
            figure.subplots(1, 2), SCENARIOS.items(), strict=True
        ):
            draw_trial(axes, study, priority=priority)
            axes.set_title(title)
        note(
            figure,
            f"{study.name}: the first trial, the same start, with what lies"
            f" {BEYOND:g} m behind the borders; goal in red, blue boids know it,"
            " orange ones do not",
        )
    return figure


def _values(study: StoredStudy, priority: str, metric: str) -> Floats:
    """One value a trial: the mean over WAY of what is recorded as a series, else that
    of the trials table.
    """
    trials = chosen(study, {"priority": priority})
    if metric not in study.series:
        return trials[metric].to_numpy(np.float64)
    way = (
        study.series[study.series["frame"].between(*WAY)]
        .groupby("trial_id")[metric]
        .mean()
    )
    return way.loc[trials["trial_id"]].to_numpy()


def priorities(studies: Studies) -> Figure:
    """What section 3.2.3 reads from figures 6 and 7, measured, with both presets."""
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.4, 3.7))
        panels = figure.subplots(2, 5).ravel()
        looks = list(
            zip((-0.1, 0.1), SCENARIOS.items(), (BLUE, ORANGE), "os", strict=True)
        )
        for number, (metric, label) in enumerate(MEASURES.items()):
            for shift, (priority, title), colour, marker in looks:
                named = [studies[f"priorities{ending}"] for ending in PRESETS]
                value, low, high, _ = np.transpose(
                    [
                        study.mean_of(metric, _values(study, priority, metric))
                        for study in named
                    ]
                )
                draw_values(
                    panels[number],
                    np.arange(2) + shift,
                    (value, low, high),
                    colour,
                    marker,
                    title,
                )
            name_rows(
                panels[number], ["", ""] if number % 5 else list(PRESETS.values())
            )
            panels[number].set_xlabel(label, fontsize=8)
            panels[number].set_xlim(
                min(0.0, panels[number].get_xlim()[0]), MOST.get(metric)
            )
        figure.legend(
            *panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2
        )
        study = studies["priorities"]
        trials = len(chosen(study, {"priority": "safety_first"}))
        note(
            figure,
            f"{study.name}: {trials} trials each, mean with 95 % interval; * from 3 to"
            f" 12 s; boids leave the maze {events(study, 'escapes')} times a trial",
        )
    return figure
