"""The model of flocking with which JuliaDynamics compares frameworks for agents.

The declaration of ABMFrameworksComparison (commit 553c394, 2026-02-22) defines the
rules. Boids act one after the other, in a new random order in each step.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, move, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.rules.social import alignment_from, cohesion, separation_linear
from kernels.settings import COMMON, TIME_STEP, About
from kernels.state import Floats, Flock, World
from kernels.workspace import Workspace

TINY = 1e-300
"""A speed that is positive, so that a boid that stands divides by no zero."""
COHERE = About("weight of the mean way to neighbours", "", low=0, rule="cohesion")
SEPARATE = About("weight of the way from near boids", "", low=0, rule="separation")
MATCH = About("weight of the mean velocity of neighbours", "", low=0, rule="alignment")


class Params(NamedTuple):
    """The parameters of the declaration, under the names of this project."""

    cohesion_weight: Annotated[float, COHERE]
    separation_weight: Annotated[float, SEPARATE]
    alignment_weight: Annotated[float, MATCH]
    perception_range: Annotated[float, About("how far boids see", "length", low=0)]
    separation_range: Annotated[
        float, About("distance below which boids separate", "length", low=0)
    ]
    cruise_speed: Annotated[float, About("speed of all boids", "length/time", low=0)]
    dt: Annotated[float, TIME_STEP]


SMALL = (
    COMMON
    | {"cohesion_weight": 0.03, "separation_weight": 0.015, "alignment_weight": 0.05}
    | {"perception_range": 5.0, "separation_range": 1.0, "cruise_speed": 1.0, "dt": 1.0}
    | {"n": 200, "steps": 100, "map": "empty", "width": 100.0, "height": 100.0}
    | {"borders": "torus", "start_speed": 1.0}
    # For metrics, in the unit of the model.
    | {"flock_range": 5.0, "contact_distance": 1.0, "goal_radius": 1.0}
)
LARGE = SMALL | {"n": 400, "width": 150.0, "height": 150.0, "perception_range": 15.0}


def sight(params: Params) -> Sight:
    """Whom a boid sees: no rule may ask for others farther away."""
    return Sight(params.perception_range)


@jit
def shuffle(order: Floats, rng: Generator) -> None:
    """Write a random order of the boids into `order` (Fisher and Yates)."""
    for k in range(order.size):
        order[k] = k
    for k in range(order.size - 1, 0, -1):
        other = min(int(rng.random() * (k + 1)), k)
        order[k], order[other] = order[other], order[k]


@jit
def advance(
    flock: Flock,
    world: World,
    params: Params,
    work: Workspace,
    record: Record,
    rng: Generator,
    steps: int,
) -> bool:
    """Take `steps` steps; False after the first one whose numbers are not finite."""
    others = others_of(flock, work, True)
    own = own_of(flock, work)
    near = work.near
    order = work.state[0]
    for _ in range(steps):
        publish(flock, others, work)
        shuffle(order, rng)
        for turn in range(flock.x.size):
            i = int(order[turn])
            robot = params_of(params, work, i)
            range2 = square_range(robot.perception_range, True)
            crowd2 = square_range(robot.separation_range, False)
            vx, vy = own.vx[i], own.vy[i]
            found = search(others, world, work.grid, i, range2, ALL_ROUND, vx, vy, near)
            # The mean of no velocity is 0: at rest, a boid has nothing to subtract.
            match_x, match_y = alignment_from(0.0, 0.0, others, near, found, range2)
            cohere_x, cohere_y = cohesion(near, found, range2)
            part = 1.0 / max(found, 1)
            apart_x, apart_y = separation_linear(near, found, crowd2)
            vx += robot.cohesion_weight * cohere_x + robot.alignment_weight * match_x
            vy += robot.cohesion_weight * cohere_y + robot.alignment_weight * match_y
            vx += robot.separation_weight * apart_x * part
            vy += robot.separation_weight * apart_y * part
            scale = robot.cruise_speed / max(math.sqrt(vx * vx + vy * vy), TINY)
            vx, vy = vx * scale, vy * scale
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, y = flock.x[i] + vx * params.dt, flock.y[i] + vy * params.dt
            flock.x[i], flock.vx[i] = confine(x, vx, world.width, world.borders)
            flock.y[i], flock.vy[i] = confine(y, vy, world.height, world.borders)
            move(work.grid, i, flock.x[i], flock.y[i])
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="flocking",
    source=(
        "JuliaDynamics, ABMFrameworksComparison, Flocking/DECLARATION.md, commit"
        " 553c394 (2026-02-22)"
    ),
    params=Params,
    presets={"small": SMALL, "large": LARGE},
    metrics=("polarization", "flock_radius"),
    sight=sight,
    advance=advance,
    state={"order": About("boid that acts in this place of the order", "")},
    update_order="one boid after the other, in a new random order in each step",
    symmetries={"translation": {}, "rotation": {}},
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
)
