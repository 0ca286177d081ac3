"""Effects of the borders of the world, at a border and near a border."""

from kernels.jit import jit
from kernels.settings import BOUNDED, TORUS


@jit
def confine(
    position: float, velocity: float, length: float, borders: int
) -> tuple[float, float]:
    """Return one coordinate and its velocity after the border has acted.

    A periodic border (TORUS) wraps the position once. A reflecting border (BOUNDED)
    mirrors position and velocity. An unbounded world (OPEN) changes no number.

    Parameters
    ----------
    position : float
        Coordinate after the move, in lengths.
    velocity : float
        Velocity along the same axis.
    length : float
        Size of the world along the axis.
    borders : int
        OPEN, TORUS or BOUNDED.

    Returns
    -------
    position, velocity : float
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
    """Return the direction away from a near border, for one coordinate in [0, L].

    The direction is 1 below `margin`, else -1 above L - `margin`, else 0, also beyond
    the borders. The rule is Eqs. (18) and (19) of patel2023, and a rule of nanobot.

    Parameters
    ----------
    position : float
        Coordinate, in lengths.
    length : float
        Size L of the world along the axis.
    margin : float
        Distance from the border below which boids turn back.
    """
    back = -1.0 if position > length - margin else 0.0
    return 1.0 if position < margin else back
