"""Sensing: knowledge of a boid about neighbours and about itself.

At the beginning of a step, each boid measures position and velocity, and sends a
message. A sample takes place every `sensing_period`. At a sample, boids receive the
messages sent `sensing_delay` before. Between samples, boids keep the received states.
Until the first delayed message arrives, boids use the messages sent at the start.
Errors of measurement continue from step to step. The knowledge of a boid about itself
has no delay.

A model calls `publish` at the beginning of each step. Rules read neighbours from
`others_of`, and the boid itself from `own_of`. The flock holds the true positions, from
which the model moves boids.
"""

from kernels.chance import normals
from kernels.jit import jit, jit_apart
from kernels.moving import move_obstacles
from kernels.neighbours import Grid, move_published
from kernels.robots.purposes import OWN_ERROR, SENT_ERROR
from kernels.robots.senses import NOT_BEGUN, NOW, SAMPLED, SENT, SINCE, Senses
from kernels.robots.wind import blow
from kernels.state import Floats, Flock, remember
from kernels.workspace import Workspace


@jit
def others_of(flock: Flock, work: Workspace, sequential: bool) -> Flock:
    """Return the flock as boids perceive neighbours.

    With a sensing model, the result holds the received messages, in any update order.
    Without a sensing model, the result is the flock before the step. In a sequential
    update without a sensing model, the result is the current flock, so that later boids
    know the new states of earlier boids.

    Parameters
    ----------
    flock : Flock
        True state.
    work : Workspace
    sequential : bool
        Whether boids are updated in sequence.
    """
    return flock if sequential and work.near.senses is None else work.before


@jit
def own_of(flock: Flock, work: Workspace) -> Flock:
    """Return the states that boids know of themselves, with errors of measurement."""
    return _own_of(work.near.senses, flock)


@jit
def _own_of(senses: Senses | None, flock: Flock) -> Flock:
    if senses is None:
        return flock
    return senses.own


@jit
def is_measured(work: Workspace) -> bool:
    """Return whether boids have a sensing model, and may not know all boids in sight.

    Without a sensing model, boids know all boids in sight.
    """
    return work.near.senses is not None


@jit
def publish(flock: Flock, others: Flock, work: Workspace) -> None:
    """Begin a step: the wind carries the flock, and boids exchange states.

    The function keeps the velocities before the step, and fills `others` and the flock
    of `own_of`. Moving obstacles take the positions after this step. A model calls
    `publish` once per step.

    Parameters
    ----------
    flock : Flock
        True state; the wind changes it.
    others : Flock
        Flock of `others_of`, filled here.
    work : Workspace
    """
    robots = work.robots
    blow(robots.wind, flock, work.grid, robots.keys.flown, robots.clock)
    _publish(work.near.senses, flock, others, work)
    work.robots.clock[0] += 1
    move_obstacles(work.motion, work.reach, work.robots.clock[0])


@jit
def _publish(
    senses: Senses | None, flock: Flock, others: Flock, work: Workspace
) -> None:
    if senses is None:
        remember(flock, others)
    else:
        _send(senses, flock, others, work.grid, work.robots.clock[0])


@jit_apart
def _send(senses: Senses, flock: Flock, others: Flock, grid: Grid, step: int) -> None:
    """Let all boids measure and send, and receive the messages of this step."""
    _begin_step(senses, step)
    for i in range(flock.x.size):
        flock.previous_vx[i], flock.previous_vy[i] = flock.vx[i], flock.vy[i]
        _measure(senses, flock, i)
    if senses.times[SAMPLED] == senses.times[NOW]:
        _sample(senses, flock, others)
        move_published(grid, others)


@jit
def _begin_step(senses: Senses, step: int) -> None:
    """Note the current step, and whether a sample takes place."""
    times = senses.times
    times[NOW] = step
    if times[SINCE] == NOT_BEGUN:
        times[SINCE] = step
    if (step - times[SINCE]) % senses.period == 0:
        times[SAMPLED] = step
        times[SENT] = max(step - senses.delay, times[SINCE])


@jit
def _slot(senses: Senses, step: int) -> int:
    """Return the index of the messages of a step."""
    return int((step - senses.times[SINCE]) % (senses.delay + 1))


@jit
def _measure(senses: Senses, flock: Flock, i: int) -> None:
    """Measure the state of boid `i`, and keep the result as the message of the boid."""
    if not senses.law.is_none:
        _err(senses, senses.errors, i, SENT_ERROR)
        if not (senses.knows_itself or senses.shares_errors):
            _err(senses, senses.own_errors, i, OWN_ERROR)
        elif senses.shares_errors:
            for row in range(4):
                senses.own_errors[row, i] = senses.errors[row, i]
    slot = _slot(senses, senses.times[NOW])
    error, own = senses.errors, senses.own_errors
    senses.messages[slot, 0, i] = flock.x[i] + error[0, i]
    senses.messages[slot, 1, i] = flock.y[i] + error[1, i]
    senses.messages[slot, 2, i] = flock.vx[i] + error[2, i]
    senses.messages[slot, 3, i] = flock.vy[i] + error[3, i]
    senses.own.x[i], senses.own.y[i] = flock.x[i] + own[0, i], flock.y[i] + own[1, i]
    senses.own.vx[i] = flock.vx[i] + own[2, i]
    senses.own.vy[i] = flock.vy[i] + own[3, i]


@jit
def _err(senses: Senses, errors: Floats, i: int, purpose: int) -> None:
    """Advance the errors of boid `i` by one step; draw new errors in the first step."""
    law, step = senses.law, senses.times[NOW]
    for axis in range(2):
        one, other = normals(senses.key, step, i, axis, purpose)
        q, u = errors[axis, i], errors[2 + axis, i]
        if step == senses.times[SINCE]:
            new_q, new_u = law.position * one, law.velocity * other
        else:
            new_q = law.qq * q + law.qu * u + law.from_q * one
            new_u = law.uq * q + law.uu * u + (law.across * one + law.from_u * other)
        errors[axis, i], errors[2 + axis, i] = new_q, new_u


@jit
def _sample(senses: Senses, flock: Flock, others: Flock) -> None:
    """Deliver the messages that arrive in this step to all boids."""
    slot = _slot(senses, senses.times[SENT])
    for i in range(flock.x.size):
        others.x[i] = senses.messages[slot, 0, i]
        others.y[i] = senses.messages[slot, 1, i]
        others.vx[i] = senses.messages[slot, 2, i]
        others.vy[i] = senses.messages[slot, 3, i]
        senses.place[0, i], senses.place[1, i] = flock.x[i], flock.y[i]
