"""Communication: the boids in sight from which a boid receives messages.

Limits are the radio range, lost packets, obstacles and bodies that hide boids, and
failures.
"""

import math

from kernels.chance import chance
from kernels.jit import jit, jit_apart
from kernels.near import Near
from kernels.robots.occlusion import (
    bodies_within,
    is_behind_body,
    is_behind_obstacle,
    obstacles_within,
    way_between,
)
from kernels.robots.purposes import LOSS
from kernels.robots.senses import NOW, SAMPLED, SENT, Senses
from kernels.state import World


@jit
def heard(senses: Senses | None, world: World, i: int, near: Near, found: int) -> int:
    """Keep in `near` the boids with messages that arrive, and return the number.

    The order of the boids does not change. The result does not depend on the search
    that found the boids. A hash of the step of the sample and of the two boids decides
    whether a packet is lost.

    Parameters
    ----------
    senses : Senses or None
        Sensing model of the flock; with None, all messages arrive.
    world : World
    i : int
        Index of the boid that receives.
    near : Near
        Boids in sight, changed in place.
    found : int
        Number of boids in sight.
    """
    if senses is None:
        return found
    return _keep_heard(senses, world, i, near, found)


@jit_apart
def _keep_heard(senses: Senses, world: World, i: int, near: Near, found: int) -> int:
    """Do the work of `heard` for boids with a sensing model.

    Packets that arrive are found first, because the second test, for hidden boids, is
    slower.
    """
    kept, furthest2 = 0, 0.0
    for k in range(found):
        _keep(near, k, kept)
        arrives, distance2 = _arrives(senses, world, i, int(near.boid[k]))
        kept += int(arrives)
        furthest2 = max(furthest2, distance2 if arrives else 0.0)
    obstacles = obstacles_within(senses, world, i, furthest2)
    bodies = bodies_within(senses, world, i, furthest2)
    if obstacles == bodies == 0:
        return kept
    found, kept = kept, 0
    for k in range(found):
        _keep(near, k, kept)
        j = int(near.boid[k])
        kept += int(not _is_hidden(senses, world, i, j, obstacles, bodies))
    return kept


@jit
def _keep(near: Near, k: int, kept: int) -> None:
    """Move the neighbour at index `k` to index `kept`."""
    near.boid[kept] = near.boid[k]
    near.dx[kept], near.dy[kept] = near.dx[k], near.dy[k]
    near.distance2[kept] = near.distance2[k]


@jit
def hears_of(senses: Senses | None, world: World, i: int, j: int) -> bool:
    """Return whether boid `i` receives the message of boid `j`.

    A rule calls this function for a boid that no search has found.

    Parameters
    ----------
    senses : Senses or None
        Sensing model of the flock; with None, all messages arrive.
    world : World
    i, j : int
        Indices of the boid that receives and of the boid that sends.
    """
    if senses is None:
        return True
    return hears(senses, world, i, j)


@jit
def hears(senses: Senses, world: World, i: int, j: int) -> bool:
    """Return whether boid `i` receives the message of boid `j`.

    The true positions at the last sample decide.

    Parameters
    ----------
    senses : Senses
        Sensing model of the flock.
    world : World
    i, j : int
        Indices of the boid that receives and of the boid that sends.
    """
    arrives, distance2 = _arrives(senses, world, i, j)
    if not arrives:
        return False
    obstacles = obstacles_within(senses, world, i, distance2)
    bodies = bodies_within(senses, world, i, distance2)
    return not _is_hidden(senses, world, i, j, obstacles, bodies)


@jit
def _is_hidden(
    senses: Senses, world: World, i: int, j: int, obstacles: int, bodies: int
) -> bool:
    """Return whether boid `j` is hidden from boid `i`.

    `obstacles` and `bodies` are the numbers of obstacles and bodies that can be between
    the boids.
    """
    dx, dy = way_between(senses, world, i, j)
    if is_behind_obstacle(senses, world, i, obstacles, dx, dy):
        return True
    return is_behind_body(senses, bodies, dx, dy)


@jit
def _arrives(senses: Senses, world: World, i: int, j: int) -> tuple[bool, float]:
    """Return whether a packet from `j` arrives at `i`, and the squared distance.

    Occlusion by obstacles and bodies is not tested. The probability of a lost packet is
    packet_loss (d / packet_loss_range)^2, at most 1. The simulator of G. Vasarhelyi et
    al. (2018) uses this law: Optimized flocking of autonomous drones in confined
    environments, Science Robotics 3, eaat3536.
    """
    dx, dy = way_between(senses, world, i, j)
    distance2 = dx * dx + dy * dy
    if senses.blind_from[i] <= senses.times[NOW]:
        return False, distance2
    if senses.silent_from[j] <= senses.times[SENT]:
        return False, distance2
    if distance2 > senses.radio_range * senses.radio_range:
        return False, distance2
    if senses.packet_loss > 0.0 and _is_lost(senses, i, j, distance2):
        return False, distance2
    return True, distance2


@jit
def _is_lost(senses: Senses, i: int, j: int, distance2: float) -> bool:
    """Return whether boid `i` has lost the packet of `j` in the last sample."""
    scale2 = senses.packet_loss_range * senses.packet_loss_range
    share = 1.0 if scale2 == math.inf else distance2 / scale2
    drawn = chance(senses.key, senses.times[SAMPLED], i, j, LOSS)
    return drawn < senses.packet_loss * share
