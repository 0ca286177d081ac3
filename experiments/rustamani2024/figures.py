"""Figures 1 to 7 of rustamani2024, with what the document reads from its pictures as measures, and those of its claims.

Lengths are metres, times seconds, y upwards. Accelerations are changes of velocity over a step: exact as long as the
speed is not at its limit. A flight is x, y, vx and vy of the boids of one trial in its recorded frames, (F, 4, N).
"""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from itertools import product
from typing import Any

import matplotlib
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from sweep.analysis import mean_interval
from sweep.figures import STYLE, Drawing
from sweep.plots import BLUE, GREEN, ORANGE, SKY, VERMILION, draw_flock, draw_map, draw_values, name_rows, note
from sweep.study import StoredStudy

Studies = dict[str, StoredStudy]
Floats = NDArray[np.float64]
Settings = Mapping[str, Any]

RULES = {
    "separation": ({"separation_weight": 1.8}, GREEN),
    "alignment": ({"alignment_weight": 1.4}, ORANGE),
    "cohesion": ({"cohesion_weight": 0.5}, BLUE),
}
SEEK, ARRIVAL, BOTH = (
    {"seek_weight": seek, "arrival_weight": arrival} for seek, arrival in ((0.4, 0), (0, 1.5), (0.4, 1.5))
)
FAR, CLOSE = 2.0, 0.25
"""Distances from the goal beyond which a boid is on its way, and at which it has come close, m."""
LEADER, FOLLOWER = BLUE, ORANGE
SITUATIONS = {"arena": "without a goal", "field": "to a goal"}
LOOKS = ((BLUE, "o"), (VERMILION, "s"), (SKY, "D"), (ORANGE, "^"))
COMPARED = {"perception_range": "perception range", "fov": "half angle of view"}
PRESETS = {"": "as run", "_as_written": "as written"}


def _flight(study: StoredStudy, **settings: Any) -> tuple["pd.Series[Any]", Floats]:
    """The first trial with these settings, and its flight."""
    trial = _chosen(study, settings).iloc[0]
    return trial, study.trajectory(trial["trial_id"])[1]


def _chosen(study: StoredStudy, settings: Settings) -> pd.DataFrame:
    """The trials with these settings that are done, in the order of the spec."""
    trials = study.trials[study.trials["status"] == "done"]
    for name, value in settings.items():
        trials = trials[trials[name] == value]
    return trials


@lru_cache(maxsize=8)
def _all_flights(study: StoredStudy) -> dict[str, Floats]:
    """The flights of all trials by their ids."""
    names = ["x", "y", "vx", "vy"]
    tables = study.trajectories.groupby("trial_id", sort=False)
    return {str(trial): np.stack([np.stack(table[name].tolist()) for name in names], axis=1) for trial, table in tables}


def _flights(study: StoredStudy, settings: Settings) -> list[Floats]:
    return [_all_flights(study)[trial] for trial in _chosen(study, settings)["trial_id"]]


def _accelerations(flight: Floats, dt: float) -> Floats:
    """The acceleration of every boid from each frame to the next, (F - 1, 2, N)."""
    return np.diff(flight[:, 2:], axis=0) / dt


# Measures of claims: one value a trial.


def _opposite(study: StoredStudy) -> Floats:
    """Mean cosine between the first accelerations of separation and of cohesion, for boids that both move."""
    pairs = zip(*(_flights(study, RULES[rule][0]) for rule in ("separation", "cohesion")), strict=True)
    values = []
    for flights in pairs:
        apart, together = (_accelerations(flight[:2], 1.0)[0] for flight in flights)
        length = np.hypot(*apart) * np.hypot(*together)
        both = length > 0
        values.append(np.mean((apart * together).sum(axis=0)[both] / length[both]) if both.any() else np.nan)
    return np.array(values)


def _velocity_spread(study: StoredStudy) -> Floats:
    """What is left at the end of the standard deviation of velocities at the start, with alignment alone."""
    flights = _flights(study, RULES["alignment"][0])
    spread = [np.sqrt(flight[[0, -1], 2:].var(axis=2).sum(axis=1)) for flight in flights]
    return np.array([end / start for start, end in spread])


def _approach(study: StoredStudy, flight: Floats) -> tuple[Floats, Floats, Floats]:
    """The speeds and distances from the goal of boids (F, N), and the times of the frames (F,)."""
    trial = study.trials.iloc[0]
    distance = np.hypot(flight[:, 0] - trial["goal_x"], flight[:, 1] - trial["goal_y"])
    times = np.linspace(0.0, trial["steps"] * trial["dt"], len(flight))
    return np.hypot(flight[:, 2], flight[:, 3]), distance, times


def _seek_speed(study: StoredStudy) -> Floats:
    """Mean speed with seek alone, from 2 s on and farther than FAR from the goal, m/s."""
    values = []
    for flight in _flights(study, SEEK):
        speed, distance, times = _approach(study, flight)
        values.append(speed[(distance > FAR) & (times[:, None] >= 2.0)].mean())
    return np.array(values)


def _slowing(study: StoredStudy, settings: Settings) -> Floats:
    """The speed at which boids first come CLOSE to the goal over their mean speed before, from 2 s on, beyond FAR.

    NaN for a trial of which no boid comes close.
    """
    values = []
    for flight in _flights(study, settings):
        speed, distance, times = _approach(study, flight)
        near = distance < CLOSE
        first, before = near.argmax(axis=0), np.cumsum(near, axis=0) == 0
        way = before & (distance > FAR) & (times[:, None] >= 2.0)
        ratios = [speed[first[i], i] / speed[way[:, i], i].mean() for i in range(len(first)) if near[:, i].any()]
        values.append(np.mean(ratios) if ratios else np.nan)
    return np.array(values)


def _arrival_against_seek(study: StoredStudy) -> Floats:
    """The slowing with arrival alone minus that with seek alone, trials with the same start."""
    return _slowing(study, ARRIVAL) - _slowing(study, SEEK)


def _avoiding(study: StoredStudy, flight: Floats) -> tuple[Floats, NDArray[np.bool_], Floats]:
    """Accelerations (F - 1, 2, N), whether they are there and due to the disc (F - 1, N), and the way off it, unit.

    Due to the disc are those outside it and nearer than the look-ahead to its surface.
    """
    trial = study.trials.iloc[0]
    x, y, radius = study.world(trial["trial_id"]).obstacles[0, :3]
    change, off = _accelerations(flight, trial["dt"]), flight[:-1, :2] - np.array([[x], [y]])
    distance = np.hypot(off[:, 0], off[:, 1])
    due = (distance > radius) & (distance < radius + trial["look_ahead"]) & (np.abs(change).max(axis=1) > 1e-6)
    return change, due, off / distance[:, None]


def avoidance_angle(studies: Studies) -> Floats:
    """Mean angle between the accelerations of boids that avoid the disc and the way straight off it, degrees."""
    study, values = studies["avoidance_alone"], []
    for flight in _flights(study, {}):
        change, due, off = _avoiding(study, flight)
        cosine = (change * off).sum(axis=1)[due] / np.hypot(change[:, 0], change[:, 1])[due]
        values.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean() if due.any() else np.nan)
    return np.array(values)


def _for_both(
    spec: str, value: Callable[..., Floats], *settings: Settings
) -> tuple[Callable[[Studies], Floats], Callable[[Studies], Floats]]:
    """A measure in the trials of `spec`, and in those of the same spec with the preset as_written."""
    as_run, as_written = (lambda studies, name=spec + ending: value(studies[name], *settings) for ending in PRESETS)
    return as_run, as_written


opposite, opposite_as_written = _for_both("rules", _opposite)
velocity_spread, velocity_spread_as_written = _for_both("rules", _velocity_spread)
seek_speed, seek_speed_as_written = _for_both("navigation", _seek_speed)
arrival_slowing, arrival_slowing_as_written = _for_both("navigation", _slowing, ARRIVAL)
both_slowing, both_slowing_as_written = _for_both("navigation", _slowing, BOTH)
arrival_against_seek, arrival_against_seek_as_written = _for_both("navigation", _arrival_against_seek)

# Figures.


def _draw_trails(axes: Axes, flight: Floats, colours: Sequence[str]) -> None:
    """Where boids flew, paler the longer ago; where they started, hollow, and how they fly at the end."""
    fade = np.linspace(0.25, 0.9, len(flight) - 1)
    for i, colour in enumerate(colours):
        points = flight[:, :2, i]
        parts = np.stack([points[:-1], points[1:]], axis=1)
        axes.add_collection(LineCollection(list(parts), colors=colour, linewidths=0.9, alpha=fade, rasterized=True))
        axes.plot(*points[0], "o", markersize=2.6, markerfacecolor="white", markeredgecolor=colour, markeredgewidth=0.7)
    for colour in sorted(set(colours)):
        draw_flock(axes, flight[-1][:, np.array(colours) == colour], 0.022 * np.ptp(axes.get_xlim()), colour)


def _draw_trial(axes: Axes, study: StoredStudy, **settings: Any) -> None:
    """The map of the first trial with these settings, its boids' trails and, where some boid knows it, the goal."""
    trial, flight = _flight(study, **settings)
    draw_map(axes, study.world(trial["trial_id"]), "m", downwards=False)
    leaders = int(np.floor(trial["leader_share"] * trial["n"] + 0.5))
    colours = [LEADER] * leaders + [FOLLOWER] * (trial["n"] - leaders)
    _draw_trails(axes, flight, colours)
    if leaders:
        goal = trial["goal_x"], trial["goal_y"]
        axes.plot(*goal, "X", markersize=7, color="#CC0000", markeredgecolor="white", zorder=4)


def _draw_arrows(axes: Axes, places: Floats, arrows: Floats, colour: str, scale: float) -> None:
    """Accelerations (2, K) at places (2, K), `scale` m/s^2 to a metre."""
    axes.quiver(*places, *arrows, color=colour, angles="xy", scale_units="xy", scale=scale, width=0.007, zorder=3)


def rules(studies: Studies) -> Figure:
    """Figure 1: trails of boids under one rule, and its accelerations in the first step."""
    study = studies["rules"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.2, 5.2))
        panels = figure.subplots(2, 3)
        for (above, below), (rule, (settings, colour)) in zip(panels.T, RULES.items(), strict=True):
            trial, flight = _flight(study, **settings)
            acceleration = _accelerations(flight[:2], trial["dt"])[0]
            for axes, reach in ((above, 4.0), (below, 0.9)):
                draw_map(axes, study.world(trial["trial_id"]), "m", downwards=False)
                axes.set(xlim=(5 - reach, 5 + reach), ylim=(5 - reach, 5 + reach))
            _draw_trails(above, flight, [colour] * trial["n"])
            below.plot(*flight[0, :2], "o", markersize=4, color="0.25")
            most = float(np.hypot(*acceleration).max())
            _draw_arrows(below, flight[0, :2], acceleration, colour, most / 0.4)
            above.set_title(f"{rule} alone, {trial['steps'] * trial['dt']:g} s")
            below.set_title(f"at the start, up to {most:.2f} m/s²", fontsize=8.5)
        note(figure, f"{study.name}: the first trial, {trial['n']} boids, the same start; arrows: accelerations")
    return figure


def navigation(studies: Studies) -> Figure:
    """Figure 2: trails to the goal, accelerations of seek, and speed against the distance from the goal."""
    study = studies["navigation"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.4, 3.1))
        left, middle, right = figure.subplots(1, 3, width_ratios=(1, 1, 1.15))
        for axes, settings in ((left, SEEK), (middle, ARRIVAL)):
            _draw_trial(axes, study, **settings)
        trial, flight = _flight(study, **SEEK)
        acceleration = _accelerations(flight[:2], 2 * trial["dt"])[0]
        most = float(np.hypot(*acceleration).max())
        _draw_arrows(left, flight[0, :2], acceleration, "0.15", most / 1.5)
        left.set_title(f"seek; acceleration up to {most:.1f} m/s²", fontsize=8.5)
        middle.plot(
            *_flight(study, **ARRIVAL)[1][::25, :2].reshape(-1, 2, trial["n"]).swapaxes(0, 1), "k.", markersize=2.5
        )
        middle.set_title("arrival; a dot every 5 s", fontsize=8.5)
        _draw_speeds(right, studies)
        trials = len(_flights(study, SEEK))
        about = (
            f"{study.name}: the first trial of each, goal in red; right: {trials} trials each, mean speed of boids that"
        )
        note(figure, f"{about}\nhave not yet been within {CLOSE:g} m of the goal, from 2 s on, pointwise 95 % interval")
    return figure


def _draw_speeds(axes: Axes, studies: Studies) -> None:
    """Mean speed against the distance from the goal on the way there, for seek, arrival and both, and both presets."""
    edges = np.linspace(CLOSE, 6.0, 24)
    for ending, line in (("", "-"), ("_as_written", ":")):
        study = studies["navigation" + ending]
        kinds = ((SEEK, BLUE, "seek"), (ARRIVAL, VERMILION, "arrival"), (BOTH, GREEN, "both"))
        for settings, colour, name in kinds:
            trials = [_speed_by_distance(study, flight, edges) for flight in _flights(study, settings)]
            table = np.array([mean_interval(values) for values in np.transpose(trials)])
            centres = 0.5 * (edges[1:] + edges[:-1])
            axes.plot(centres, table[:, 0], line, color=colour, label=f"{name}, {PRESETS[ending]}")
            axes.fill_between(centres, table[:, 1], table[:, 2], color=colour, alpha=0.2, lw=0)
    axes.set(xlabel="distance from the goal (m)", ylabel="speed (m/s)", xlim=(0, 6), ylim=(0, 1.45))
    axes.legend(fontsize=6.5, ncols=2, loc="upper center", handlelength=1.6, columnspacing=1)


def _speed_by_distance(study: StoredStudy, flight: Floats, edges: Floats) -> Floats:
    """Mean speed of boids in each interval of distance, before they first come CLOSE and from 2 s on."""
    speed, distance, times = _approach(study, flight)
    way = (np.cumsum(distance < CLOSE, axis=0) == 0) & (times[:, None] >= 2.0)
    sums, _ = np.histogram(distance[way], edges, weights=speed[way])
    counts, _ = np.histogram(distance[way], edges)
    return np.where(counts > 0, sums / np.maximum(counts, 1), np.nan)


def avoidance(studies: Studies) -> Figure:
    """Figure 3: accelerations beside a disc without any other rule, and a swarm that passes both obstacles."""
    alone, paths = studies["avoidance_alone"], studies["avoidance_paths"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.2, 3.9))
        left, right = figure.subplots(1, 2)
        draw_map(left, alone.world(alone.trials["trial_id"][0]), "m", downwards=False)
        left.set(xlim=(1.2, 5.8), ylim=(1.2, 5.8))
        for flight in _flights(alone, {})[:10]:
            change, due, _ = _avoiding(alone, flight)
            for i in np.flatnonzero(due.any(axis=0)):
                left.plot(*flight[:, :2, i].T, color="0.6", linewidth=0.7)
                _draw_arrows(left, flight[:-1, :2, i][due[:, i]].T, change[due[:, i], :, i].T, VERMILION, 6.6 / 0.5)
        left.set_title("avoidance alone, first ten trials")
        _draw_trial(right, paths)
        right.set_title("all rules, five of ten know the goal")
        about = (
            "left: accelerations near the disc, 0.5 m for 6.6 m/s²; right: first trial, goal in red, blue boids know it"
        )
        note(figure, f"{alone.name} and {paths.name}\n{about}")
    return figure


def perception(studies: Studies) -> Figure:
    """Figure 4: trails by perception range, the share of the largest flock and the number of flocks."""
    values = (("largest_flock_share_mean", "boids in the largest flock (%)"), ("flock_count_mean", "flocks"))
    names = [f"{value:g} m" for value in (0.6, 1.2, 2.4)]
    figure, below = _compare(studies, "perception", "perception_range", (0.6, 1.2, 2.4), names, values)
    below[0].set(xlim=(0, 101))
    for bound in (70, 95):
        below[0].axvline(bound, color="0.6", linewidth=0.8, linestyle=":")
    return figure


def field_of_view(studies: Studies) -> Figure:
    """Figure 5: trails by field of view, boids that left the flock, its elongation, the share of neighbours ahead."""
    values = (
        ("boids_lost_mean", "boids outside the\nlargest flock"),
        ("elongation_mean", "elongation (1 column,\n0 round, -1 front)"),
        ("neighbours_ahead_mean", "neighbours ahead (%)"),
    )
    names = ["π/2.2", "π/1.4", "π"]
    figure, below = _compare(studies, "field_of_view", "fov", (163.636, 257.143, 360.0), names, values)
    below[1].axvspan(-0.15, 0.15, color="0.93", lw=0)
    return figure


def _compare(
    studies: Studies,
    spec: str,
    setting: str,
    levels: Sequence[float],
    names: Sequence[str],
    values: Sequence[tuple[str, str]],
) -> tuple[Figure, list[Axes]]:
    """Trails in both situations for each level of `setting`, and below them means with intervals of `values`."""
    paths = studies[f"{spec}_paths"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.4, 6.9))
        top, middle, bottom = figure.subfigures(3, 1, height_ratios=(2.4, 1.3, 2.3))
        for part, situation in ((top, "arena"), (middle, "field")):
            for axes, level, name in zip(part.subplots(1, 3, squeeze=False)[0], levels, names, strict=True):
                _draw_trial(axes, paths, map=situation, **{setting: level})
                axes.set_title(name)
            part.suptitle(f"{SITUATIONS[situation]}, as run, by {COMPARED[setting]}", fontsize=9)
        panels = list(bottom.subplots(1, len(values), squeeze=False)[0])
        for axes, (metric, label) in zip(panels, values, strict=True):
            _draw_levels(axes, studies, spec, setting, levels, metric)
            name_rows(axes, names)
            axes.set_xlabel(label)
        handles, labels = panels[0].get_legend_handles_labels()
        bottom.legend(handles, labels, loc="outside upper center", ncols=4, fontsize=8)
        trials = len(_chosen(studies[spec], {"map": "arena", setting: levels[0]}))
        note(
            figure,
            f"{paths.name}: the first trials; below {trials} trials each, mean of their last halves, 95 % intervals",
        )
    return figure, panels


def _draw_levels(axes: Axes, studies: Studies, spec: str, setting: str, levels: Sequence[float], metric: str) -> None:
    """The mean and interval of `metric` at each level, in both situations and with both presets."""
    looks = zip((-0.24, -0.08, 0.08, 0.24), product(PRESETS, SITUATIONS), LOOKS, strict=True)
    for shift, (ending, situation), (colour, marker) in looks:
        study = studies[spec + ending]
        columns = [_chosen(study, {"map": situation, setting: level})[metric].to_numpy() for level in levels]
        table = np.array([mean_interval(column)[:3] for column in columns]).T
        label = f"{SITUATIONS[situation]}, {PRESETS[ending]}"
        draw_values(axes, np.arange(len(levels)) + shift, tuple(table), colour, marker, label)


SCENARIOS = {"safety_first": "scenario 1, safety first", "flocking_first": "scenario 2, flocking first"}
WAY = (30, 120)
"""The steps in which boids are on their way through the maze: 3 to 12 s."""
MEASURES = {
    "collisions": "entries into walls",
    "boid_collisions": "contacts of boids",
    "dead_ends": "dead ends",
    "share_arrived": "arrived (%)",
    "time_to_goal": "time to the goal (s)",
    "least_clearance": "least distance\nfrom a wall (m) *",
    "nearest_neighbour_distance": "nearest\nneighbour (m) *",
    "polarization": "polarization *",
    "flock_radius": "flock radius (m) *",
    "flock_radius_mean": "flock radius from\n15 s on (m)",
}


def mazes(studies: Studies) -> Figure:
    """Figures 6 and 7: trails in the maze of ours with safety first and with flocking first."""
    study = studies["priorities_paths"]
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.2, 4.0))
        for axes, (priority, title) in zip(figure.subplots(1, 2), SCENARIOS.items(), strict=True):
            _draw_trial(axes, study, priority=priority)
            axes.set_title(title)
        note(
            figure,
            f"{study.name}: the first trial, the same start; goal in red, blue boids know it, orange ones do not",
        )
    return figure


def _values(study: StoredStudy, priority: str, metric: str) -> Floats:
    """One value a trial: the mean over WAY of what is recorded as a series, else that of the trials table."""
    trials = _chosen(study, {"priority": priority})
    if metric not in study.series:
        return trials[metric].to_numpy(np.float64)
    way = study.series[study.series["frame"].between(*WAY)].groupby("trial_id")[metric].mean()
    return way.loc[trials["trial_id"]].to_numpy()


def priorities(studies: Studies) -> Figure:
    """What section 3.2.3 reads from figures 6 and 7, measured, with both presets."""
    with matplotlib.style.context(STYLE):
        figure = Figure(figsize=(7.4, 3.7))
        panels = figure.subplots(2, 5).ravel()
        looks = list(zip((-0.1, 0.1), SCENARIOS.items(), (BLUE, ORANGE), "os", strict=True))
        for number, (metric, label) in enumerate(MEASURES.items()):
            for shift, (priority, title), colour, marker in looks:
                values = [_values(studies[f"priorities{ending}"], priority, metric) for ending in PRESETS]
                value, low, high, _ = np.transpose([mean_interval(array) for array in values])
                draw_values(panels[number], np.arange(2) + shift, (value, low, high), colour, marker, title)
            name_rows(panels[number], ["", ""] if number % 5 else list(PRESETS.values()))
            panels[number].set_xlabel(label, fontsize=8)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
        trials = len(_chosen(studies["priorities"], {"priority": "safety_first"}))
        note(figure, f"rustamani2024/priorities: {trials} trials each, mean with 95 % interval; * from 3 to 12 s")
    return figure


_COMPARED = {spec: (spec, f"{spec}_as_written", f"{spec}_paths") for spec in ("perception", "field_of_view")}
FIGURES = {
    "figure1_rules": Drawing(rules, ("rules",), "Figure 1: separation, alignment and cohesion alone."),
    "figure2_navigation": Drawing(
        navigation,
        ("navigation", "navigation_as_written"),
        "Figure 2: seek and arrival, and how speed falls near the goal.",
    ),
    "figure3_avoidance": Drawing(
        avoidance,
        ("avoidance_alone", "avoidance_paths"),
        "Figure 3: steering round obstacles, alone and with all rules.",
    ),
    "figure4_perception": Drawing(
        perception, _COMPARED["perception"], "Figure 4: one flock or several, by perception range."
    ),
    "figure5_field_of_view": Drawing(
        field_of_view,
        _COMPARED["field_of_view"],
        "Figure 5: boids lost and the shape of the flock, by half angle of view.",
    ),
    "figures6_7": Drawing(mazes, ("priorities_paths",), "Figures 6 and 7: safety first and flocking first in a maze."),
    "figures6_7_measures": Drawing(
        priorities,
        ("priorities", "priorities_as_written"),
        "What is read from figures 6 and 7, measured in 300 trials.",
    ),
}
