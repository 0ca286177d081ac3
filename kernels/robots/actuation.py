"""Actuation of a boid that follows a commanded velocity: lag, limits, wheels, noise.

The model has a first-order lag, then a limit of the acceleration, then noise outside of
the loop. The program of G. Vasarhelyi et al. (2018) models actuators in this way:
Optimized flocking of autonomous drones in confined environments, Science Robotics 3,
eaat3536. The unicycle model is from A. De Luca, G. Oriolo, M. Vendittelli (2001),
Control of wheeled mobile robots: an experimental overview.
"""

import math

from kernels.arbitration import clamp_speed, limit
from kernels.chance import normals
from kernels.jit import jit
from kernels.robots.breakdowns import DRIFT, STOP
from kernels.robots.motors import Motors
from kernels.robots.purposes import PUSH
from kernels.rules.headings import direction, turned_towards
from kernels.workspace import Workspace


@jit
def drive(
    work: Workspace, i: int, vx: float, vy: float, wanted_x: float, wanted_y: float
) -> tuple[float, float]:
    """Return the velocity that a boid reaches in this step, within actuator limits.

    A model must call `drive` once per boid and step, because `drive` counts calls and
    keeps headings.

    After the failure `stop`, a boid has the velocity zero. After the failure `drift`, a
    boid keeps the velocity. All remaining boids approach the commanded velocity with
    the lag. Then the acceleration is limited, then the turn, then the speed: if limits
    conflict, the later limit applies. Noise is added last, outside of all limits.

    Parameters
    ----------
    work : Workspace
        Workspace; the headings and the count of calls change.
    i : int
        Index of the boid.
    vx, vy : float
        Velocity of the boid.
    wanted_x, wanted_y : float
        Velocity that the model commands.
    """
    return _driven(work.robots.motors, work, i, vx, vy, wanted_x, wanted_y)


@jit
def _driven(
    motors: Motors | None,
    work: Workspace,
    i: int,
    vx: float,
    vy: float,
    wanted_x: float,
    wanted_y: float,
) -> tuple[float, float]:
    if motors is None:
        return wanted_x, wanted_y
    work.robots.driven[0] += 1
    clock, failing = work.robots.clock[0], work.robots.failing
    has_failed = clock > failing.fails_at[i]
    if has_failed and failing.how == STOP:
        return 0.0, 0.0
    if has_failed and failing.how == DRIFT:
        return vx, vy
    noise_x, noise_y = 0.0, 0.0
    if motors.noise > 0.0:
        noise_x, noise_y = normals(work.robots.keys.flown, clock, i, 0, PUSH)
        noise_x, noise_y = motors.noise * noise_x, motors.noise * noise_y
    old_x, old_y = direction(vx, vy, work.heading_x[i], work.heading_y[i])
    if motors.wheels:
        x, y = _heading(motors, i, old_x, old_y, wanted_x, wanted_y)
        work.heading_x[i], work.heading_y[i] = x, y
        before, aim = math.sqrt(vx * vx + vy * vy), wanted_x * x + wanted_y * y
        speed = max(0.0, _speed(motors, i, before, max(0.0, aim)) + noise_x)
        return speed * x, speed * y
    x, y = _velocity(motors, i, vx, vy, wanted_x, wanted_y, old_x, old_y)
    x, y = x + noise_x, y + noise_y
    if x != 0.0 or y != 0.0:
        work.heading_x[i], work.heading_y[i] = x, y
    return x, y


@jit
def _velocity(
    motors: Motors,
    i: int,
    vx: float,
    vy: float,
    wanted_x: float,
    wanted_y: float,
    old_x: float,
    old_y: float,
) -> tuple[float, float]:
    """Return the velocity, before noise, of a boid that can move in any direction.

    The heading before the step is `old`. v + (w - v) (1 - exp(-dt / lag)) is the exact
    solution of v' = (w - v) / lag. For a boid at rest, the last heading defines the
    turn and the direction of the minimum speed.
    """
    kept = motors.kept[i]
    x, y = wanted_x + (vx - wanted_x) * kept, wanted_y + (vy - wanted_y) * kept
    if motors.changes:
        more_x, more_y = limit(x - vx, y - vy, motors.change[i])
        x, y = vx + more_x, vy + more_y
    if motors.turns:
        speed = math.sqrt(x * x + y * y)
        old_x, old_y = _heading(motors, i, old_x, old_y, x, y)
        x, y = speed * old_x, speed * old_y
    if x == 0.0 and y == 0.0:
        return motors.least[i] * old_x, motors.least[i] * old_y
    return clamp_speed(x, y, motors.least[i], motors.most[i])


@jit
def _heading(
    motors: Motors, i: int, old_x: float, old_y: float, to_x: float, to_y: float
) -> tuple[float, float]:
    """Return the heading after a turn from `old` towards the direction of `to`.

    A boid on wheels may turn on the spot.
    """
    x, y = direction(to_x, to_y, old_x, old_y)
    if motors.turns:
        return turned_towards(old_x, old_y, x, y, motors.cosine[i], motors.sine[i])
    return x, y


@jit
def _speed(motors: Motors, i: int, before: float, aim: float) -> float:
    """Return the speed of a boid on wheels for the target speed `aim`.

    The lag and the limits of the boid apply to the speed.
    """
    speed = aim + (before - aim) * motors.kept[i]
    speed = max(before - motors.change[i], min(speed, before + motors.change[i]))
    return float(max(motors.least[i], min(speed, motors.most[i])))
