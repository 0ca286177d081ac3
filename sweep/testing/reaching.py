"""The check that a model depends on nothing beyond its declared reach."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import NamedTuple
from unittest import SkipTest

import numpy as np
from numpy.random import Generator

from sweep.design import Job
from sweep.spec import Obstacles
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
from sweep.trial import Simulation, State

BOIDS = 8
DRAWS = 4
OBSTACLES = 12
MOST_TRIES = 6
NEAREST = 0.3
FARTHEST = 0.9
"""Distances between which boids outside the cone are placed, in ranges of sight."""
CORNER = 0.01
"""Coordinates of the observer in a periodic world, as a fraction of the side."""
MOST_ROOM = 2
"""Maximum room in a periodic world, in ranges; farther boids are near again."""

Places = Callable[[float], Floats | None]
"""Positions of the boids (2, N), at a distance larger by the room for moves in a step.

The argument is the room. The result is None if no such positions exist.
"""


class Observed(NamedTuple):
    """The observer after a step: x, y, vx and vy, and the state of the noise."""

    bits: bytes
    noise: str


def reach(subject: Subject) -> None:
    """Check that a step of a boid depends only on its perception.

    The step is bitwise identical for all positions of the boids that `sight` excludes:
    too far away, or outside the cone. The step is also bitwise identical with and
    without obstacles beyond `obstacle_reach`.

    If boids move by d within a step, the boids are at least 2 d beyond the range. The
    check uses an open world, and a periodic one across its borders.
    """
    fitting = 0
    tried = 0
    for job in every_way(subject, obstacles=False, n=BOIDS):
        is_open = job.settings["borders"] == "open"
        fits = is_open or job.settings["minimum_image"]
        state = begun(job) if fits else None
        if state is not None:
            fitting += 1
            tried += sum(
                _boids(subject, job, state, observer) for observer in (0, BOIDS - 1)
            )
            tried += _obstacles(subject, job, state) if is_open else 0
    if not fitting:
        raise SkipTest("the model runs in no open world and in no periodic world")
    if not tried:
        raise SkipTest("boids perceive all boids, and obstacles act at any distance")


def _boids(subject: Subject, job: Job, state: State, observer: int) -> int:
    """Check flocks around an observer in the middle; return the number of flocks."""
    outcomes = [
        (description, outcome)
        for description, places in _unseen(subject, job, state, observer)
        if (outcome := _settled(job, state, observer, places))
    ]
    for description, other in outcomes[1:]:
        reference = outcomes[0][1]
        # Earlier boids may draw more numbers, and so change the numbers of later boids.
        comparable = observer == 0 or reference.noise == other.noise
        if comparable and reference.bits != other.bits:
            raise AssertionError(
                f"{of_function(subject.model.sight)}: boids {description} change the"
                f" step of boid {observer} ({in_words(job)}); sight must declare all"
                " that advance reads"
            )
    return len(outcomes[1:])


def _unseen(
    subject: Subject, job: Job, state: State, observer: int
) -> Iterator[tuple[str, Places]]:
    """Yield positions of boids outside of `sight`, with a description in words."""
    sight = sight_of(job, subject)
    length = float(job.settings["width"]) / SIDE
    vx, vy = (float(state.arrays[f"flock.{name}"][observer]) for name in ("vx", "vy"))
    for draw in range(DRAWS):
        if math.isfinite(sight.range):
            yield (
                f"farther away than sight declares, {sight.range:g},",
                _ring(job, observer, draw, sight.range, length=length),
            )
    for draw in range(DRAWS):
        if sight.fov < 360.0 and (vx or vy):
            half = math.radians(sight.fov / 2)
            ahead = math.atan2(vy, vx)
            yield (
                f"outside the cone that sight declares, {sight.fov:g} degrees,",
                _behind(job, observer, draw, ahead, half=half, length=length),
            )


def _ring(job: Job, observer: int, draw: int, beyond: float, length: float) -> Places:
    """Return positions farther away than `beyond`.

    The additional distance is the room for moves, and up to one range of sight.
    """

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
    """Return positions within the range, but outside the cone.

    The angles from the direction `ahead` are larger than `half`, in radians.
    """

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
    """Return positions around the observer, shape (2, N).

    The observer is in the middle of an open world, or at a corner of a periodic world.
    """
    distances[observer] = 0.0
    around: Floats = distances * np.stack([np.cos(angles), np.sin(angles)])
    side = float(job.settings["width"])
    if job.settings["minimum_image"]:
        return np.mod(CORNER * side + around, side)
    return side / 2 + around


def _obstacles(subject: Subject, job: Job, state: State) -> int:
    """Check worlds with obstacles around the first boid; return the number."""
    model = subject.model
    beyond = model.obstacle_reach(params_of(job, subject))
    length = float(job.settings["width"]) / SIDE
    if model.occupancy or math.isinf(beyond):
        return 0
    # With the declared reach, obstacles would be left out.
    job = replace(job, catalogue=subject.variant(obstacle_reach=_everywhere).catalogue)
    far = _ring(job, 0, 0, 2 * length, length=length)
    for draw in range(DRAWS):
        room = _room(job, state, 0, far)
        if room is None:
            return 0
        rocks = _rocks(job, beyond + room, length, np.random.default_rng(draw))
        among = replace(job, obstacles=rocks)
        alone, other = (_after(world, state, 0, far(room)) for world in (job, among))
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
    """Return discs around the middle, with surfaces farther away than `beyond`."""
    middle = float(job.settings["width"]) / 2
    size = length / 8
    distances = (beyond + size) * (1 + 1e-9) + length * rng.random(OBSTACLES)
    angles = rng.uniform(0, 2 * math.pi, OBSTACLES)
    x, y = middle + distances * np.stack([np.cos(angles), np.sin(angles)])
    return tuple((*disc, size, size, 1.0) for disc in np.stack([x, y]).T.tolist())


def _settled(job: Job, state: State, observer: int, places: Places) -> Observed | None:
    """Return the outcome of the observer, with room enough for moves.

    Return None if no room is enough.
    """
    room = _room(job, state, observer, places)
    return None if room is None else _after(job, state, observer, places(room))[0]


def _room(job: Job, state: State, observer: int, places: Places) -> float | None:
    """Return at least twice the largest move of a boid in the next step.

    The move depends on the positions, so the room is found by trials of several values.
    Return None if no room is enough.
    """
    room = 0.0
    for _ in range(MOST_TRIES):
        positions = places(room)
        if positions is None:
            return None
        moved = _after(job, state, observer, positions)[1]
        if 2 * moved <= room:
            return room
        room = 2.5 * moved
    return None


def _after(
    job: Job, state: State, observer: int, places: Floats | None
) -> tuple[Observed, float]:
    """Return the outcome of one step, and the largest move of a boid."""
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
