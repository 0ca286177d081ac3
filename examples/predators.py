"""Prey that keep together and flee, and predators that chase them.

Y. Chen, T. Kolokolnikov (2014), A minimal model of predator-swarm interactions, Journal
of the Royal Society Interface 11, 20131208. Forces give velocities, and all see all.

Many prey with one predator in their middle form a ring, with the inner radius R1 =
sqrt(b / a) and the outer one R2 = sqrt((1 + b) / a). For 2 < p < 4 it lasts if the
predator is strong enough to follow, c R2^(2 - p) > b, and too weak to chase,
c (R1^(2 - p) - R2^(2 - p)) < 1.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import limit
from kernels.elementary import power
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.near import Near
from kernels.neighbours import ALL_ROUND, move_all, search
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.sensing import others_of, publish
from kernels.rules.borders import confine
from kernels.settings import COMMON, About, Demand, InParts
from kernels.state import Flock, Kinds, World
from kernels.workspace import Workspace

PREY, PREDATOR = 0, 1
"""The kinds, in the order of the model."""


class Params(NamedTuple):
    """Strengths of the paper's equations (1.1) and (1.2), and how many predators."""

    attraction_weight: Annotated[
        float,
        About("a: pull between prey, times distance", low=0, rule="attraction"),
    ]
    flight_weight: Annotated[
        float, About("b: prey away from predators", low=0, rule="flight")
    ]
    chase_weight: Annotated[
        float, About("c: predators towards prey", low=0, rule="chase")
    ]
    chase_power: Annotated[
        float, About("p: the chase falls as distance^(1 - p)", low=0, high=10)
    ]
    predators: Annotated[int, About("how many boids are predators", "boids", low=0)]
    max_speed: Annotated[float, About("upper limit of the speed", "length/time", low=0)]
    dt: Annotated[
        float,
        About("time of one update", "time", low=0, exclusive=True),
        InParts("time"),
    ]


CONFUSED = COMMON | {
    "attraction_weight": 1.0,
    "flight_weight": 0.2,
    "chase_weight": 0.4,
    "chase_power": 3.0,
    "predators": 1,
    "max_speed": 10.0,
    "dt": 0.05,
    "n": 101,
    "steps": 1000,
    "map": "empty",
    "width": 10.0,
    "height": 10.0,
    "start_speed": 0.0,
    "start_center_x": 5.0,
    "start_center_y": 5.0,
    "start_radius": 1.0,
    "flock_range": 0.5,  # ranges of metrics: a part of the swarm's radius, about 1
    "contact_distance": 0.01,
    "goal_radius": 0.5,
    "pixel": 0.1,
}
WEAK = CONFUSED | {"chase_weight": 0.1}
STRONG = CONFUSED | {"chase_weight": 1.2}


def sight(_params: Params) -> Sight:
    """Everyone."""
    return Sight(math.inf)


def count_kinds(params: Params, n: int) -> tuple[int, int]:
    """The first of `n` boids are prey, the last ones are predators."""
    return n - params.predators, params.predators


@jit
def prey_velocity(
    params: Params, kind: Kinds, near: Near, found: int
) -> tuple[float, float]:
    """Eq. (1.1): prey repel each other by 1 / d and attract by a d, in the mean over
    all prey; a predator repels by b / d.
    """
    x, y, away_x, away_y, prey = 0.0, 0.0, 0.0, 0.0, 1
    for k in range(found):
        inverse = 1.0 / near.distance2[k] if near.distance2[k] > 0.0 else 0.0
        if kind[near.boid[k]] == PREY:
            x += near.dx[k] * (params.attraction_weight - inverse)
            y += near.dy[k] * (params.attraction_weight - inverse)
            prey += 1
        else:
            away_x -= near.dx[k] * inverse
            away_y -= near.dy[k] * inverse
    flight = params.flight_weight
    return x / prey + flight * away_x, y / prey + flight * away_y


@jit
def predator_velocity(
    params: Params, kind: Kinds, near: Near, found: int
) -> tuple[float, float]:
    """Eq. (1.2): the mean of c d^(1 - p) towards all prey."""
    x, y, prey = 0.0, 0.0, 0
    for k in range(found):
        if kind[near.boid[k]] == PREY:
            square = near.distance2[k]
            pull = power(square, -0.5 * params.chase_power) if square > 0.0 else 0.0
            x += near.dx[k] * pull
            y += near.dy[k] * pull
            prey += 1
    chase = params.chase_weight / max(prey, 1)
    return chase * x, chase * y


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
    """Take `steps` steps; False after the first one that is not finite."""
    others, near = others_of(flock, work, False), work.near
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            found = search(
                others, world, work.grid, i, math.inf, ALL_ROUND, 0.0, 0.0, near
            )
            if work.kind[i] == PREY:
                vx, vy = prey_velocity(params, work.kind, near, found)
            else:
                vx, vy = predator_velocity(params, work.kind, near, found)
            vx, vy = limit(vx, vy, params.max_speed)
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, y = flock.x[i] + vx * params.dt, flock.y[i] + vy * params.dt
            flock.x[i], flock.vx[i] = confine(x, vx, world.width, world.borders)
            flock.y[i], flock.vy[i] = confine(y, vy, world.height, world.borders)
        move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="predators",
    source="Y. Chen, T. Kolokolnikov (2014), J. R. Soc. Interface 11, 20131208",
    params=Params,
    presets={"confused": CONFUSED, "weak": WEAK, "strong": STRONG},
    metrics=("speed", "flock_radius"),
    sight=sight,
    advance=advance,
    kinds=("prey", "predator"),
    count_kinds=count_kinds,
    demands=(Demand("predators < n", "there must be at least one prey"),),
    update_order="all boids at once, from the flock as it was before the step",
    symmetries={
        "translation": {},
        "rotation": {},
        "quarter_turn": {},
        "reflection": {},
        "permutation": {},
    },
    length="length",
    time="time",
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=(
        "attraction_weight",
        "flight_weight",
        "chase_weight",
        "chase_power",
        "max_speed",
        "dt",
    ),
)
