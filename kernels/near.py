"""Room for the neighbours of one boid, and who counts as one."""

import math
from typing import NamedTuple

import numpy as np

from kernels.indices import PIECE, Marks, build_marks
from kernels.robots.senses import Senses
from kernels.settings import METRIC
from kernels.state import Floats, Indices


class Topology(NamedTuple):
    """`kind` is METRIC, NEAREST or VORONOI, and `nearest` how many count of the second.
    A search looks first up to the distance `around`, which is infinite with METRIC.
    """

    kind: int
    nearest: int
    around: float


EVERYBODY = Topology(METRIC, 1, math.inf)


class Near(NamedTuple):
    """Room for the neighbours of one boid: who, displacement to it and its square;
    arrays of shape (N + PIECE,).

    `factor`, of the same shape, is room for a number that a rule computes of each.
    `mark` says of everyone whether it is one; it has whole words of marks, at least N.
    `topology` says who counts of those in sight. `senses` say who is heard of; None
    where these are all.
    """

    boid: Indices
    dx: Floats
    dy: Floats
    distance2: Floats
    factor: Floats
    mark: Marks
    topology: Topology
    senses: Senses | None


def build_near(
    n: int, topology: Topology = EVERYBODY, senses: Senses | None = None
) -> Near:
    """Room for the neighbours of one of `n` boids."""
    who = np.zeros(n + PIECE, np.uint32)
    dx, dy, distance2, factor = np.zeros((4, n + PIECE))
    return Near(who, dx, dy, distance2, factor, build_marks(n), topology, senses)
