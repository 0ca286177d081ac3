"""What happens in each flight of patel2023: equilibrium, potential, borders and rocks,
and the measures of its claims.

Lengths are metres, ten pixels each, y upwards from the arena's lower border; times are
seconds of FRAMES_A_SECOND.
"""

from collections.abc import Callable, Sequence
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


class Flight(NamedTuple):
    """One trial: x and y (F, N) in metres, moves (F, 2, N) in m/s, and what is true of
    rovers (F, N) in each frame.

    `company` says that another is within 80 px, `settled` that the rover is in
    equilibrium as the metric of that name has it, `margin` and `rock` that a border or
    a rock acts on it. `potential` (F, N) is that of Eq. (27), `nearest` (F, N) the
    distance of the nearest other in metres, `flock` (F, N) the size of the flock,
    `turn` (F, N) the change of heading in degrees. `rocks` (M, 2) are metres.
    """

    x: Floats
    y: Floats
    moves: Floats
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
    """The rocks (M, 2), in pixels, of a replicate: the same for both border rules."""
    trials = study.trials
    return study.world(
        trials["trial_id"][trials["replicate"] == replicate].iloc[0]
    ).obstacles[:, :2]


def _flight(trial: "pd.Series", table: pd.DataFrame, rocks: Floats) -> Flight:
    x, y, vx, vy = (np.stack(table[name].tolist()) for name in ("x", "y", "vx", "vy"))
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
        company=near.any(axis=2),
        settled=_settled(
            vx, vy, near, trial.equilibrium_tolerance, trial.equilibrium_steps
        ),
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


def _settled(
    vx: Floats, vy: Floats, near: Truths, tolerance: float, steps: int
) -> Truths:
    """Who has had velocities within the tolerance of all neighbours', at least one, for
    so many steps.
    """
    difference = np.hypot(vx[:, :, None] - vx[:, None], vy[:, :, None] - vy[:, None])
    speed = np.hypot(vx, vy)
    agrees = difference < tolerance * np.maximum(speed[:, :, None], speed[:, None])
    in_step = near.any(axis=2) & (agrees | ~near).all(axis=2)
    in_step[0] = False
    lasted = np.zeros(in_step.shape, np.int64)
    for frame in range(1, len(lasted)):
        lasted[frame] = np.where(in_step[frame], lasted[frame - 1] + 1, 0)
    return lasted >= steps


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


def _both(measure: Callable[[Flight], float]) -> Sequence[Callable[[Studies], Floats]]:
    """The values of `measure` in all trials as run, and in all as written."""
    return [
        partial(_measured, measure=measure, border=border)
        for border in ("always", "in_margin")
    ]


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


def _speed(flight: Flight) -> Floats:
    return np.hypot(flight.moves[1:, 0], flight.moves[1:, 1])


in_limits_as_run, in_limits_as_written = _both(
    lambda flight: (
        100 * float(((_speed(flight) > 7 - 1e-9) & (_speed(flight) < 10 + 1e-9)).mean())
    )
)
turns_as_run, turns_as_written = _both(
    lambda flight: (
        _mean(flight.turn[1:-1], flight.rock[1:-1])
        - _mean(flight.turn[1:-1], ~flight.rock[1:-1])
    )
)
flocks_as_run, flocks_as_written = _both(
    lambda flight: 100.0 * (flocks(flight)[-1] >= 1)
)
several_as_run, several_as_written = _both(
    lambda flight: 100.0 * (flocks(flight)[-1] >= 2)
)
settled_as_run, settled_as_written = _both(
    lambda flight: 100 * _mean(flight.settled[SECOND_HALF], flight.company[SECOND_HALF])
)
spacing_as_run, spacing_as_written = _both(
    lambda flight: _mean(flight.nearest, flight.settled)
)
lower_as_run, lower_as_written = _both(
    lambda flight: (
        _mean(flight.potential, flight.settled)
        - _mean(flight.potential, flight.company & ~flight.settled)
    )
)
late_as_run, late_as_written = _both(
    lambda flight: _late(flight.potential, flight.company)
)
border_as_run, border_as_written = _both(lambda flight: _lost(flight, flight.margin))
rock_as_run, rock_as_written = _both(lambda flight: _lost(flight, flight.rock))
