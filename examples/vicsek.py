"""Boids that fly at one speed and take the mean heading of those near them, with noise.

T. Vicsek, A. Czirok, E. Ben-Jacob, I. Cohen, O. Shochet (1995), Novel type of phase
transition in a system of self-driven particles, Physical Review Letters 75, 1226. The
unit of length is the range of interaction, that of time is the step.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, Near, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.rules.borders import confine
from kernels.settings import COMMON, About, Demand
from kernels.state import Flock, World, remember
from kernels.workspace import Workspace


class Params(NamedTuple):
    """What the paper varies, and what it keeps."""

    noise: Annotated[
        float,
        About(
            "eta: width of the interval of angles that are added",
            "radians",
            low=0,
            high=math.tau,
        ),
    ]
    cruise_speed: Annotated[float, About("v: speed of all boids", "length/time", low=0)]
    interaction_range: Annotated[
        float, About("r: range within which headings are averaged", "length", low=0)
    ]
    dt: Annotated[float, About("time of one update", "time", low=0, exclusive=True)]


AS_WRITTEN = COMMON | {
    "noise": 2.0,
    "cruise_speed": 0.03,
    "interaction_range": 1.0,
    "dt": 1.0,
    "n": 100,
    "steps": 2000,
    "map": "empty",
    "width": 5.0,
    "height": 5.0,
    "borders": "torus",
    "minimum_image": True,
    "start_speed": 0.03,
    "flock_range": 1.0,
    "contact_distance": 0.01,
    "pixel": 0.05,
}


def sight(params: Params) -> Sight:
    """Whom a boid sees: all round, up to the range of interaction."""
    return Sight(params.interaction_range)


@jit
def mean_heading(seen: Flock, i: int, near: Near, found: int) -> tuple[float, float]:
    """The unit vector along the sum of the velocities of boid `i` and its neighbours.

    All have one speed, so this is the direction of Eq. (2), without its arctangent.
    Where the sum is zero, the boid keeps its own heading.
    """
    own_x, own_y = seen.vx[i], seen.vy[i]
    x, y = own_x, own_y
    for k in range(found):
        x += seen.vx[near.boid[k]]
        y += seen.vy[near.boid[k]]
    if x == 0.0 and y == 0.0:
        x, y = own_x, own_y
    length = math.sqrt(x * x + y * y)
    scale = 1.0 / length if length > 0.0 else 0.0
    return x * scale, y * scale


@jit
def turned(x: float, y: float, angle: float) -> tuple[float, float]:
    """The vector (x, y), turned by `angle` radians."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return cosine * x - sine * y, sine * x + cosine * y


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
    """Take `steps` steps; False after the first one that is not finite.

    A boid moves with the velocity that it had, Eq. (1), while it takes its new one.
    """
    range2, seen = square_range(params.interaction_range, True), work.before
    half = 0.5 * params.noise
    for _ in range(steps):
        remember(flock, seen)
        for i in range(flock.x.size):
            found = search(
                seen, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            x, y = mean_heading(seen, i, work.near, found)
            x, y = turned(x, y, rng.uniform(-half, half))
            flock.x[i], flock.vx[i] = confine(
                seen.x[i] + seen.vx[i] * params.dt,
                params.cruise_speed * x,
                world.width,
                world.borders,
            )
            flock.y[i], flock.vy[i] = confine(
                seen.y[i] + seen.vy[i] * params.dt,
                params.cruise_speed * y,
                world.height,
                world.borders,
            )
        move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="vicsek",
    source="T. Vicsek et al. (1995), Physical Review Letters 75, 1226",
    params=Params,
    presets={"as_written": AS_WRITTEN},
    metrics=("polarization", "flock_count"),
    sight=sight,
    advance=advance,
    update_order="all boids at once, from the flock as it was before the step",
    symmetries={
        "translation": {"noise": 0.0},
        "rotation": {"noise": 0.0},
        "quarter_turn": {"noise": 0.0},
        "reflection": {"noise": 0.0},
        "permutation": {"noise": 0.0},
    },
    demands=(
        Demand(
            "start_speed == cruise_speed",
            "all boids have one speed from the start: start_speed must be that one",
        ),
    ),
    length="r",
)
