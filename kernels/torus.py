"""Distances on a torus."""

from kernels.jit import jit


@jit
def nearest_image(d: float, period: float) -> float:
    """The difference `d` of two coordinates in [0, period),
    taken the short way round.
    """
    if d > 0.5 * period:
        return d - period
    if d < -0.5 * period:
        return d + period
    return d
