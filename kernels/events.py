"""Counts and sums during a trial.

Counted are escapes, collisions, arrivals at the goal, steps that boids have moved in
step, and how flocks have parted and joined. Summed are measures of motion.

The start itself is not counted. A boid that is outside, in an obstacle or in contact at
the start counts in step 1.
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

    `counting` switches on what concerns a boid and its position, `pairing` what
    concerns two boids, `integrating` what concerns its velocity, and `following` what
    becomes of flocks from frame to frame. `contact` is the Reach with margin 0.
    `outside`, `inside`, `touching` and `arrived` (N,) tell which boids were outside the
    world, in an obstacle or in contact with another, and which have been at the goal,
    or at all of several; `in_step` (N,) for how many steps a boid has moved in step
    with all its neighbours. `order` (N,) are the boids sorted by x, `state` (N,) is
    room for a step. `before_x` and `before_y` (N,) are the positions one step earlier.
    `flock_before` (N,) has the label of the flock of each boid at the last frame on
    time; `flock_now`, `next_member` and `is_met` (N,) are room for a frame.

    `events` (N_EVENTS,) holds the counts: how often each of the first three began, how
    many boids have arrived, the sum of the steps at which they did, how many are in
    equilibrium now, how often a model found no way out, how often a contact of two
    boids began, how often flocks have parted and joined up to the last frame on time,
    and how many goals all boids together have reached. `integrals` (N_INTEGRALS,) are
    sums over boids and steps: of their speeds, of the squares of the changes of their
    velocities, and of the gains of |v|^2 / 2, losses left out. `goals` are the goals of
    the Workspace; reached goals are always noted here.
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
    """Return a Watch of `n` boids with all counts at zero.

    Parameters
    ----------
    n : int
        Number of boids.
    counting, pairing, integrating, following : bool
        Groups of counts to keep up, see Watch.
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
    """Note where boids start.

    Being outside, in an obstacle or in contact at the start is not counted; being at
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
    """Sort `order` by x, by insertion: from one step to the next it hardly changes."""
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
    """Set the state of every boid from its pairs.

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
    """Return whether two boids were near to each other one step earlier.

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
    """Count boids that came into contact with another, and boids in equilibrium.

    A boid in equilibrium has been in step for at least `equilibrium_steps`.
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
    """Find the present flocks, and return how often flocks have parted and joined.

    The labels are written into `flock_now`, and compared with `flock_before`. A flock
    whose members are in k flocks now has parted k - 1 times. A flock whose members come
    from k flocks has been joined k - 1 times. So the number of flocks has grown by the
    first number less the second.
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
    """Return from how many earlier flocks the members of a flock come."""
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
    """Make the present flocks the earlier ones of the next `regroup`.

    Parameters
    ----------
    watch : Watch
        Changed in place.
    parted, joined : int
        Return values of `regroup`, which are added to the events.
    """
    for i in range(watch.flock_now.size):
        watch.flock_before[i] = watch.flock_now[i]
    watch.events[FISSIONS] += parted
    watch.events[FUSIONS] += joined
