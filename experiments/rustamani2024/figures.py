"""Figures 1 to 7 of rustamani2024: pictures like the document's, and beside them what
it reads from them, measured.
"""

from collections.abc import Sequence
from functools import partial
from itertools import product

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.analysis import Declaration, Support, mean_interval
from sweep.figures import (
    BLUE,
    GREEN,
    ORANGE,
    SKY,
    STYLE,
    VERMILION,
    Drawing,
    draw_map,
    draw_values,
    legend,
    name_rows,
    note,
)
from sweep.published.definitions import as_defined
from sweep.tables.stored_study import StoredStudy

from .flights import (  # noqa: F401 (for published.yaml)
    ALGORITHMS,
    ALIGNMENT,
    ARRIVAL,
    BOTH,
    CLOSE,
    COHESION,
    FAR,
    PRESETS,
    SEEK,
    SEPARATION,
    Floats,
    Studies,
    accelerations,
    approach,
    arrival_against_seek,
    arrival_against_seek_as_written,
    arrival_slowing,
    arrival_slowing_as_written,
    avoidance_angle,
    avoiding,
    boids_alone,
    both_slowing,
    both_slowing_as_written,
    chosen,
    divergence_at_walls,
    divergence_at_walls_as_reported,
    first_flight,
    flights_of,
    only,
    opposite,
    opposite_as_written,
    seek_speed,
    seek_speed_as_written,
    velocity_spread,
    velocity_spread_as_written,
)
from .trails import BEYOND, draw_trails, draw_trial, events, mazes, priorities

RULES = {
    "separation": (SEPARATION, GREEN),
    "alignment": (ALIGNMENT, ORANGE),
    "cohesion": (COHESION, BLUE),
}
SPEEDS = Declaration("normal", Support(low=0.0))
SITUATIONS = {"arena": "without a goal", "field": "to a goal"}
LOOKS = ((BLUE, "o"), (VERMILION, "s"), (SKY, "D"), (ORANGE, "^"))
COMPARED = {"perception_range": "perception range", "fov": "half angle of view"}


def _draw_arrows(
    axes: Axes, places: Floats, arrows: Floats, colour: str, scale: float
) -> None:
    """Accelerations (2, K) at places (2, K), `scale` m/s^2 to a metre."""
    axes.quiver(
        *places,
        *arrows,
        color=colour,
        angles="xy",
        scale_units="xy",
        scale=scale,
        width=0.007,
        zorder=3,
    )


def rules(studies: Studies) -> Figure:
    """Figure 1: trails of boids under one rule, and its accelerations in the first
    step.
    """
    study = studies["rules"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.2, 5.2))
        panels = figure.subplots(2, 3)
        for (above, below), (rule, (rules, colour)) in zip(
            panels.T, RULES.items(), strict=True
        ):
            trial, flight = first_flight(study, **only(study, rules))
            acceleration = accelerations(flight[:2], trial["dt"])[0]
            for axes, reach in ((above, 4.0), (below, 0.9)):
                draw_map(axes, study.world(trial["trial_id"]), "m", downwards=False)
                axes.set(xlim=(5 - reach, 5 + reach), ylim=(5 - reach, 5 + reach))
            draw_trails(above, flight, [colour] * trial["n"])
            below.plot(*flight[0, :2], "o", markersize=4, color="0.25")
            most = float(np.hypot(*acceleration).max())
            _draw_arrows(below, flight[0, :2], acceleration, colour, most / 0.4)
            above.set_title(f"{rule} alone, {trial['steps'] * trial['dt']:g} s")
            below.set_title(f"at the start, up to {most:.2f} m/s²", fontsize=8.5)
        note(
            figure,
            f"{study.name}: the first trial, {trial['n']} boids, the same start;"
            " arrows: accelerations",
        )
    return figure


def navigation(studies: Studies) -> Figure:
    """Figure 2: trails to the goal, accelerations of seek, and speed against the
    distance from the goal.
    """
    study = studies["navigation"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.4, 3.4))
        left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.15))
        for axes, rules in ((left, SEEK), (middle, ARRIVAL)):
            draw_trial(axes, study, **only(study, rules))
        trial, flight = first_flight(study, **only(study, SEEK))
        acceleration = accelerations(flight[:2], 2 * trial["dt"])[0]
        most = float(np.hypot(*acceleration).max())
        _draw_arrows(left, flight[0, :2], acceleration, "0.15", most / 1.5)
        left.set_title(f"seek; acceleration up to {most:.1f} m/s²", fontsize=8.5)
        middle.plot(
            *first_flight(study, **only(study, ARRIVAL))[1][::25, :2]
            .reshape(-1, 2, trial["n"])
            .swapaxes(0, 1),
            "k.",
            markersize=2.5,
        )
        middle.set_title("arrival; a dot every 5 s", fontsize=8.5)
        _draw_speeds(right, studies)
        legend(figure, right, columns=3)
        trials = len(flights_of(study, only(study, SEEK)))
        about = (
            f"{study.name}: the first trial of each, goal in red; right: {trials}"
            " trials each, mean speed of boids that"
        )
        note(
            figure,
            f"{about}\nhave not yet been within {CLOSE:g} m of the goal, from 2 s on,"
            " pointwise 95 % interval",
        )
    return figure


def _draw_speeds(axes: Axes, studies: Studies) -> None:
    """Mean speed against the distance from the goal on the way there, for seek, arrival
    and both, and both presets.
    """
    edges = np.linspace(CLOSE, 6.0, 24)
    for (ending, preset), line in zip(ALGORITHMS.items(), "-:", strict=True):
        study = studies["navigation" + ending]
        kinds = (
            (SEEK, BLUE, "seek"),
            (ARRIVAL, VERMILION, "arrival"),
            (BOTH, GREEN, "both"),
        )
        for rules, colour, name in kinds:
            trials = [
                _speed_by_distance(study, flight, edges)
                for flight in flights_of(study, only(study, rules))
            ]
            table = np.array(
                [
                    mean_interval(values, distribution=SPEEDS)
                    for values in np.transpose(trials)
                ]
            )
            centres = 0.5 * (edges[1:] + edges[:-1])
            axes.plot(
                centres,
                table[:, 0],
                line,
                color=colour,
                label=f"{name}, {preset}",
            )
            axes.fill_between(
                centres, table[:, 1], table[:, 2], color=colour, alpha=0.2, lw=0
            )
    axes.set(
        xlabel="distance from the goal (m)",
        ylabel="speed (m/s)",
        xlim=(0, 6),
        ylim=(0, None),
    )


def _speed_by_distance(study: StoredStudy, flight: Floats, edges: Floats) -> Floats:
    """Mean speed of boids in each interval of distance, before they first come CLOSE
    and from 2 s on.
    """
    speed, distance, times = approach(study, flight)
    way = (np.cumsum(distance < CLOSE, axis=0) == 0) & (times[:, None] >= 2.0)
    sums, _ = np.histogram(distance[way], edges, weights=speed[way])
    counts, _ = np.histogram(distance[way], edges)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def avoidance(studies: Studies) -> Figure:
    """Figure 3: accelerations beside a disc without any other rule, and a swarm that
    passes both obstacles.
    """
    names = ("avoidance_alone", "avoidance_paths", "avoidance")
    alone, paths, many = (studies[name] for name in names)
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.2, 3.9))
        left, right = figure.subplots(1, 2)
        draw_map(left, alone.world(alone.trials["trial_id"][0]), "m", downwards=False)
        left.set(xlim=(1.2, 5.8), ylim=(1.2, 5.8))
        for flight in flights_of(alone, {})[:10]:
            change, due, _ = avoiding(alone, flight)
            for i in np.flatnonzero(due.any(axis=0)):
                left.plot(*flight[:, :2, i].T, color="0.6", linewidth=0.7)
                _draw_arrows(
                    left,
                    flight[:-1, :2, i][due[:, i]].T,
                    change[due[:, i], :, i].T,
                    VERMILION,
                    6.6 / 0.5,
                )
        draw_trial(right, paths)
        right.set_title("all rules, five of ten know the goal")
        left.set_title("avoidance alone, first ten trials")
        one = events(paths, "collisions")
        about = (
            "left: accelerations near the disc, 0.5 m for 6.6 m/s²; right: first trial,"
            f" goal in red, blue boids know it; entries into obstacles: {one} there,"
            f" {events(many, 'collisions')} a trial on average of"
            f" {len(chosen(many, {}))}; escapes: {events(many, 'escapes')}"
        )
        note(figure, f"{alone.name} and {paths.name}\n{about}")
    return figure


def perception(studies: Studies) -> Figure:
    """Figure 4: trails by perception range, the share of the largest flock and the
    number of flocks.
    """
    values = (
        ("largest_flock_share_mean", "boids in the largest flock (%)"),
        ("flock_count_mean", "flocks"),
    )
    names = [f"{value:g} m" for value in (0.6, 1.2, 2.4)]
    figure, below = _compare(
        *(studies, "perception", "perception_range", (0.6, 1.2, 2.4), names, values),
        "dotted: bounds of the claims",
    )
    below[0].set(xlim=(0, 101))
    for bound in (70, 95):
        below[0].axvline(bound, color="0.6", linewidth=0.8, linestyle=":")
    return figure


def field_of_view(studies: Studies) -> Figure:
    """Figure 5: trails by field of view, boids that left the flock, its elongation."""
    values = (
        ("boids_lost_mean", "boids outside the largest flock"),
        ("elongation_mean", "elongation (1 column, 0 round, -1 front)"),
    )
    names = ["π/2.2", "π/1.4", "π"]
    figure, below = _compare(
        *(studies, "field_of_view", "fov", (163.636, 257.143, 360.0), names, values),
        "grey: what the claims take for round",
    )
    below[1].axvspan(-0.15, 0.15, color="0.93", lw=0)
    return figure


def _compare(
    studies: Studies,
    spec: str,
    setting: str,
    levels: Sequence[float],
    names: Sequence[str],
    values: Sequence[tuple[str, str]],
    bounds: str,
) -> tuple[Figure, list[Axes]]:
    """Trails in both situations for each level of `setting`, and below them means with
    intervals of `values`. `bounds` says what the caller draws of the claims.
    """
    paths, study = studies[f"{spec}_paths"], studies[spec]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.4, 9.4))
        top, bottom = figure.subfigures(2, 1, height_ratios=(6.6, 2.4))
        pictures = top.subplots(
            len(levels), len(SITUATIONS), squeeze=False, width_ratios=(12, 32)
        )
        for row, level, name in zip(pictures, levels, names, strict=True):
            for axes, (situation, words) in zip(row, SITUATIONS.items(), strict=True):
                draw_trial(axes, paths, map=situation, **{setting: level})
                axes.set_title(f"{name}, {words}")
                axes.label_outer()
        top.suptitle(f"as run, by {COMPARED[setting]}", fontsize=9)
        panels = list(bottom.subplots(1, len(values), squeeze=False)[0])
        for axes, (metric, label) in zip(panels, values, strict=True):
            _draw_levels(axes, studies, spec, setting, levels, metric)
            name_rows(axes, names)
            axes.set_xlabel(label)
        handles, labels = panels[0].get_legend_handles_labels()
        bottom.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8)
        trials = len(chosen(study, {"map": "arena", setting: levels[0]}))
        left = " and ".join(
            f"{events(study, 'escapes', map=situation)} {words}"
            for situation, words in SITUATIONS.items()
        )
        note(
            figure,
            f"{paths.name}: the first trials, with what lies {BEYOND:g} m behind the"
            f" borders; below {trials} trials each, mean of their last halves, 95 %"
            f" intervals, {bounds}; times a trial that boids leave the world: {left}",
        )
    return figure, panels


def _draw_levels(
    axes: Axes,
    studies: Studies,
    spec: str,
    setting: str,
    levels: Sequence[float],
    metric: str,
) -> None:
    """The mean and interval of `metric` at each level, in both situations and with both
    presets.
    """
    looks = zip(
        (-0.24, -0.08, 0.08, 0.24), product(PRESETS, SITUATIONS), LOOKS, strict=True
    )
    for shift, (ending, situation), (colour, marker) in looks:
        study = studies[spec + ending]
        found = [
            study.mean_of(
                metric, chosen(study, {"map": situation, setting: level})[metric]
            )[:3]
            for level in levels
        ]
        label = f"{SITUATIONS[situation]}, {PRESETS[ending]}"
        draw_values(
            axes,
            np.arange(len(levels)) + shift,
            tuple(np.transpose(found)),
            colour,
            marker,
            label,
        )


_COMPARED = {
    spec: (spec, f"{spec}_as_reported", f"{spec}_paths")
    for spec in ("perception", "field_of_view")
}
recorded_as_defined = partial(as_defined, spec="rules")

FIGURES = {
    "figure1_rules": Drawing(
        rules, ("rules",), "Figure 1: separation, alignment and cohesion alone."
    ),
    "figure2_navigation": Drawing(
        navigation,
        ("navigation", "navigation_as_written"),
        "Figure 2: seek and arrival, and how speed falls near the goal.",
    ),
    "figure3_avoidance": Drawing(
        avoidance,
        ("avoidance_alone", "avoidance_paths", "avoidance"),
        "Figure 3: steering round obstacles, alone and with all rules.",
    ),
    "figure4_perception": Drawing(
        perception,
        _COMPARED["perception"],
        "Figure 4: one flock or several, by perception range.",
    ),
    "figure5_field_of_view": Drawing(
        field_of_view,
        _COMPARED["field_of_view"],
        "Figure 5: boids lost and the shape of the flock, by half angle of view.",
    ),
    "figures6_7": Drawing(
        mazes,
        ("priorities_paths",),
        "Figures 6 and 7: safety first and flocking first in a maze.",
    ),
    "figures6_7_measures": Drawing(
        priorities,
        ("priorities", "priorities_as_reported"),
        "What is read from figures 6 and 7, measured.",
    ),
}
