"""Distances with periodic boundaries (a torus)."""

from kernels.jit import jit


@jit
def nearest_image(d: float, period: float) -> float:
    """Return the shortest difference of two coordinates on a circle.

    The coordinates are in [0, period), so `d` is between -period and period.
    """
    if d > 0.5 * period:
        return d - period
    if d < -0.5 * period:
        return d + period
    return d
