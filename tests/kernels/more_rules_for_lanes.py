"""Functions that rules for lanes call in another module."""

from kernels.jit import jit

POWER = 6


@jit
def first_way(near):
    return near.dx[0], near.dy[0]


@jit
def halved(x, is_large):
    if is_large and x > 1.0:
        return x / 2.0
    return x


@jit
def noisy(rng, x):
    return rng.normal(x, 0.5)


@jit
def writes(row):
    row[2] = 7.0
    return 1.0
