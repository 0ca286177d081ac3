"""Heterogeneous robots: parameters of a model that differ from robot to robot."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.chance import ChanceKey, normals
from kernels.elementary import exp
from kernels.jit import jit
from kernels.robots.purposes import PARAMETER
from kernels.settings import Spread
from kernels.state import Floats

Rows = tuple[()] | tuple[NDArray[Any]]
"""Table (N,) with the parameters of each robot as a record; empty if all are equal.

numba removes a branch that depends on the length of a tuple.
"""


def build_rows(params: Any, spreads: Sequence[Spread], key: ChanceKey, n: int) -> Rows:
    """Return the parameters of each robot, an empty table if all robots are equal.

    Kernels are compiled without an empty table. With a deviation s, each robot has the
    value of the flock times exp(s z). The standard normal number z differs per robot
    and parameter. So the median is the value of the flock, and the set of robots above
    the median does not depend on the deviation.

    Parameters
    ----------
    params : NamedTuple
        Parameters of the flock.
    spreads : sequence of Spread
        Parameters that differ, with deviation and bounds.
    key : ChanceKey
        Key of the random factors.
    n : int
        Number of robots.
    """
    if not any(one.deviation > 0.0 for one in spreads):
        return ()
    kinds = [(name, type(value)) for name, value in params._asdict().items()]
    table = np.recarray(n, np.dtype(kinds, align=True))
    table[:] = tuple(params)
    factors = np.ones(n)
    for one in spreads:
        _draw(key, one.deviation, params._fields.index(one.parameter), factors)
        values = getattr(params, one.parameter) * factors
        table[one.parameter] = np.clip(values, one.low, one.high)
    return (table,)


@jit
def _draw(key: ChanceKey, deviation: float, number: int, factors: Floats) -> None:
    """Draw factors, each from key, deviation, parameter and robot alone."""
    for i in range(factors.size):
        one, _ = normals(key, i, number, 0, PARAMETER)
        factors[i] = exp(deviation * one)
