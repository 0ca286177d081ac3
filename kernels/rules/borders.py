"""What happens at the edge of the world."""

from kernels.jit import jit
from kernels.settings import BOUNDED, TORUS


@jit
def confine(position: float, velocity: float, length: float, borders: int) -> tuple[float, float]:
    """One coordinate and its velocity after the border has acted.

    A torus wraps the position once; a bounded world mirrors position and velocity; an open one does nothing.
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
