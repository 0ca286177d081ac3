"""Where threads wait for each other, within compiled code: a step of 1000 boids takes
less time than a call from Python.

A thread that waits looks again and again, and after a while it lets others have its
core in between. A thread that is lost, since its code has raised an error, opens the
barrier for good: nobody waits for it.
"""

import sys
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from kernels.jit import jit
from kernels.threads.team import ARRIVED, LOST, TURN, Team

BUILD: Any = cgutils
PATIENCE = 1000
"""A thread looks so often before it offers its core to others: some microseconds."""
NUMBER = ir.IntType(64)
BYTES = 8
GIVE_WAY = "SwitchToThread" if sys.platform == "win32" else "sched_yield"
"""The function of the system by which a thread offers its core to others."""


def _place(context: Any, builder: Any, kind: Any, gate: Any, place: Any) -> Any:
    data = context.make_array(kind)(context, builder, gate).data
    return builder.gep(data, [place])


@intrinsic
def _read(_: Any, gate: Any, place: Any) -> Any:
    """A number of the gate, before anything that is read after it."""

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        at = _place(context, builder, signature.args[0], *given)
        return builder.load_atomic(at, "acquire", BYTES)

    return types.int64(gate, place), code


@intrinsic
def _write(_: Any, gate: Any, place: Any, number: Any) -> Any:
    """Set a number of the gate, after all that was written before it."""

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        at = _place(context, builder, signature.args[0], *given[:2])
        builder.store_atomic(given[2], at, "release", BYTES)
        return context.get_dummy_value()

    return types.void(gate, place, number), code


@intrinsic
def _count(_: Any, gate: Any, place: Any) -> Any:
    """Add one to a number of the gate, and return what it was."""

    def code(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        at = _place(context, builder, signature.args[0], *given)
        return builder.atomic_rmw("add", at, NUMBER(1), "acq_rel")

    return types.int64(gate, place), code


@intrinsic
def _give_way(_: Any) -> Any:
    """Offer the core to others."""

    def code(context: Any, builder: Any, _signature: Any, _given: Any) -> Any:
        takes = ir.FunctionType(ir.IntType(32), [])
        builder.call(BUILD.get_or_insert_function(builder.module, takes, GIVE_WAY), [])
        return context.get_dummy_value()

    return types.void(), code


_ATOMIC: Any = _read, _write, _count, _give_way
READ, WRITE, COUNT, PAUSE = _ATOMIC


@jit
def wait(team: Team) -> bool:
    """Go on when all threads of the team are here; False if one is lost."""
    turn = READ(team.gate, TURN)
    if COUNT(team.gate, ARRIVED) == team.size - 1:
        WRITE(team.gate, ARRIVED, 0)
        WRITE(team.gate, TURN, turn + 1)
    looks = 0
    while READ(team.gate, TURN) == turn and READ(team.gate, LOST) == 0:
        looks += 1
        if looks > PATIENCE:
            PAUSE()
    return bool(READ(team.gate, LOST) == 0)


def give_up(team: Team) -> None:
    """Let nobody wait any more. A whole number is written at once on every processor
    that we know.
    """
    team.gate[LOST] = np.int64(1)
