"""The state of a trial between two kernel calls, and the frames that it has taken, as
plain arrays.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Taken(NamedTuple):
    """Frames of a run: steps (F,), metrics (number of metrics, F) and, where wanted, x,
    y, vx and vy (F, 4, N) and the state of boids (F, S, N).
    """

    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    bodies: NDArray[np.float64]
    state: NDArray[np.float64]


class State(NamedTuple):
    """All that a trial needs to go on, except its frames and what follows from its job.

    `arrays` are by name, as "flock.x"; `generator` is the state of the noise. The grid
    of neighbours is made anew: it follows from the positions, and no bit depends on it.
    """

    arrays: dict[str, NDArray[Any]]
    generator: dict[str, Any]

    def copied(self) -> "State":
        """The state with arrays of its own, to be kept while the trial goes on."""
        return self._replace(
            arrays={name: array.copy() for name, array in self.arrays.items()}
        )


def joined(taken: Sequence[Taken]) -> Taken:
    """Frames one after the other."""
    steps, values, *flown = zip(*taken, strict=True)
    return Taken(np.concatenate(steps), np.hstack(values), *map(np.concatenate, flown))


def every_so_many(taken: Taken, every: int) -> Taken:
    """The frames after a multiple of `every` steps: those that a trial of any number of
    steps has.
    """
    on_time = taken.steps % every == 0
    steps, values, *flown = taken
    return Taken(
        steps[on_time], values[:, on_time], *(frames[on_time] for frames in flown)
    )


def different(one: State, other: State) -> str:
    """The name of the first array whose bits differ; "" where there is none."""
    names = (
        name
        for name, array in one.arrays.items()
        if array.tobytes() != other.arrays[name].tobytes()
    )
    return next(names, "")


def digest(parts: Mapping[str, object], generator: Mapping[str, Any]) -> str:
    """A hash of the arrays in the named tuples `parts`, with their names, types and
    shapes, and of the state of a generator.
    """
    found = sha256(json.dumps(generator, sort_keys=True).encode())
    for part, value in parts.items():
        for name, array in _arrays(part, value):
            found.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
            found.update(array.tobytes())
    return found.hexdigest()


def changing(parts: Mapping[str, object], fixed: object) -> dict[str, NDArray[Any]]:
    """The arrays in the named tuples `parts`, and in tuples within them, without those
    that are also in `fixed`.

    They are found by walking through the tuples, so a new array needs no entry
    anywhere. They are the arrays in use, not copies; one in several places has the name
    of the first.
    """
    left_out = {id(array) for _, array in _arrays("", fixed)}
    found = {}
    for part, value in parts.items():
        for name, array in _arrays(part, value):
            if id(array) not in left_out:
                found[name] = array
                left_out.add(id(array))
    return found


def _arrays(name: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
    if isinstance(value, np.ndarray):
        yield name, value
    elif isinstance(value, tuple):
        for field, member in zip(
            getattr(value, "_fields", map(str, range(len(value)))), value, strict=True
        ):
            yield from _arrays(f"{name}.{field}", member)


def check(state: State, n: int, steps: int) -> None:
    """Raise ValueError for a state that no trial of `n` boids can have before its last
    step.

    Kernels check no index: with an impossible number of frames, an impossible order, or
    the label of no boid, they would write anywhere in memory.
    """
    step, filled = state.arrays["record.progress"].tolist()
    finite = all(
        np.isfinite(array).all()
        for name, array in state.arrays.items()
        if name.startswith(("flock.", "work.state"))
    )
    reached = state.arrays.get("work.goals.reached", np.zeros(1))
    in_order = np.array_equal(np.sort(state.arrays["record.watch.order"]), np.arange(n))
    flocks = state.arrays["record.watch.flock_before"]
    labelled = bool(((flocks >= 0) & (flocks < n)).all())
    right = in_order and labelled and bool((reached >= 0).all())
    if not (0 < step < steps and filled == 0 and finite and right):
        raise ValueError("no trial is ever in this state")
