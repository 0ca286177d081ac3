"""What happens at the edge of the world, and near it."""

from kernels.jit import jit
from kernels.settings import BOUNDED, TORUS


@jit
def confine(
    position: float, velocity: float, length: float, borders: int
) -> tuple[float, float]:
    """One coordinate and its velocity after the border has acted.

    A torus wraps the position once; a bounded world mirrors position and velocity; an
    open one does nothing.
    """
    if borders == TORUS:
        if position < 0.0:
            position += length
        elif position >= length:
            position -= length
    elif borders == BOUNDED:
        if position < 0.0:
            position, velocity = -position, -velocity
        elif position > length:
            position, velocity = 2.0 * length - position, -velocity
    return position, velocity


@jit
def turn_back(position: float, length: float, margin: float) -> float:
    """The way back for one coordinate in [0, L]: 1 below `margin`, else -1 above L -
    margin, else 0.

    It holds beyond the borders too. Eqs. (18) and (19) of patel2023, and nanobot.
    """
    back = -1.0 if position > length - margin else 0.0
    return 1.0 if position < margin else back
