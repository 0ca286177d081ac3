"""Choice of neighbours among perceived boids: all, the k nearest, or Voronoi.

M. Ballerini et al. (2008), Interaction ruling animal collective behavior depends on
topological rather than metric distance, PNAS 105, 1232-1237: starlings interact with
the six or seven nearest birds. F. Ginelli, H. Chate (2010), Relevance of metric-free
interactions in flocking phenomena, Physical Review Letters 105, 168103: boids interact
with the first shell of a Voronoi tessellation.

The neighbours are nearly always among the nearby boids. So a search reads nearby boids
first. The search reads all perceived boids only if the nearby boids do not determine
the choice.
"""

import math

from kernels.jit import jit
from kernels.near import Near, Topology
from kernels.settings import METRIC, NEAREST, Sensing
from kernels.state import World

UNSETTLED = -1
"""Result if the nearby boids do not determine the choice."""
NEARBY_A_NEIGHBOUR, NEARBY_OF_VORONOI = 3, 40
"""Mean numbers of boids within the distance that a search reads first.

The first number is per nearest boid, the second for all Voronoi neighbours. Of 10,000
boids at random positions, fewer than 1 in 1000 needed a longer search.
"""
NOBODY = -1
"""Index that denotes no boid."""


def topology_of(sensing: Sensing, n: int, world: World) -> Topology:
    """Return the topology of a sensing model.

    Parameters
    ----------
    sensing : Sensing
        Sensing parameters of the study.
    n : int
        Number of boids.
    world : World
        World of the boids; the area gives the distance that a search reads first.
    """
    around = look_around(sensing, n, world.width * world.height)
    return Topology(sensing.neighbours, sensing.nearest, around)


def look_around(sensing: Sensing, n: int, area: float) -> float:
    """Return the distance that a search reads first.

    Parameters
    ----------
    sensing : Sensing
        Sensing parameters of the study.
    n : int
        Number of boids, assumed to be spread evenly.
    area : float
        Area of the world, in squares of the unit of length.

    Returns
    -------
    float
        Distance in the unit of length; infinite with METRIC.
    """
    if sensing.neighbours == METRIC:
        return math.inf
    nearest = sensing.neighbours == NEAREST
    wanted = NEARBY_A_NEIGHBOUR * (sensing.nearest + 1.0)
    count = wanted if nearest else NEARBY_OF_VORONOI
    return math.sqrt(count * area / (math.pi * n))


@jit
def select(near: Near, found: int, around: float) -> int:
    """Keep the neighbours among perceived boids, in ascending order; return the number.

    Parameters
    ----------
    near : Near
        Perceived boids; boids that are not neighbours are removed.
    found : int
        Number of boids in `near`.
    around : float
        Distance beyond which `near` may lack perceived boids, in the unit of length.

    Returns
    -------
    int
        Number of neighbours. UNSETTLED if boids at `around` or beyond might be
        neighbours; then all `found` boids are kept.
    """
    if near.topology.kind == NEAREST:
        if found < near.topology.nearest and around < math.inf:
            return UNSETTLED
        return _keep_nearest(near, found, near.topology.nearest)
    if not _mark_shell(near, found, around):
        return UNSETTLED
    return _keep_marked(near, found)


@jit
def keep_nearest(near: Near, found: int, count: int) -> int:
    """Keep the nearest boids, in ascending order; return the number.

    Lower indices break ties of the distance.

    Parameters
    ----------
    near : Near
        Perceived boids; all but the nearest are removed.
    found : int
        Number of boids in `near`.
    count : int
        Number of boids to keep, at least 1.

    Returns
    -------
    int
        The minimum of `found` and `count`.
    """
    return _keep_nearest(near, found, count)


@jit
def _keep_nearest(near: Near, found: int, count: int) -> int:
    """Keep `count` boids of the least distance; return the number.

    Lower indices break ties of the distance.
    """
    if found <= count:
        return found
    least = near.factor
    for k in range(found):
        place = min(k, count - 1)
        if k < count or near.distance2[k] < least[place]:
            while place > 0 and least[place - 1] > near.distance2[k]:
                least[place] = least[place - 1]
                place -= 1
            least[place] = near.distance2[k]
    bound, equal = least[count - 1], 0
    for k in range(count):
        equal += int(least[k] == bound)
    for k in range(found):
        at_bound = near.distance2[k] == bound
        near.mark[k] = (near.distance2[k] < bound) | (at_bound & (equal > 0))
        equal -= int(at_bound)
    return _keep_marked(near, found)


@jit
def _keep_marked(near: Near, found: int) -> int:
    kept = 0
    for k in range(found):
        near.boid[kept] = near.boid[k]
        near.dx[kept], near.dy[kept] = near.dx[k], near.dy[k]
        near.distance2[kept] = near.distance2[k]
        kept += int(near.mark[k])
    return kept


@jit
def _mark_shell(near: Near, found: int, around: float) -> bool:
    """Mark the Voronoi neighbours of a boid; return whether the choice is final.

    The choice is not final if a boid at least at the distance `around` might be a
    further Voronoi neighbour, or might separate the boid from a neighbour.

    A boid at the displacement d bounds the Voronoi cell by x.d <= |d|^2 / 2. Inversion,
    q = d / |d|^2, turns the half planes into points. The sides of the cell become the
    corners of the convex hull of the points and of 0, the boid itself. The walk round
    the hull begins at the farthest corner, the nearest boid. If the walk does not
    return to its start, 0 is a corner and the cell is unbounded. Then a second walk
    goes in the opposite direction. Boids at `around` or beyond have points within 1 /
    `around` of 0. If this disc is within the hull, these boids change nothing.

    Of several boids at one position, the first is a neighbour. A boid at the position
    of the searching boid is a neighbour, and does not bound the cell.
    """
    first = _invert(near, found)
    if first == NOBODY:
        return around == math.inf
    least = _walk(near, found, first, 1.0)
    if least * around < 1.0:
        return False
    if least == 0.0:
        _walk(near, found, first, -1.0)
    return True


@jit
def _invert(near: Near, found: int) -> int:
    """Fill `near.factor` with 1 / |d|^2, and mark all boids at distance 0.

    Return the nearest of the remaining boids; NOBODY without remaining boids.
    """
    first = NOBODY
    for k in range(found):
        near.factor[k] = 1.0 / near.distance2[k] if near.distance2[k] > 0 else math.inf
        apart = math.isfinite(near.factor[k])
        near.mark[k] = not apart
        if apart and (first == NOBODY or near.factor[k] > near.factor[first]):
            first = k
    return first


@jit
def _walk(near: Near, found: int, first: int, side: float) -> float:
    """Mark the corners of the hull from `first` on.

    The walk is counterclockwise if `side` is 1 and clockwise if `side` is -1. Return
    the least distance of 0 from the visited sides; 0 if the walk ends before it returns
    to a corner.
    """
    least, corner = math.inf, first
    near.mark[first] = True
    while True:
        following, distance = _next_corner(near, found, corner, side)
        if following == NOBODY:
            return 0.0
        least = min(least, distance)
        if near.mark[following]:
            return least
        near.mark[following] = True
        corner = following


@jit
def _next_corner(near: Near, found: int, corner: int, side: float) -> tuple[int, float]:
    """Return the next corner of the hull, and the distance of 0 from the side to it.

    The walk is at `corner`. The next corner is NOBODY if no point is further round 0,
    by at most half a turn.

    All further points, and 0, are on one side of the line to the corner. Of points on
    one line the farthest is the corner.
    """
    from_x, from_y = _inverted(near, corner)
    best, best_x, best_y, best_area = NOBODY, 0.0, 0.0, 0.0
    for k in range(found):
        if math.isfinite(near.factor[k]):
            x, y = _inverted(near, k)
            area = side * (from_x * y - from_y * x)
            opposite = area == 0.0 and from_x * x + from_y * y < 0.0
            x, y = x - from_x, y - from_y
            turn = side * (best_x * y - best_y * x)
            farther = x * x + y * y > best_x * best_x + best_y * best_y
            if (area > 0.0 or opposite) and (turn < 0.0 or (turn == 0.0 and farther)):
                best, best_x, best_y, best_area = k, x, y, area
    length = math.sqrt(best_x * best_x + best_y * best_y)
    return best, best_area / length if length > 0.0 else 0.0


@jit
def _inverted(near: Near, k: int) -> tuple[float, float]:
    """Return the point q of the `k`-th boid in `near`."""
    return near.dx[k] * near.factor[k], near.dy[k] * near.factor[k]
