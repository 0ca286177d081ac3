"""Parameters of one robot of a heterogeneous flock."""

from typing import TypeVar

from kernels.jit import jit
from kernels.robots.spreads import Rows
from kernels.workspace import Workspace

P = TypeVar("P")


@jit
def params_of(params: P, work: Workspace, i: int) -> P:
    """Return the parameters of boid `i`.

    Parameters
    ----------
    params : NamedTuple
        Parameters of the model, returned unless parameters differ from robot to robot.
    work : Workspace
        Workspace, with the parameters of each robot in `robots.rows`.
    i : int
        Index of the boid.
    """
    return _params_of(work.robots.rows, params, i)


@jit
def _params_of(rows: Rows, params: P, i: int) -> P:
    if len(rows) == 0:
        return params
    return rows[0][i]  # type: ignore[no-any-return]
