"""Counts and sums during a trial.

The counts are escapes, collisions, arrivals at the goal, steps in local equilibrium,
and fissions and fusions of flocks. The sums are measures of motion.

The initial state is not counted. A boid that is outside, in an obstacle or in contact
at the start counts in step 1.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.goals import Goals, all_reached, has_arrived, note_reached
from kernels.groups import Labels, label_groups
from kernels.jit import jit, jit_apart
from kernels.settings import Observation
from kernels.state import Floats, Flock, Indices, World
from kernels.worlds import Reach, inside_any

ESCAPES, COLLISIONS, BOID_COLLISIONS, ARRIVED, ARRIVAL_STEPS, SETTLED, DEAD_ENDS = (
    range(7)
)
PAIR_COLLISIONS, FISSIONS, FUSIONS, GOALS_REACHED = range(7, 11)
N_EVENTS = 11
SPEEDS, CHANGES, GAINS = range(3)
N_INTEGRALS = 3
TOUCHING, ACCOMPANIED, OUT_OF_STEP = 1, 2, 4


class Watch(NamedTuple):
    """Counts, and the state of N boids after the last step.

    `counting` switches on the counts of positions, `pairing` the counts of pairs of
    boids, `integrating` the sums over velocities, and `following` the fissions and
    fusions of flocks. `contact` is the Reach with margin 0. `outside`, `inside` and
    `touching` (N,) mark the boids outside the world, in an obstacle and in contact with
    a boid. `arrived` (N,) marks the boids that have been at the goal, or at all of
    several goals. `in_step` (N,) is the number of steps for which a boid has matched
    the velocities of all its neighbours. `order` (N,) are the boids sorted by x, and
    `state` (N,) is temporary storage of a step. `before_x` and `before_y` (N,) are the
    positions one step earlier. `flock_before` (N,) has the flock label of each boid at
    the last frame on time. `flock_now`, `next_member` and `is_met` (N,) are temporary
    storage of a frame.

    `events` (N_EVENTS,) holds the counts. The first counts are escapes, collisions with
    obstacles, contacts per boid, boids that have arrived, and the sum of arrival steps.
    Then follow boids in equilibrium now, dead ends of the model, and contacts of pairs.
    The last counts are fissions and fusions of flocks up to the last frame on time, and
    goals reached by all boids together. `integrals` (N_INTEGRALS,) are sums over boids
    and steps: speeds, squared changes of velocity, and gains of |v|^2 / 2 without
    losses. `goals` are the goals of the Workspace; the Watch always notes reached
    goals.
    """

    counting: bool
    pairing: bool
    integrating: bool
    following: bool
    contact: Reach
    observation: Observation
    outside: NDArray[np.bool_]
    inside: NDArray[np.bool_]
    touching: NDArray[np.bool_]
    arrived: NDArray[np.bool_]
    in_step: NDArray[np.int64]
    order: Indices
    state: NDArray[np.uint8]
    before_x: Floats
    before_y: Floats
    flock_before: Labels
    flock_now: Labels
    next_member: Labels
    is_met: NDArray[np.bool_]
    events: NDArray[np.int64]
    integrals: Floats
    goals: Goals | None


def build_watch(
    n: int,
    counting: bool,
    pairing: bool,
    integrating: bool,
    following: bool,
    contact: Reach,
    observation: Observation,
    goals: Goals | None,
) -> Watch:
    """Return a Watch of `n` boids with all counts zero.

    Parameters
    ----------
    n : int
        Number of boids.
    counting, pairing, integrating, following : bool
        Groups of counts to update; see Watch.
    contact : Reach
        The Reach of the world with margin 0.
    observation : Observation
        Distances and tolerances of the counts.
    goals : Goals or None
        Goals of the Workspace; None if there is a single goal.

    Returns
    -------
    Watch
    """
    outside, inside, touching, arrived = np.zeros((4, n), np.bool_)
    return Watch(
        *(counting, pairing, integrating, following, contact, observation),
        *(outside, inside, touching, arrived),
        in_step=np.zeros(n, np.int64),
        order=np.arange(n, dtype=np.uint32),
        state=np.zeros(n, np.uint8),
        before_x=np.zeros(n),
        before_y=np.zeros(n),
        flock_before=np.zeros(n, np.int64),
        flock_now=np.zeros(n, np.int64),
        next_member=np.zeros(n, np.int64),
        is_met=np.zeros(n, np.bool_),
        events=np.zeros(N_EVENTS, np.int64),
        integrals=np.zeros(N_INTEGRALS),
        goals=goals,
    )


def note_start(flock: Flock, world: World, watch: Watch) -> None:
    """Note the state of boids at the start.

    A boid outside, in an obstacle or in contact at the start is not counted. A boid at
    the goal counts as an arrival.

    Parameters
    ----------
    flock : Flock
        Boids at the start.
    world : World
        Gives size, obstacles and goal.
    watch : Watch
        Changed in place.
    """
    count(flock, world, watch, 0)
    watch.events[[ESCAPES, COLLISIONS, BOID_COLLISIONS, SETTLED, PAIR_COLLISIONS]] = 0
    watch.in_step[:] = 0
    watch.integrals[:] = 0.0
    if watch.following:
        regroup(flock, watch)
        watch.flock_before[:] = watch.flock_now


@jit
def count(flock: Flock, world: World, watch: Watch, step: int) -> None:
    """Count the events of one step.

    Parameters
    ----------
    flock : Flock
        Boids after the step.
    world : World
        Gives size, obstacles and goal.
    watch : Watch
        Changed in place.
    step : int
        Number of steps done.
    """
    note_reached(watch.goals, flock, watch.observation.goal_radius)
    if watch.counting:
        _count_places(flock, world, watch, step)
    if watch.pairing:
        _sort(flock, watch)
        _compare_pairs(flock, watch)
        _count_pairs(watch)
        for i in range(flock.x.size):
            watch.before_x[i] = flock.x[i]
            watch.before_y[i] = flock.y[i]
    if watch.integrating:
        _integrate(flock, watch)


@jit
def _count_places(flock: Flock, world: World, watch: Watch, step: int) -> None:
    """Count boids that left the world, entered an obstacle or reached the goal.

    Only the first arrival of a boid counts. The goals reached are counted too.
    """
    radius = watch.observation.goal_radius
    for i in range(flock.x.size):
        x, y = flock.x[i], flock.y[i]
        outside = x < 0.0 or x > world.width or y < 0.0 or y > world.height
        inside = inside_any(world, watch.contact, x, y)
        watch.events[ESCAPES] += int(outside and not watch.outside[i])
        watch.events[COLLISIONS] += int(inside and not watch.inside[i])
        watch.outside[i] = outside
        watch.inside[i] = inside
        if not watch.arrived[i] and has_arrived(watch.goals, world, i, x, y, radius):
            watch.arrived[i] = True
            watch.events[ARRIVED] += 1
            watch.events[ARRIVAL_STEPS] += step
    watch.events[GOALS_REACHED] = all_reached(watch.goals, watch.events[ARRIVED])


@jit
def _sort(flock: Flock, watch: Watch) -> None:
    """Sort `order` by x, by insertion, since the order hardly changes in a step."""
    order = watch.order
    for k in range(1, order.size):
        i = order[k]
        place = k
        while place > 0 and flock.x[order[place - 1]] > flock.x[i]:
            order[place] = order[place - 1]
            place -= 1
        order[place] = i


@jit
def _compare_pairs(flock: Flock, watch: Watch) -> None:
    """Set the state of every boid from all pairs with this boid.

    Pairs are searched from each boid outwards along x.
    """
    about = watch.observation
    contact2, company2 = (
        about.contact_distance * about.contact_distance,
        about.flock_range * about.flock_range,
    )
    reach = max(about.contact_distance, about.flock_range)
    tolerance2 = about.equilibrium_tolerance * about.equilibrium_tolerance
    for i in range(flock.x.size):
        watch.state[i] = 0
    for k in range(flock.x.size):
        i = watch.order[k]
        for other in range(k + 1, flock.x.size):
            j = watch.order[other]
            dx, dy = flock.x[j] - flock.x[i], flock.y[j] - flock.y[i]
            if dx >= reach:
                break
            distance2 = dx * dx + dy * dy
            state = 0
            if distance2 < contact2:
                state = TOUCHING
                began = not _were_nearer(watch, i, j, contact2)
                watch.events[PAIR_COLLISIONS] += int(began)
            if distance2 < company2:
                state |= ACCOMPANIED
                if not _in_step(flock, i, j, tolerance2):
                    state |= OUT_OF_STEP
            watch.state[i] |= state
            watch.state[j] |= state


@jit
def _were_nearer(watch: Watch, i: int, j: int, square: float) -> bool:
    """Return whether two boids were near one step earlier.

    The distance is compared with the root of `square`.
    """
    dx = watch.before_x[j] - watch.before_x[i]
    dy = watch.before_y[j] - watch.before_y[i]
    return bool(dx * dx + dy * dy < square)


@jit
def _in_step(flock: Flock, i: int, j: int, tolerance2: float) -> bool:
    """Return whether two velocities differ by less than a fraction of the larger speed.

    `tolerance2` is the square of the fraction.
    """
    dx, dy = flock.vx[j] - flock.vx[i], flock.vy[j] - flock.vy[i]
    speed2 = max(
        flock.vx[i] * flock.vx[i] + flock.vy[i] * flock.vy[i],
        flock.vx[j] * flock.vx[j] + flock.vy[j] * flock.vy[j],
    )
    return bool(dx * dx + dy * dy < tolerance2 * speed2)


@jit
def _count_pairs(watch: Watch) -> None:
    """Count boids that came into contact with a boid, and boids in equilibrium.

    A boid is in equilibrium after at least `equilibrium_steps` steps in step with its
    neighbours.
    """
    settled = 0
    for i in range(watch.state.size):
        touching = watch.state[i] & TOUCHING != 0
        watch.events[BOID_COLLISIONS] += int(touching and not watch.touching[i])
        watch.touching[i] = touching
        in_step = watch.state[i] & (ACCOMPANIED | OUT_OF_STEP) == ACCOMPANIED
        watch.in_step[i] = watch.in_step[i] + 1 if in_step else 0
        settled += int(watch.in_step[i] >= watch.observation.equilibrium_steps)
    watch.events[SETTLED] = settled


@jit
def _integrate(flock: Flock, watch: Watch) -> None:
    """Add the contributions of one step to the integrals."""
    speeds, changes, gains = 0.0, 0.0, 0.0
    for i in range(flock.x.size):
        vx, vy = flock.vx[i], flock.vy[i]
        before_x, before_y = flock.previous_vx[i], flock.previous_vy[i]
        dx, dy = vx - before_x, vy - before_y
        square = vx * vx + vy * vy
        speeds += math.sqrt(square)
        changes += dx * dx + dy * dy
        gain = 0.5 * (square - (before_x * before_x + before_y * before_y))
        gains += max(0.0, gain)
    watch.integrals[SPEEDS] += speeds
    watch.integrals[CHANGES] += changes
    watch.integrals[GAINS] += gains


@jit_apart
def regroup(flock: Flock, watch: Watch) -> tuple[int, int]:
    """Find the present flocks; return the numbers of fissions and fusions.

    The function writes labels into `flock_now` and compares them with `flock_before`. A
    flock with members in k present flocks counts as k - 1 fissions. A flock with
    members from k earlier flocks counts as k - 1 fusions. So the number of flocks has
    grown by the first number minus the second.
    """
    n = flock.x.size
    _sort(flock, watch)
    label_groups(
        flock.x, flock.y, watch.order, watch.observation.flock_range, watch.flock_now
    )
    before, now, shared = 0, 0, 0
    for i in range(n):
        watch.next_member[i] = i
        before += int(watch.flock_before[i] == i)
    for i in range(n):
        label = watch.flock_now[i]
        if label == i:
            now += 1
        else:
            watch.next_member[i] = watch.next_member[label]
            watch.next_member[label] = i
    for label in range(n):
        if watch.flock_now[label] == label:
            shared += _count_origins(watch, label)
    return shared - before, shared - now


@jit
def _count_origins(watch: Watch, label: int) -> int:
    """Return the number of earlier flocks from which the members of a flock come."""
    found, member, is_first = 0, label, True
    while is_first or member != label:
        is_first = False
        origin = watch.flock_before[member]
        found += int(not watch.is_met[origin])
        watch.is_met[origin] = True
        member = watch.next_member[member]
    is_first = True
    while is_first or member != label:
        is_first = False
        watch.is_met[watch.flock_before[member]] = False
        member = watch.next_member[member]
    return found


@jit
def keep_flocks(watch: Watch, parted: int, joined: int) -> None:
    """Make the present flocks the earlier flocks of the next `regroup`.

    Parameters
    ----------
    watch : Watch
        Changed in place.
    parted, joined : int
        Return values of `regroup`; added to the events.
    """
    for i in range(watch.flock_now.size):
        watch.flock_before[i] = watch.flock_now[i]
    watch.events[FISSIONS] += parted
    watch.events[FUSIONS] += joined
