"""That a model is touched by nothing beyond what it declares."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple
from unittest import SkipTest

import numpy as np
from numpy.random import Generator

from sweep.design.jobs import Job
from sweep.spec.copied_maps import Obstacles
from sweep.testing.flights import (
    SIDE,
    Floats,
    begun,
    every_way,
    go,
    in_words,
    params_of,
    sight_of,
)
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial.simulation import Simulation
from sweep.trial.state import State

BOIDS = 8
DRAWS = 4
OBSTACLES = 12
MOST_TRIES = 6
NEAREST, FARTHEST = 0.3, 0.9
"""Of the range: where those stand who are near a boid, and outside its cone."""
CORNER = 0.01
"""Of the side of a periodic world: the place of the observer along both axes."""
MOST_ROOM = 2
"""Ranges beyond which boids would come near again on the other side of such a world."""

Places = Callable[[float], Floats | None]
"""Of the boids (2, N), if they are so much farther away as what moves within a step
needs; None where there are no such places.
"""


class Observed(NamedTuple):
    """x, y, vx and vy of the observer after a step, and the random numbers drawn."""

    bits: bytes
    noise: str


def reach(subject: Subject) -> None:
    """A step of a boid has the same bits wherever the boids are that it cannot see by
    `sight`, be they too far away or outside its cone, and with or without obstacles
    beyond `obstacle_reach`.

    Where boids move by d within a step, that is tried from 2 d beyond the range on. It
    is tried in an open world, and across the borders of a periodic one.
    """
    fitting, tried = 0, 0
    for job in every_way(subject, obstacles=False, n=BOIDS):
        is_open = job.settings["borders"] == "open"
        fits = is_open or job.settings["minimum_image"]
        state = begun(job) if fits else None
        if state is not None:
            fitting += 1
            tried += sum(_boids(subject, job, state, one) for one in (0, BOIDS - 1))
            tried += _obstacles(subject, job, state) if is_open else 0
    if not fitting:
        raise SkipTest("it has no flight in an open world, nor in a periodic one")
    if not tried:
        raise SkipTest("its boids see everyone, and obstacles act from anywhere")


def _boids(subject: Subject, job: Job, state: State, observer: int) -> int:
    """How many flocks were tried about an observer in the middle."""
    outcomes = [
        (what, outcome)
        for what, places in _unseen(subject, job, state, observer)
        if (outcome := _settled(job, state, observer, places))
    ]
    for what, other in outcomes[1:]:
        wanted = outcomes[0][1]
        # Those before it may draw other numbers, which changes its own.
        comparable = observer == 0 or wanted.noise == other.noise
        if comparable and wanted.bits != other.bits:
            raise AssertionError(
                f"{of_function(subject.model.sight)}: boids {what} change the step of"
                f" boid {observer} ({in_words(job)}); sight must declare all that"
                " advance looks at"
            )
    return len(outcomes[1:])


def _unseen(
    subject: Subject, job: Job, state: State, observer: int
) -> Iterator[tuple[str, Places]]:
    """Places of boids that the observer does not see by `sight`, and what they are."""
    seen, length = sight_of(job, subject), float(job.settings["width"]) / SIDE
    vx, vy = (float(state.arrays[f"flock.{name}"][observer]) for name in ("vx", "vy"))
    for draw in range(DRAWS):
        if math.isfinite(seen.range):
            yield (
                f"farther away than sight declares, {seen.range:g},",
                _ring(job, observer, draw, seen.range, length),
            )
    for draw in range(DRAWS):
        if seen.fov < 360.0 and (vx or vy):
            half, ahead = math.radians(seen.fov / 2), math.atan2(vy, vx)
            yield (
                f"outside the cone that sight declares, {seen.fov:g} degrees,",
                _behind(job, observer, draw, ahead, half, length),
            )


def _ring(job: Job, observer: int, draw: int, beyond: float, length: float) -> Places:
    """Places farther away than `beyond`, up to about twice as far."""

    def places(room: float) -> Floats | None:
        if job.settings["minimum_image"] and room > MOST_ROOM * length:
            return None
        rng = np.random.default_rng(draw)
        distances = beyond * (1 + 1e-9) + room + length * rng.random(BOIDS)
        return _about(job, observer, distances, rng.uniform(0, 2 * math.pi, BOIDS))

    return places


def _behind(
    job: Job, observer: int, draw: int, ahead: float, half: float, length: float
) -> Places:
    """Places within the range, at larger angles than `half` from the way ahead."""

    def places(room: float) -> Floats | None:
        rng = np.random.default_rng(draw)
        least = half + 0.01 + math.atan2(room, NEAREST * length)
        if least >= math.pi:
            return None
        angles = rng.uniform(least, math.pi, BOIDS) * rng.choice((-1.0, 1.0), BOIDS)
        distances = length * rng.uniform(NEAREST, FARTHEST, BOIDS)
        return _about(job, observer, distances, ahead + angles)

    return places


def _about(job: Job, observer: int, distances: Floats, angles: Floats) -> Floats:
    """Places about the observer: it is in the middle of an open world, and at a corner
    of a periodic one.
    """
    distances[observer] = 0.0
    around: Floats = distances * np.stack([np.cos(angles), np.sin(angles)])
    side = float(job.settings["width"])
    if job.settings["minimum_image"]:
        return np.mod(CORNER * side + around, side)
    return side / 2 + around


def _obstacles(subject: Subject, job: Job, state: State) -> int:
    """How many worlds with obstacles were tried about the first boid."""
    model, params = subject.model, params_of(job, subject)
    beyond, length = model.obstacle_reach(params), float(job.settings["width"]) / SIDE
    if model.occupancy or math.isinf(beyond):
        return 0
    # Obstacles would be left out by the declared reach itself.
    job = replace(job, known=subject.variant(obstacle_reach=_everywhere).known)
    far = _ring(job, 0, 0, 2 * length, length)
    for draw in range(DRAWS):
        room = _room(job, state, 0, far)
        if room is None:
            return 0
        rocks = _rocks(job, beyond + room, length, np.random.default_rng(draw))
        among = replace(job, obstacles=rocks)
        alone, other = (_after(one, state, 0, far(room)) for one in (job, among))
        if alone[0].bits != other[0].bits:
            raise AssertionError(
                f"{of_function(model.obstacle_reach)}: obstacles farther away than"
                f" obstacle_reach declares, {beyond:g}, change the step of boid 0"
                f" ({in_words(job)}); obstacle_reach must declare the longest distance"
                " at which advance notices an obstacle's surface"
            )
    return DRAWS


def _everywhere(_params: object) -> float:
    return math.inf


def _rocks(job: Job, beyond: float, length: float, rng: Generator) -> Obstacles:
    """Discs about the middle, whose surfaces are farther away than `beyond`."""
    middle, size = float(job.settings["width"]) / 2, length / 8
    distances = (beyond + size) * (1 + 1e-9) + length * rng.random(OBSTACLES)
    angles = rng.uniform(0, 2 * math.pi, OBSTACLES)
    x, y = middle + distances * np.stack([np.cos(angles), np.sin(angles)])
    return tuple((*one, size, size, 1.0) for one in np.stack([x, y]).T.tolist())


def _settled(job: Job, state: State, observer: int, places: Places) -> Observed | None:
    """What becomes of the observer, with room enough for what moves."""
    room = _room(job, state, observer, places)
    return None if room is None else _after(job, state, observer, places(room))[0]


def _room(job: Job, state: State, observer: int, places: Places) -> float | None:
    """Twice as much as any boid moves in the next step; None if no room is enough."""
    room = 0.0
    for _ in range(MOST_TRIES):
        there = places(room)
        if there is None:
            return None
        moved = _after(job, state, observer, there)[1]
        if 2 * moved <= room:
            return room
        room = 2.5 * moved
    return None


def _after(
    job: Job, state: State, observer: int, places: Floats | None
) -> tuple[Observed, float]:
    """The outcome of one step from these places, and how far the fastest boid moves."""
    assert places is not None
    arrays = dict(state.arrays)
    arrays["flock.x"], arrays["flock.y"] = places
    simulation = Simulation(job)
    simulation.restore(state._replace(arrays=arrays))
    go(simulation, 1)
    flock = np.stack(simulation.flock[:4])
    ways = flock[:2] - places
    if job.settings["minimum_image"]:
        side = float(job.settings["width"])
        ways -= side * np.round(ways / side)
    moved = np.hypot(*ways)
    outcome = Observed(flock[:, observer].tobytes(), repr(simulation.noise.state))
    return outcome, float(np.nanmax(moved))
