"""How a boid follows the velocity that its model wants: a lag, limits, wheels, noise.

A first-order lag, then a limit of the acceleration, then noise outside of the loop: so
do motors of the program of G. Vasarhelyi et al. (2018), Optimized flocking of
autonomous drones in confined environments, Science Robotics 3, eaat3536. The unicycle
is that of A. De Luca, G. Oriolo, M. Vendittelli (2001), Control of wheeled mobile
robots: an experimental overview.
"""

import math

from kernels.arbitration import clamp_speed, limit
from kernels.chance import normals
from kernels.jit import jit, jit_apart
from kernels.robots.breakdowns import DRIFT, STOP
from kernels.rules.headings import direction, turned_towards
from kernels.workspace import Workspace

PUSH = 34
"""What the random numbers are for that are the noise of motors."""


@jit
def drive(
    work: Workspace, i: int, vx: float, vy: float, wanted_x: float, wanted_y: float
) -> tuple[float, float]:
    """The velocity that boid `i` gets in this step, which had (vx, vy) and whose model
    wants another one. To be called once for each boid and step.

    A boid that has stopped gets none, and one that drifts keeps what it has. Others
    come nearer to what is wanted by the lag; then their acceleration is limited, then
    their turn, then their speed: a later limit holds even where an earlier one does not
    then. Noise is added last, outside of all limits.
    """
    if not work.robots.motors.act:
        return wanted_x, wanted_y
    return _driven(work, i, vx, vy, wanted_x, wanted_y)


@jit_apart
def _driven(
    work: Workspace, i: int, vx: float, vy: float, wanted_x: float, wanted_y: float
) -> tuple[float, float]:
    """The same, of boids whose motors act."""
    motors = work.robots.motors
    clock, failing = work.robots.clock[0], work.robots.failing
    motors.driven[0] += 1
    has_failed = clock >= failing.fails_at[i]
    if has_failed and failing.how == STOP:
        return 0.0, 0.0
    if has_failed and failing.how == DRIFT:
        return vx, vy
    noise_x, noise_y = 0.0, 0.0
    if motors.noise > 0.0:
        noise_x, noise_y = normals(work.robots.keys.flown, clock, i, PUSH, 0)
        noise_x, noise_y = motors.noise * noise_x, motors.noise * noise_y
    if motors.wheels:
        return _rolled(work, i, vx, vy, wanted_x, wanted_y, noise_x)
    x, y = _followed(work, i, vx, vy, wanted_x, wanted_y)
    x, y = x + noise_x, y + noise_y
    if x != 0.0 or y != 0.0:
        work.heading_x[i], work.heading_y[i] = x, y
    return x, y


@jit
def _followed(
    work: Workspace, i: int, vx: float, vy: float, wanted_x: float, wanted_y: float
) -> tuple[float, float]:
    """The velocity of a boid that can move in any direction, before noise.

    v + (w - v) (1 - exp(-dt / lag)) is the exact solution of v' = (w - v) / lag. A boid
    at rest turns, and gets its least speed, from the heading that it had last.
    """
    motors = work.robots.motors
    kept = motors.kept[i]
    x, y = wanted_x + (vx - wanted_x) * kept, wanted_y + (vy - wanted_y) * kept
    if motors.changes:
        more_x, more_y = limit(x - vx, y - vy, motors.change[i])
        x, y = vx + more_x, vy + more_y
    old_x, old_y = direction(vx, vy, work.heading_x[i], work.heading_y[i])
    new_x, new_y = direction(x, y, old_x, old_y)
    if motors.turns:
        speed = math.sqrt(x * x + y * y)
        new_x, new_y = turned_towards(
            old_x, old_y, new_x, new_y, motors.cosine[i], motors.sine[i]
        )
        x, y = speed * new_x, speed * new_y
    if x == 0.0 and y == 0.0:
        return motors.least[i] * new_x, motors.least[i] * new_y
    return clamp_speed(x, y, motors.least[i], motors.most[i])


@jit
def _rolled(
    work: Workspace,
    i: int,
    vx: float,
    vy: float,
    wanted_x: float,
    wanted_y: float,
    noise: float,
) -> tuple[float, float]:
    """The velocity of a boid on wheels, which moves only where it heads.

    It turns towards what is wanted, on the spot if need be, and wants the part of that
    which lies along its heading then, but never moves back. Lag, limits and noise are
    those of its speed.
    """
    motors = work.robots.motors
    old_x, old_y = direction(vx, vy, work.heading_x[i], work.heading_y[i])
    x, y = direction(wanted_x, wanted_y, old_x, old_y)
    if motors.turns:
        x, y = turned_towards(old_x, old_y, x, y, motors.cosine[i], motors.sine[i])
    work.heading_x[i], work.heading_y[i] = x, y
    before = math.sqrt(vx * vx + vy * vy)
    aim = max(0.0, wanted_x * x + wanted_y * y)
    speed = aim + (before - aim) * motors.kept[i]
    speed = max(before - motors.change[i], min(speed, before + motors.change[i]))
    speed = max(motors.least[i], min(speed, motors.most[i]))
    speed = max(0.0, speed + noise)
    return speed * x, speed * y
