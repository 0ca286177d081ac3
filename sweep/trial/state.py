"""The state of a trial between two kernel calls, and the frames, as plain arrays."""

import json
from collections.abc import Iterator, Mapping, Sequence
from hashlib import sha256
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


class Taken(NamedTuple):
    """Frames of a trial.

    Attributes
    ----------
    steps : array of int, shape (F,)
    values : array of float, shape (metrics, F)
    bodies : array of float, shape (F, 4, N)
        x, y, vx and vy; N is 0 without trajectories and profiles.
    state : array of float, shape (F, S, N)
        The S state values per boid that the model has; N as for `bodies`.
    """

    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    bodies: NDArray[np.float64]
    state: NDArray[np.float64]


class State(NamedTuple):
    """State from which a trial resumes, in addition to job and frames.

    The grid of neighbours is not included. It is built again from the positions, and
    the results do not depend on the grid.

    Attributes
    ----------
    arrays : dict of arrays
        By name, such as "flock.x".
    generator : dict
        State of the random numbers of the noise.
    """

    arrays: dict[str, NDArray[Any]]
    generator: dict[str, Any]

    def copied(self) -> "State":
        """Return a copy of the state, which does not change when the trial resumes."""
        return self._replace(
            arrays={name: array.copy() for name, array in self.arrays.items()}
        )


def joined(taken: Sequence[Taken]) -> Taken:
    """Return consecutive frames as one object."""
    steps, values, *boids = zip(*taken, strict=True)
    return Taken(np.concatenate(steps), np.hstack(values), *map(np.concatenate, boids))


def every_so_many(taken: Taken, every: int) -> Taken:
    """Return the frames after a multiple of `every` steps.

    A trial also has a frame after the last step. The returned frames do not depend on
    the number of steps.
    """
    on_time = taken.steps % every == 0
    steps, values, *boids = taken
    return Taken(
        steps[on_time], values[:, on_time], *(frames[on_time] for frames in boids)
    )


def different(first: State, second: State) -> str:
    """Return the name of the first array that is not bitwise identical, or else ""."""
    names = (
        name
        for name, array in first.arrays.items()
        if array.tobytes() != second.arrays[name].tobytes()
    )
    return next(names, "")


def digest(parts: Mapping[str, object], generator: Mapping[str, Any]) -> str:
    """Return a hash of arrays in named tuples, and of the state of a generator.

    The hash covers the names, types and shapes of the arrays.
    """
    content = sha256(json.dumps(generator, sort_keys=True).encode())
    for part, value in parts.items():
        for name, array in _arrays(part, value):
            content.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
            content.update(array.tobytes())
    return content.hexdigest()


def changing(parts: Mapping[str, object], fixed: object) -> dict[str, NDArray[Any]]:
    """Return the arrays in nested named tuples that are not in `fixed`.

    The tuples are searched recursively, so a new array needs no entry anywhere. The
    arrays are not copies. An array in several places has the name of the first place.
    """
    left_out = {id(array) for _, array in _arrays("", fixed)}
    arrays = {}
    for part, value in parts.items():
        for name, array in _arrays(part, value):
            if id(array) not in left_out:
                arrays[name] = array
                left_out.add(id(array))
    return arrays


def _arrays(name: str, value: object) -> Iterator[tuple[str, NDArray[Any]]]:
    if isinstance(value, np.ndarray):
        yield name, value
    elif isinstance(value, tuple):
        for field, member in zip(
            getattr(value, "_fields", map(str, range(len(value)))), value, strict=True
        ):
            yield from _arrays(f"{name}.{field}", member)


def check(state: State, n: int, steps: int) -> None:
    """Raise ValueError for a state that no trial can have between two kernel calls.

    Kernels check no index. With an impossible number of frames, an impossible order, or
    an impossible label of a flock, a kernel would write anywhere in memory.

    Parameters
    ----------
    state : State
    n : int
        Number of boids.
    steps : int
        Number of steps of the trial.
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
        raise ValueError("the state is impossible for a trial")
