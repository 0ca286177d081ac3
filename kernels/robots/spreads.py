"""Parameters of a model that differ from robot to robot, as robots of one make do."""

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
"""A table (N,) with a record for each robot, the parameters of its model; empty where
all have the same. numba leaves out a branch that depends on the length of a tuple.
"""


def build_rows(params: Any, spreads: Sequence[Spread], key: ChanceKey, n: int) -> Rows:
    """The parameters of each of `n` robots, where those of the flock are `params`.
    Where all have the same, kernels are compiled without any of this.

    With a deviation s each robot has the value times exp(s z), with a standard normal
    number z of its own for each parameter. So the median is the value of the flock, and
    at any deviation the same robots are above it.
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
    """Factors that depend on nothing but the deviation, the number of a parameter and
    the index of a robot.
    """
    for i in range(factors.size):
        one, _ = normals(key, i, number, 0, PARAMETER)
        factors[i] = exp(deviation * one)
