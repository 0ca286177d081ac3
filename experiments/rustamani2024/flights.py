"""Flights of rustamani2024, and the measures of its claims: one value a trial.

Lengths are metres, times seconds. Accelerations are changes of velocity over a step:
exact as long as the speed is not at its limit. A flight is x, y, vx and vy of the boids
of one trial in its recorded frames, (F, 4, N).
"""

from collections.abc import Callable, Collection, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.stored_study import StoredStudy

Studies = dict[str, StoredStudy]
Floats = NDArray[np.float64]
Settings = Mapping[str, Any]

SEPARATION, ALIGNMENT, COHESION = ("separation",), ("alignment",), ("cohesion",)
SEEK, ARRIVAL, BOTH = ("seek",), ("arrival",), ("seek", "arrival")
FAR, CLOSE = 2.0, 0.25
"""Distances from the goal beyond which a boid is on its way, and at which it has come
close, m.
"""
AS_WRITTEN, AS_REPORTED = "_as_written", "_as_reported"
ALGORITHMS = {"": "as run", AS_WRITTEN: "as written"}
PRESETS = {"": "as run", AS_REPORTED: "as reported"}
"""What the names of specs end in, and their presets: of those that fly single rules,
and of those that fly all.
"""
WAY = (30, 120)
"""The steps in which boids are on their way through the maze: 3 to 12 s."""


def first_flight(
    study: StoredStudy, **settings: Any
) -> tuple["pd.Series[Any]", Floats]:
    """The first trial with these settings, and its flight."""
    trial = chosen(study, settings).iloc[0]
    return trial, study.trajectory(trial["trial_id"])[1]


def chosen(study: StoredStudy, settings: Settings) -> pd.DataFrame:
    """The trials with these settings that are done, in the order of the spec."""
    trials = study.where(**settings).trials
    return trials[trials["status"] == "done"]


def only(study: StoredStudy, rules: Collection[str]) -> Settings:
    """The settings of the trials in which, of the rules that the study varies, just
    these have a weight.
    """
    ending = "_weight"
    return {
        name: study.trials[name].max() if name.removesuffix(ending) in rules else 0.0
        for name in study.varied
        if name.endswith(ending)
    }


@lru_cache(maxsize=8)
def _all_flights(study: StoredStudy) -> dict[str, Floats]:
    """The flights of all trials by their ids."""
    names = ["x", "y", "vx", "vy"]
    tables = study.trajectories.groupby("trial_id", sort=False)
    return {
        str(trial): np.stack([np.stack(table[name].tolist()) for name in names], axis=1)
        for trial, table in tables
    }


def flights_of(study: StoredStudy, settings: Settings) -> list[Floats]:
    return [_all_flights(study)[trial] for trial in chosen(study, settings)["trial_id"]]


def accelerations(flight: Floats, dt: float) -> Floats:
    """The acceleration of every boid from each frame to the next, (F - 1, 2, N)."""
    return np.diff(flight[:, 2:], axis=0) / dt


def _opposite(study: StoredStudy) -> Floats:
    """Mean cosine between the first accelerations of separation and of cohesion, for
    boids that both move.
    """
    pairs = zip(
        *(flights_of(study, only(study, rule)) for rule in (SEPARATION, COHESION)),
        strict=True,
    )
    values = []
    for flights in pairs:
        apart, together = (accelerations(flight[:2], 1.0)[0] for flight in flights)
        length = np.hypot(*apart) * np.hypot(*together)
        both = length > 0
        values.append(
            np.mean((apart * together).sum(axis=0)[both] / length[both])
            if both.any()
            else np.nan
        )
    return np.array(values)


def _velocity_spread(study: StoredStudy) -> Floats:
    """What is left at the end of the standard deviation of velocities at the start,
    with alignment alone.
    """
    flights = flights_of(study, only(study, ALIGNMENT))
    spread = [
        np.sqrt(flight[[0, -1], 2:].var(axis=2).sum(axis=1)) for flight in flights
    ]
    return np.array([end / start for start, end in spread])


def approach(study: StoredStudy, flight: Floats) -> tuple[Floats, Floats, Floats]:
    """The speeds and distances from the goal of boids (F, N), and the times of the
    frames (F,).
    """
    trial = study.trials.iloc[0]
    distance = np.hypot(flight[:, 0] - trial["goal_x"], flight[:, 1] - trial["goal_y"])
    times = np.linspace(0.0, trial["steps"] * trial["dt"], len(flight))
    return np.hypot(flight[:, 2], flight[:, 3]), distance, times


def _seek_speed(study: StoredStudy) -> Floats:
    """Mean speed with seek alone, from 2 s on and farther
    than FAR from the goal, m/s.
    """
    values = []
    for flight in flights_of(study, only(study, SEEK)):
        speed, distance, times = approach(study, flight)
        values.append(speed[(distance > FAR) & (times[:, None] >= 2.0)].mean())
    return np.array(values)


def _slowing(study: StoredStudy, rules: Collection[str]) -> Floats:
    """With just these rules: the speed at which boids first come CLOSE to the goal over
    their mean speed before, from 2 s on, beyond FAR.

    NaN for a trial of which no boid comes close.
    """
    values = []
    for flight in flights_of(study, only(study, rules)):
        speed, distance, times = approach(study, flight)
        near = distance < CLOSE
        first, before = near.argmax(axis=0), np.cumsum(near, axis=0) == 0
        way = before & (distance > FAR) & (times[:, None] >= 2.0)
        ratios = [
            speed[first[i], i] / speed[way[:, i], i].mean()
            for i in range(len(first))
            if near[:, i].any()
        ]
        values.append(np.mean(ratios) if ratios else np.nan)
    return np.array(values)


def _arrival_against_seek(study: StoredStudy) -> Floats:
    """The slowing with arrival alone minus that with seek alone, trials with the same
    start.
    """
    return _slowing(study, ARRIVAL) - _slowing(study, SEEK)


def avoiding(
    study: StoredStudy, flight: Floats
) -> tuple[Floats, NDArray[np.bool_], Floats]:
    """Accelerations (F - 1, 2, N), whether they are there and due to the disc (F - 1,
    N), and the way off it, unit.

    Due to the disc are those outside it and nearer than the look-ahead to its surface.
    """
    trial = study.trials.iloc[0]
    x, y, radius = study.world(trial["trial_id"]).obstacles[0, :3]
    change, off = (
        accelerations(flight, trial["dt"]),
        flight[:-1, :2] - np.array([[x], [y]]),
    )
    distance = np.hypot(off[:, 0], off[:, 1])
    due = (
        (distance > radius)
        & (distance < radius + trial["look_ahead"])
        & (np.abs(change).max(axis=1) > 1e-6)
    )
    return change, due, off / distance[:, None]


def avoidance_angle(studies: Studies) -> Floats:
    """Mean angle between the accelerations of boids that avoid the disc and the way
    straight off it, degrees.
    """
    study, values = studies["avoidance_alone"], []
    for flight in flights_of(study, {}):
        change, due, off = avoiding(study, flight)
        cosine = (change * off).sum(axis=1)[due] / np.hypot(change[:, 0], change[:, 1])[
            due
        ]
        values.append(
            np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean()
            if due.any()
            else np.nan
        )
    return np.array(values)


def boids_alone(studies: Studies, **settings: Any) -> Floats:
    """At the smallest perception range, boids that have nobody within it at some time
    of the second half of the trial, in per cent.
    """
    study = studies["perception_paths"]
    reach = study.trials["perception_range"].min()
    values = []
    for flight in flights_of(study, settings | {"perception_range": reach}):
        places = flight[len(flight) // 2 :, :2]
        apart = np.hypot(*np.moveaxis(places[..., None] - places[:, :, None], 1, 0))
        apart[:, range(apart.shape[1]), range(apart.shape[1])] = np.inf
        values.append(100.0 * (apart.min(axis=2) >= reach).any(axis=0).mean())
    return np.array(values)


def _divergence_at_walls(study: StoredStudy) -> Floats:
    """With safety first, the flock radius in the half of WAY in which a wall is nearer
    minus that in the other half.
    """
    series = study.series
    way = series[series["frame"].between(*WAY)].set_index("trial_id")
    values = []
    for trial in chosen(study, {"priority": "safety_first"})["trial_id"]:
        radius = way.loc[trial].sort_values("least_clearance")["flock_radius"]
        half = len(radius) // 2
        values.append(radius[:half].mean() - radius[-half:].mean())
    return np.array(values)


def _for_both(
    spec: str, other: str, value: Callable[..., Floats], *arguments: Collection[str]
) -> tuple[Callable[[Studies], Floats], Callable[[Studies], Floats]]:
    """A measure in the trials of `spec`, and in those of the same spec with the `other`
    preset.
    """
    as_run, changed = (
        lambda studies, name=spec + ending: value(studies[name], *arguments)
        for ending in ("", other)
    )
    return as_run, changed


opposite, opposite_as_written = _for_both("rules", AS_WRITTEN, _opposite)
velocity_spread, velocity_spread_as_written = _for_both(
    "rules", AS_WRITTEN, _velocity_spread
)
seek_speed, seek_speed_as_written = _for_both("navigation", AS_WRITTEN, _seek_speed)
arrival_slowing, arrival_slowing_as_written = _for_both(
    "navigation", AS_WRITTEN, _slowing, ARRIVAL
)
both_slowing, both_slowing_as_written = _for_both(
    "navigation", AS_WRITTEN, _slowing, BOTH
)
arrival_against_seek, arrival_against_seek_as_written = _for_both(
    "navigation", AS_WRITTEN, _arrival_against_seek
)
divergence_at_walls, divergence_at_walls_as_reported = _for_both(
    "priorities", AS_REPORTED, _divergence_at_walls
)
