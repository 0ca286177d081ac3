"""Storage for the neighbours of one boid, and the rule that selects neighbours."""

import math
from typing import NamedTuple

import numpy as np

from kernels.indices import PIECE, Marks, build_marks
from kernels.robots.senses import Senses
from kernels.settings import METRIC
from kernels.state import Floats, Indices


class Topology(NamedTuple):
    """Rule that selects neighbours among the perceived boids.

    `kind` is METRIC, NEAREST or VORONOI. `nearest` is the number of neighbours with
    NEAREST. A search looks first up to the distance `around`, which is infinite with
    METRIC.
    """

    kind: int
    nearest: int
    around: float


EVERYBODY = Topology(METRIC, 1, math.inf)
"""Topology in which every perceived boid is a neighbour."""


class Near(NamedTuple):
    """Storage for the neighbours of one boid: arrays of shape (N + PIECE,).

    `boid` holds the indices of the neighbours, `dx` and `dy` the displacements to the
    neighbours, `distance2` the squared distances. `factor` has room for one number per
    neighbour, which a rule computes.

    `mark` marks the boids that are neighbours. The size of `mark` is a multiple of WORD
    and at least N. `topology` is the rule that selects neighbours among perceived
    boids. `senses` decide which messages the boid receives; None if the boid receives
    all messages.
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
    """Return storage for the neighbours of one boid of a flock.

    Parameters
    ----------
    n : int
        Number of boids N in the flock.
    topology : Topology, default EVERYBODY
        Rule that selects neighbours among perceived boids.
    senses : Senses, optional
        Sensing layer of the flock; by default a boid receives all messages in range.

    Returns
    -------
    Near
    """
    who = np.zeros(n + PIECE, np.uint32)
    dx, dy, distance2, factor = np.zeros((4, n + PIECE))
    return Near(who, dx, dy, distance2, factor, build_marks(n), topology, senses)
