"""Who counts of those in sight, by definition: sorted by distance; and by the part of
the line halfway to another boid that is nearer to no third one.
"""

import math
from typing import Any

import numpy as np

from tests.naive.flight import birds, displacement
from tests.naive.rules import Vector


def _to(world: Any, flock: Any, i: int, others: list[int]) -> dict[int, Vector]:
    there = birds(flock)
    return {
        j: displacement(world, there[i].position, there[j].position) for j in others
    }


def nearest_of(
    world: Any, flock: Any, i: int, sighted: list[int], count: int
) -> list[int]:
    to = _to(world, flock, i, sighted)
    return sorted(sorted(sighted, key=lambda j: (to[j] @ to[j], j))[:count])


def voronoi_of(
    world: Any, flock: Any, i: int, sighted: list[int], slack: float
) -> set[int]:
    """Those with a side of more than nothing; `slack` shortens or lengthens sides by
    this part of the distance of their ends.
    """
    to = _to(world, flock, i, sighted)
    here = {j for j in sighted if not to[j].any()}
    firsts = {tuple(to[j]): j for j in reversed(sighted) if j not in here}.values()
    return here | {j for j in firsts if _has_side(to, j, firsts, slack)}


def _has_side(to: dict[int, Vector], j: int, others: Any, slack: float) -> bool:
    """Whether there is a place d/2 + t e on the line halfway, where e is d turned by a
    quarter, that is no nearer to any of the others: an interval of t.
    """
    low, high = -math.inf, math.inf
    for k in others:
        if k != j:
            across = to[k] @ np.array([-to[j][1], to[j][0]])
            room = to[k] @ to[k] / 2 - to[k] @ to[j] / 2
            if across > 0:
                high = min(high, room / across)
            elif across < 0:
                low = max(low, room / across)
            elif room < 0:
                return False
    if math.inf in (high, -low):
        return low < high
    return high - low > -slack * (1 + abs(high) + abs(low))
