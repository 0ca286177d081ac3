"""What happens in each flight of patel2023: equilibrium, potential, borders and rocks,
and the measures of its claims.

Lengths are metres, ten pixels each, y upwards from the arena's lower border; times are
seconds of FRAMES_A_SECOND.
"""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.tables.stored_study import StoredStudy

Studies = dict[str, StoredStudy]
Floats = NDArray[np.float64]
Truths = NDArray[np.bool_]

FRAMES_A_SECOND = 10
"""Our assumption: the document gives seconds and no rate. See the README for what
speaks for it.
"""
SECOND_HALF = slice(121, None)
BORDERS = {"always": "as run", "in_margin": "as written", "never": "as intended"}
TOLERANCE, WINDOW = 0.2, 1.0
"""What makes an equilibrium: mean velocities over so many seconds agree to this part.
Both are ours, as the document judges curves by eye; figure `detector` shows what other
choices give.
"""
V_MAX = 10.0
"""Table I, in px a frame."""
LONG = 9.0
"""Seconds: what an equilibrium of the document's trial 1 lasted."""


class Flight(NamedTuple):
    """One trial: x and y (F, N) in metres, moves (F, 2, N) in m/s, and what is true of
    rovers (F, N) in each frame.

    `near` (F, N, N) says who is within 80 px of whom, `company` that somebody is,
    `settled` that the rover is in equilibrium, as `in_step` has it with TOLERANCE and
    WINDOW, `margin` and `rock` that a border or a rock acts on it. `potential` (F, N)
    is that of Eq. (27), `nearest` (F, N) the distance of the nearest other in metres,
    `flock` (F, N) the size of the flock, `turn` (F, N) the change of heading in
    degrees. `rocks` (M, 2) are metres.
    """

    x: Floats
    y: Floats
    moves: Floats
    near: Truths
    company: Truths
    settled: Truths
    margin: Truths
    rock: Truths
    potential: Floats
    nearest: Floats
    flock: NDArray[np.int64]
    turn: Floats
    rocks: Floats


@lru_cache(maxsize=4)
def flights(study: StoredStudy, border: str) -> list[Flight]:
    """The flights of all trials with one border rule, in
    the order of the replicates.
    """
    trials = study.trials[
        (study.trials["border_adds_velocity"] == border)
        & (study.trials["status"] == "done")
    ]
    tables = dict(iter(study.trajectories.groupby("trial_id")))
    return [
        _flight(row, tables[row.trial_id], _rocks(study, row.replicate))
        for row in trials.itertuples()
    ]


@lru_cache(maxsize=2000)
def _rocks(study: StoredStudy, replicate: int) -> Floats:
    """The rocks (M, 2), in pixels, of a replicate: the same for all border rules."""
    trials = study.trials
    return study.world(
        trials["trial_id"][trials["replicate"] == replicate].iloc[0]
    ).obstacles[:, :2]


def _flight(trial: "pd.Series", table: pd.DataFrame, rocks: Floats) -> Flight:
    x, y = (np.stack(table[name].tolist()) for name in ("x", "y"))
    distance = np.hypot(x[:, :, None] - x[:, None], y[:, :, None] - y[:, None])
    distance[:, np.arange(trial.n), np.arange(trial.n)] = np.inf
    near = distance < trial.flock_range
    to_rock = np.hypot(x[..., None] - rocks[:, 0], y[..., None] - rocks[:, 1]).min(
        axis=2
    )
    low, high = trial.border_margin, trial.width - trial.border_margin
    moves = np.stack(
        [np.diff(x, axis=0, prepend=np.nan), -np.diff(y, axis=0, prepend=np.nan)],
        axis=1,
    )
    heading = np.arctan2(moves[:, 1], moves[:, 0])
    change = np.abs(np.diff(heading, axis=0, append=np.nan))
    return Flight(
        x=(x - 100) / 10,
        y=100 - (y - 100) / 10,
        moves=moves * FRAMES_A_SECOND / 10,
        near=near,
        company=near.any(axis=2),
        settled=in_step(x, y, near, TOLERANCE, WINDOW),
        margin=(np.minimum(x, y) < low) | (np.maximum(x, y) > high),
        rock=to_rock < trial.obstacle_range,
        potential=_potential(distance, trial),
        nearest=distance.min(axis=2) / 10,
        flock=_flock_sizes(near),
        turn=np.degrees(np.minimum(change, 2 * np.pi - change)),
        rocks=np.column_stack(
            [(rocks[:, 0] - 100) / 10, 100 - (rocks[:, 1] - 100) / 10]
        ),
    )


def in_step(
    x: Floats, y: Floats, near: Truths, tolerance: float, window: float
) -> Truths:
    """Who has company, and a mean velocity over the last `window` seconds that agrees
    with those of all neighbours: they differ by less than a part of the larger one.

    Positions are (F, N). Nobody is in step before a window is over.
    """
    frames = round(window * FRAMES_A_SECOND)
    vx, vy = x[frames:] - x[:-frames], y[frames:] - y[:-frames]
    difference = np.hypot(vx[:, :, None] - vx[:, None], vy[:, :, None] - vy[:, None])
    speed = np.hypot(vx, vy)
    agrees = difference < tolerance * np.maximum(speed[:, :, None], speed[:, None])
    found = np.zeros(x.shape, np.bool_)
    found[frames:] = near[frames:].any(axis=2) & (agrees | ~near[frames:]).all(axis=2)
    return found


def _flock_sizes(near: Truths) -> NDArray[np.int64]:
    """The size of each rover's flock: the rovers that a chain of neighbours joins to
    it, itself included.
    """
    joined = near | np.eye(near.shape[1], dtype=bool)
    for _ in range(int(np.ceil(np.log2(near.shape[1])))):
        joined = joined @ joined
    return joined.sum(axis=2)


def pair_potential(
    distance: Floats, separation: float, crowd: float, attraction: float, reach: float
) -> Floats:
    """V of a pair at `distance`, with the strengths of separation and, divided by the
    neighbours, of cohesion.
    """
    inside = (separation - attraction) * (crowd**2 - distance**2) / 2
    outside = attraction * (distance**2 - crowd**2) / 2
    return np.where(distance < crowd, inside, np.where(distance < reach, outside, 0.0))


def _potential(distance: Floats, trial: "pd.Series") -> Floats:
    neighbours = np.maximum((distance < trial.cohesion_range).sum(axis=2), 1)
    attraction = (trial.cohesion_weight / neighbours)[..., None]
    far = np.minimum(distance, 1e6)  # infinite stands for the rover itself
    pairs = pair_potential(
        far,
        trial.separation_weight,
        trial.separation_range,
        attraction,
        trial.cohesion_range,
    )
    return pairs.sum(axis=2)


def _presets(measure: Callable[[Flight], float]) -> list[Callable[[Studies], Floats]]:
    """The values of `measure` in all trials as run, in those as written, and in those
    as intended.
    """
    return [partial(_measured, measure=measure, border=border) for border in BORDERS]


def _measured(
    studies: Studies, measure: Callable[[Flight], float], border: str
) -> Floats:
    return np.array([measure(flight) for flight in flights(studies["trials"], border)])


def _mean(values: Floats, chosen: Truths) -> float:
    return float(values[chosen].mean()) if chosen.any() else np.nan


def flocks(flight: Flight) -> Floats:
    """The number of flocks of two or more in each frame."""
    return (np.where(flight.flock > 1, 1.0, 0.0) / flight.flock).sum(axis=1)


def _lost(flight: Flight, acts: Truths) -> float:
    """How much likelier a rover in equilibrium is to lose it within a second where
    something begins to act on it.

    That is the share, in per cent, of such rovers that are in it no more a second
    later, less the same share of those on which it does not act before that second is
    over.
    """
    second, last = FRAMES_A_SECOND, len(acts) - FRAMES_A_SECOND
    before, lost = flight.settled[:last], ~flight.settled[second:]
    begins = np.roll(acts, -1, axis=0)[:last] & ~acts[:last]
    spared = ~np.any([acts[k : last + k] for k in range(second + 1)], axis=0)
    return 100 * (_mean(lost, before & begins) - _mean(lost, before & spared))


def _late(values: Floats, chosen: Truths) -> float:
    """The mean of `values` where `chosen` in the last five seconds, less that in the
    first five.
    """
    five = 5 * FRAMES_A_SECOND
    return _mean(values[-five:], chosen[-five:]) - _mean(values[:five], chosen[:five])


def _keeps_step_in_y(flight: Flight) -> bool:
    """Whether a rover keeps in step for LONG seconds, by Y alone."""
    along_y = np.zeros_like(flight.x), flight.y
    in_y = in_step(*along_y, flight.near, TOLERANCE, WINDOW)
    frames = round(LONG * FRAMES_A_SECOND)
    kept = np.cumsum(np.vstack([np.zeros_like(in_y[:1]), in_y]), axis=0)
    return bool(np.any(kept[frames:] - kept[:-frames] == frames))


def _restored(flight: Flight) -> float:
    """How much the potential of a rover in company changes in the second after a border
    or a rock has ceased to act on it, if none acts on it again before that second is
    over.
    """
    second, last = FRAMES_A_SECOND, len(flight.x) - FRAMES_A_SECOND
    acts = flight.margin | flight.rock
    ended = np.roll(acts, 1, axis=0)[:last] & ~acts[:last]
    ended[0] = False
    spared = ~np.any([acts[k : last + k] for k in range(second + 1)], axis=0)
    change = flight.potential[second:] - flight.potential[:last]
    return _mean(change, ended & spared & flight.company[:last])


def powers_above(study: StoredStudy, border: str) -> Floats:
    """How many powers of ten the mean speed is above V_max at the end of each trial
    with one border rule.
    """
    trials = study.trials
    chosen = (trials["border_adds_velocity"] == border) & (trials["status"] == "done")
    return np.log10(trials.loc[chosen, "speed"].to_numpy(np.float64) / V_MAX)


def _unlimited(studies: Studies, border: str) -> Floats:
    return powers_above(studies["limits"], border)


unlimited_as_run, unlimited_as_written, unlimited_as_intended = (
    partial(_unlimited, border=border) for border in BORDERS
)
turns_as_run, turns_as_written, turns_as_intended = _presets(
    lambda flight: (
        _mean(flight.turn[1:-1], flight.rock[1:-1])
        - _mean(flight.turn[1:-1], ~flight.rock[1:-1])
    )
)
flocks_as_run, flocks_as_written, flocks_as_intended = _presets(
    lambda flight: 100.0 * (flocks(flight)[-1] >= 1)
)
several_as_run, several_as_written, several_as_intended = _presets(
    lambda flight: 100.0 * (flocks(flight)[-1] >= 2)
)
settled_as_run, settled_as_written, settled_as_intended = _presets(
    lambda flight: 100 * _mean(flight.settled[SECOND_HALF], flight.company[SECOND_HALF])
)
long_as_run, long_as_written, long_as_intended = _presets(
    lambda flight: 100.0 * _keeps_step_in_y(flight)
)
spacing_as_run, *_ = _presets(lambda flight: _mean(flight.nearest, flight.settled))
lower_as_run, *_ = _presets(
    lambda flight: (
        _mean(flight.potential, flight.settled)
        - _mean(flight.potential, flight.company & ~flight.settled)
    )
)
late_as_run, late_as_written, _ = _presets(
    lambda flight: _late(flight.potential, flight.company)
)
restored_as_run, restored_as_written, _ = _presets(_restored)
border_as_run, *_ = _presets(lambda flight: _lost(flight, flight.margin))
rock_as_run, *_ = _presets(lambda flight: _lost(flight, flight.rock))
