"""The `advance` of a model for eight trials at once, from the source of `advance`."""

import math
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple, get_args, get_type_hints

import numba
import numpy as np
from numpy.typing import NDArray

from kernels import elementary, goals, indices, neighbours, recording
from kernels.events import N_EVENTS
from kernels.jit import jit_as
from kernels.lanes.calls import plain_of
from kernels.lanes.conversion import SUBSTITUTES, converted
from kernels.lanes.facts import LIKE_FIRST, SAME_IN_ALL
from kernels.lanes.rows import rows, stack_all, write_turned
from kernels.lanes.search import move, move_all, search
from kernels.lanes.texts import function_of
from kernels.lanes.vectors import (
    OPTIONS,
    WIDTH,
    bits_number,
    bits_of,
    looked_up,
    number_bits,
    spread,
)
from kernels.model import Model
from kernels.near import Near
from kernels.robots import actuation, differing, sensing
from kernels.state import Flock, remember
from kernels.workspace import Workspace

ALL = 2**WIDTH - 1
"""Byte of a mask that is true in all lanes."""
piece = numba.njit(**OPTIONS)


class LanesWatch(NamedTuple):
    """Events that a model counts in one step."""

    events: Any


class LanesRecord(NamedTuple):
    """Flocks after each step since the last observation.

    `trail` (WIDTH, 1 + S, 4, M) has x, y, vx and vy of each lane, from the state before
    the first step. M is the number N of boids, rounded up to a multiple of WIDTH.
    `counted` has the events that the model counted in each step. `finite` has, for each
    step, the lanes in which all numbers were finite. `late` (1,) counts the steps since
    the last observation.
    """

    trail: NDArray[np.float64]
    late: NDArray[np.int64]
    counted: Any
    finite: NDArray[np.uint8]
    watch: LanesWatch


@piece
def _note(flock: Any, _world: Any, record: Any) -> bool:
    """Keep the flock after a step, and the events that the model counted.

    Returns False if the numbers of a lane are not finite.
    """
    late = record.late[0]
    record.late[0] = late + 1
    if late >= record.finite.size:
        return False
    finite = spread(True)
    for i in range(flock.x.size):
        total = flock.x[i] + flock.y[i] + flock.vx[i] + flock.vy[i]
        finite = finite & (abs(total) < math.inf)
    for i in range(0, flock.x.size, WIDTH):
        write_turned(flock.x, i, record.trail, late + 1, field=0)
        write_turned(flock.y, i, record.trail, late + 1, field=1)
        write_turned(flock.vx, i, record.trail, late + 1, field=2)
        write_turned(flock.vy, i, record.trail, late + 1, field=3)
    for k in range(N_EVENTS):
        record.counted[late * N_EVENTS + k] = record.watch.events[k]
        record.watch.events[k] = spread(0)
    record.finite[late] = bits_of(finite)
    return bool(record.finite[late] == ALL)


@piece
def _whole(neighbours: Any) -> Any:
    """Replace `kernels.indices.whole`: each turn of a loop concerns all lanes."""
    return neighbours


@piece
def _follow(
    _work: Any, _i: Any, _vx: Any, _vy: Any, wanted_x: Any, wanted_y: Any
) -> tuple[Any, Any]:
    """Replace `kernels.robots.actuation.drive` for boids with ideal actuation.

    Trials with limited actuation run alone.
    """
    return wanted_x, wanted_y


_remember = converted(remember)


@piece
def _publish(flock: Any, published: Any, _work: Any) -> None:
    """Replace `kernels.robots.sensing.publish` for boids without a sensing model."""
    _remember(flock, published)


@piece
def _others_of(flock: Any, work: Any, sequential: Any) -> Any:
    return flock if sequential else work.before


@piece
def _own_of(flock: Any, _work: Any) -> Any:
    return flock


@piece
def _params_of(params: Any, _work: Any, _i: Any) -> Any:
    """Replace `kernels.robots.differing.params_of` for boids with equal parameters."""
    return params


@piece
def _goal_of(world: Any, _goals: Any, _i: Any) -> tuple[float, float]:
    """Replace `kernels.goals.goal_of` for boids with one goal.

    Trials with several goals run alone.
    """
    return world.goal_x, world.goal_y


@piece
def _is_measured(_work: Any) -> bool:
    return False


@piece
def _bits_of(x: Any) -> Any:
    return number_bits(x)


@piece
def _number_of(bits: Any) -> Any:
    return bits_number(bits)


@piece
def _entry_of(table: Any, k: Any) -> Any:
    return looked_up(table, k)


SUBSTITUTES.update(
    {
        elementary.bits_of: _bits_of,
        elementary.number_of: _number_of,
        elementary.entry_of: _entry_of,
        indices.whole: _whole,
        actuation.drive: _follow,
        differing.params_of: _params_of,
        goals.goal_of: _goal_of,
        neighbours.search: search,
        neighbours.move: move,
        neighbours.move_all: move_all,
        recording.observe: _note,
        sensing.publish: _publish,
        sensing.others_of: _others_of,
        sensing.own_of: _own_of,
        sensing.is_measured: _is_measured,
    }
)
SAME_IN_ALL.update(
    map(plain_of, (recording.observe, sensing.is_measured, goals.goal_of))
)
LIKE_FIRST.update(
    map(plain_of, (sensing.others_of, sensing.own_of, differing.params_of))
)


def weights_of(model: Model) -> tuple[str, ...]:
    """Return the parameters that may differ between trials: weights that are floats."""
    params: Any = model.params
    return _weights(params)


def kernel_of(model: Model, alike: bool) -> Callable[..., bool]:
    """Return the kernel that advances WIDTH trials of a model.

    Weights may differ. `alike` means that all trials have identical obstacles.
    """
    params: Any = model.params
    return _kernel(model.advance, params, alike)


@cache
def _weights(params: type[Any]) -> tuple[str, ...]:
    hints = get_type_hints(params, include_extras=True)
    return tuple(
        name
        for name, hint in hints.items()
        if get_args(hint)[0] is float and get_args(hint)[1].rule
    )


@cache
def _kernel(
    advance: Callable[..., bool], params: Any, alike: bool
) -> Callable[..., bool]:
    weights = _weights(params)
    fields = ", ".join(
        f"weights[{weights.index(name)}]" if name in weights else f"params.{name}"
        for name in params._fields
    )
    apart = "stack_all(world), stack_all(reach), stack_all(occupancy)"
    text = f"""
        def fly(room, world, params, grid, reach, occupancy, kind, rngs, steps):
            placed, reached, taken = {"world, reach, occupancy" if alike else apart}
            bodies, ways, weights = room.bodies, room.ways, rows(room.weights)
            flock = Flock({_rows_of("bodies", 0, 6)})
            before = Flock({_rows_of("bodies", 6, 12)})
            heading_x, heading_y = {_rows_of("bodies", 12, 14)}
            near = Near(room.who, {_rows_of("ways", 0, 4)}, room.marks, 0, None)
            work = Workspace(
                grid, near, reached, taken, before, heading_x, heading_y, 0, 0, kind, 0,
                None, None,
            )
            record = LanesRecord(
                room.trail, room.late, rows(room.counted), room.finite,
                LanesWatch(rows(room.events))
            )
            move_all(grid, flock)
            return advance(flock, placed, Params({fields}), work, record, rngs, steps)
    """
    scope: dict[str, Any] = {
        "__name__": advance.__module__,
        "move_all": move_all,
        "rows": rows,
        "stack_all": stack_all,
        "Flock": Flock,
        "Near": Near,
        "Workspace": Workspace,
        "LanesRecord": LanesRecord,
        "LanesWatch": LanesWatch,
        "Params": params,
        "advance": converted(advance),
    }
    fly: Callable[..., bool] = jit_as(function_of(text, scope), advance)
    return fly


def _rows_of(name: str, first: int, end: int) -> str:
    return ", ".join(f"rows({name}[{k}])" for k in range(first, end))
