"""The model vortex: boids that pull each other together, and swirl about each other.

Change whatever you like, and launch again. docs/own-models.md says what to import.
"""

from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import limit
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.near import Near
from kernels.neighbours import ALL_ROUND, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, publish
from kernels.rules.borders import confine
from kernels.rules.social import cohesion
from kernels.settings import COMMON, TIME_STEP, About, InParts
from kernels.state import Flock, World
from kernels.workspace import Workspace

PULL = About("strength of the pull together", "1/time^2", low=0, rule="cohesion")
SWIRL = About("strength of the swirl", "1/time^2", low=0, rule="swirl")


class Params(NamedTuple):
    """What this model alone has: meaning, unit, range. A weight names its `rule`."""

    cohesion_weight: Annotated[float, PULL]
    swirl_weight: Annotated[float, SWIRL]
    perception_range: Annotated[float, About("how far boids see", "length", low=0)]
    max_speed: Annotated[float, About("upper limit of the speed", "length/time", low=0)]
    dt: Annotated[float, TIME_STEP, InParts("time")]  # equations continuous in time


RANGE = 200.0  # how far boids see

STANDARD = (
    COMMON  # what most models leave alone
    | {"cohesion_weight": 0.01, "swirl_weight": 0.01, "perception_range": RANGE}
    | {"max_speed": 3.0, "dt": 1.0, "n": 50, "steps": 400, "map": "empty"}
    | {"width": 400.0, "height": 400.0, "start_speed": 1.0}
    # For metrics, in the model's own unit: a flock, a contact, an arrival at the goal.
    | {"flock_range": RANGE, "contact_distance": RANGE / 40, "goal_radius": RANGE / 4}
)


def sight(params: Params) -> Sight:
    """Whom a boid sees: no rule may ask for others farther away."""
    return Sight(params.perception_range)


@jit
def swirl(near: Near, found: int) -> tuple[float, float]:
    """The mean way to the `found` boids in `near`, turned left: a rule of one's own."""
    x, y = 0.0, 0.0
    for k in range(found):
        x, y = x - near.dy[k], y + near.dx[k]
    return x / max(found, 1), y / max(found, 1)


@jit
def advance(
    flock: Flock,
    world: World,
    params: Params,
    work: Workspace,
    record: Record,
    _rng: Generator,
    steps: int,
) -> bool:
    """Take `steps` steps; False after the first one whose numbers are not finite."""
    others, near = others_of(flock, work, False), work.near
    for _ in range(steps):
        publish(flock, others, work)  # all react to the flock before the step
        for i in range(flock.x.size):
            robot = params_of(params, work, i)  # its own, where robots differ
            range2 = square_range(robot.perception_range, False)
            vx, vy = flock.vx[i], flock.vy[i]
            found = search(others, world, work.grid, i, range2, ALL_ROUND, vx, vy, near)
            pull_x, pull_y = cohesion(near, found, range2)
            swirl_x, swirl_y = swirl(near, found)
            ax = robot.cohesion_weight * pull_x + robot.swirl_weight * swirl_x
            ay = robot.cohesion_weight * pull_y + robot.swirl_weight * swirl_y
            vx, vy = limit(vx + ax * params.dt, vy + ay * params.dt, robot.max_speed)
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, y = flock.x[i] + vx * params.dt, flock.y[i] + vy * params.dt
            flock.x[i], flock.vx[i] = confine(x, vx, world.width, world.borders)
            flock.y[i], flock.vy[i] = confine(y, vy, world.height, world.borders)
        move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="vortex",
    source="",  # who described it, and where
    params=Params,
    presets={"standard": STANDARD},
    metrics=("speed", "polarization", "flock_radius"),
    sight=sight,
    advance=advance,
    update_order="all boids at once, from the flock as it was before the step",
    symmetries={"translation": {}, "rotation": {}, "permutation": {}},
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
)
