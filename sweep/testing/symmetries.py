"""The check that a model has the declared symmetries."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, get_args
from unittest import SkipTest

import numpy as np
from numpy.typing import NDArray

from kernels.model import Symmetry
from sweep.design import Job
from sweep.spec import NotAllowedError
from sweep.testing.flights import Floats, begun, every_way, go, in_words, together
from sweep.testing.places import of_field
from sweep.testing.subject import Subject
from sweep.text import unknown
from sweep.trial import Simulation, State, kinds_of

BOIDS = 25
STEPS = 16
TOLERANCE = 1e-10
"""Tolerance as a fraction of the side of the world.

For velocities the unit is the side per step, or the highest speed. Rounding is 1e-16 of
the unit, which the published models amplify to at most 1e-12 in 15 steps. The error of
a broken symmetry is more than 1e-6.
"""
PLACES = (("flock.x", "flock.y"),)
VECTORS = (
    ("flock.vx", "flock.vy"),
    ("flock.previous_vx", "flock.previous_vy"),
    ("work.heading_x", "work.heading_y"),
)
STATES = ("work.state", "work.state_before")
BY_BOID = ("flock.", "work.heading_", "work.state")
"""Prefixes of the names of arrays with boids along the last axis."""


class Transform(NamedTuple):
    """A change of a flock.

    Positions p become `turn` p + `shift`, and vectors become `turn` v. The boids are in
    another `order`. In a periodic world positions are taken modulo `side`. `rows` are
    the pairs of rows of the state that are vectors.
    """

    turn: Floats
    shift: Floats
    order: NDArray[np.intp]
    side: float
    rows: tuple[tuple[int, int], ...]

    def of(self, state: State) -> State:
        """Return the changed state; other arrays of boids only follow the order."""
        arrays = {name: array.copy() for name, array in state.arrays.items()}
        for pairs, shift in ((PLACES, self.shift), (VECTORS, np.zeros((2, 1)))):
            for names in pairs:
                moved = self.turn @ np.stack([arrays[name] for name in names]) + shift
                for name, values in zip(names, moved, strict=True):
                    arrays[name] = values
        for name in PLACES[0]:
            arrays[name] = _wrapped(arrays[name], self.side)
        for name in STATES:
            for pair in map(list, self.rows):
                arrays[name][pair] = self.turn @ arrays[name][pair]
        for name in arrays:
            if name.startswith(BY_BOID):
                arrays[name] = arrays[name][..., self.order]
        return state._replace(arrays=arrays)


def symmetries(subject: Subject) -> None:
    """Check that a changed flock moves like the original flock, after the change.

    The changes are shifts, rotations, reflections and other orders of the boids. The
    check uses a world without obstacles, with the goal in the middle, and a tolerance
    of TOLERANCE.
    """
    declared = subject.model.symmetries
    place = of_field(subject.model, "symmetries")
    if not declared:
        raise SkipTest("the model declares no symmetry")
    if message := _not_readable(subject, declared):
        raise AssertionError(f"{place}: {message}")
    state = list(subject.model.state)
    rows = tuple((state.index(x), state.index(y)) for x, y in subject.model.vectors)
    for name, settings in declared.items():
        changes = {"n": BOIDS, "steps": STEPS} | dict(settings)
        for job in every_way(subject, obstacles=False, **changes):
            near = replace(job, settings=job.settings | together(job))
            for change in _changes(name, near, rows):
                if error := _broken(near, change):
                    raise AssertionError(
                        f'{place}: "{name}" is broken ({in_words(job)}): {error};'
                        " declare the required parameter values, or delete the symmetry"
                    )


def _not_readable(subject: Subject, declared: Any) -> str | None:
    """Return the error in the declaration of symmetries; None if valid."""
    if not isinstance(declared, Mapping):
        return 'write symmetries as {"translation": {"parameter": value}}'
    for name, settings in declared.items():
        if name not in get_args(Symmetry):
            return unknown("symmetry", name, get_args(Symmetry))
        for setting, value in settings.items():
            if setting not in subject.settings:
                return f"{name}: {unknown('parameter', setting, subject.settings)}"
            try:
                subject.settings[setting].coerce(value)
            except NotAllowedError as error:
                return f"{name}: {error}"
    return None


def _changes(
    name: str, job: Job, rows: tuple[tuple[int, int], ...]
) -> Iterator[Transform]:
    """Yield the changes that check a symmetry in the world of a job."""
    side = float(job.settings["width"])
    is_open = job.settings["borders"] == "open"
    same = Transform(
        turn=np.eye(2),
        shift=np.zeros((2, 1)),
        order=np.arange(BOIDS),
        side=math.inf,
        rows=rows,
    )
    turned = same._replace(shift=np.array([[side], [0.0]]))
    if name == "translation" and is_open:
        yield same._replace(shift=side * np.array([[0.2175], [-0.128]]))
    elif name == "translation" and job.settings["minimum_image"]:
        yield same._replace(shift=side * np.array([[0.484], [0.451]]), side=side)
    elif name == "rotation" and is_open:
        yield _about_the_middle(same, 1.0, side)
    elif name == "quarter_turn":
        yield turned._replace(turn=np.array([[0.0, -1.0], [1.0, 0.0]]))
    elif name == "reflection":
        yield turned._replace(turn=np.array([[-1.0, 0.0], [0.0, 1.0]]))
        yield same._replace(turn=np.array([[0.0, 1.0], [1.0, 0.0]]))
    elif name == "permutation" and is_open and _is_synchronous(job):
        yield same._replace(order=_sorted_otherwise(job))


def _sorted_otherwise(job: Job) -> NDArray[np.intp]:
    """Return another order of boids, shape (N,).

    Boids change places only within a kind, because boids are sorted by kind.
    """
    rng = np.random.default_rng(6)
    orders: list[NDArray[np.intp]] = []
    start = 0
    for count in kinds_of(job).values() or [BOIDS]:
        orders.append(start + rng.permutation(count))
        start += count
    return np.concatenate(orders)


def _about_the_middle(same: Transform, angle: float, side: float) -> Transform:
    cosine = math.cos(angle)
    sine = math.sin(angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    middle = np.full((2, 1), side / 2)
    return same._replace(turn=turn, shift=middle - turn @ middle)


def _is_synchronous(job: Job) -> bool:
    """Return whether the boids of a trial have no order.

    Boids that perceive new states one after the other have an order.
    """
    return job.settings.get("update") != "sequential"


def _broken(job: Job, change: Transform) -> str | None:
    """Return the difference between the two changed flocks in words.

    One flock is changed before the trial, the other after the trial. Return None within
    TOLERANCE.
    """
    state = begun(job)
    if state is None:
        return None
    plain = _end(job, state)
    changed = _end(job, change.of(state))
    if plain is None or changed is None:
        if plain is changed:
            return None
        return "one of the two flocks does not stay finite"
    expected = change.of(plain)
    side, dt = (float(job.settings[name]) for name in ("width", "dt"))
    speed = max(float(np.abs(plain.arrays[name]).max()) for name in VECTORS[0])
    worst = 0.0
    for names, scale in ((PLACES[0], side), (VECTORS[0], max(side / dt, speed))):
        for name in names:
            off = np.abs(expected.arrays[name] - changed.arrays[name])
            if names == PLACES[0] and math.isfinite(change.side):
                off = np.minimum(off, change.side - off)
            worst = max(worst, float(off.max()) / scale)
    if worst <= TOLERANCE:
        return None
    return (
        f"after {STEPS - 1} steps the two flocks differ by {worst:.1g} of the side of"
        " the world"
    )


def _end(job: Job, state: State) -> State | None:
    """Return the state at the end of a trial from a state; None if not finite."""
    simulation = Simulation(job)
    simulation.restore(state)
    going = go(simulation, simulation.steps_left)
    simulation.take_frames()
    return simulation.state().copied() if going else None


def _wrapped(values: Floats, side: float) -> Floats:
    return values % side if math.isfinite(side) else values
