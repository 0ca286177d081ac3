"""Which parameters a robot has, where those of its model differ from robot to robot."""

from typing import TypeVar

from kernels.jit import jit
from kernels.robots.spreads import Rows
from kernels.workspace import Workspace

P = TypeVar("P")


@jit
def params_of(params: P, work: Workspace, i: int) -> P:
    """The parameters of boid `i`: `params`, those of its model, unless some of them
    differ from robot to robot.
    """
    return _params_of(work.robots.rows, params, i)


@jit
def _params_of(rows: Rows, params: P, i: int) -> P:
    if len(rows) == 0:
        return params
    return rows[0][i]  # type: ignore[no-any-return]
