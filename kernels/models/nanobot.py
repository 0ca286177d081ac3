"""Boids that keep a protected range about them.

The source is the pseudocode of "Boids for nanobot swarms", which names no author.
"""

from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import clamp_speed
from kernels.jit import jit
from kernels.model import NARROW_POTENTIAL, Model, PairPotential, Sight
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine, turn_back
from kernels.rules.social import protected_sums
from kernels.settings import (
    COMMON,
    SEQUENTIAL,
    SPEEDS,
    TIME_STEP,
    UPDATE,
    About,
    Demand,
    InParts,
)
from kernels.state import Flock, World
from kernels.workspace import Workspace


class Params(NamedTuple):
    """Arguments of the pseudocode, and one choice that the pseudocode makes."""

    separation_weight: Annotated[
        float, About("AvoidFactor", "1/time^2", low=0, rule="separation")
    ]
    alignment_weight: Annotated[
        float, About("MatchingFactor", "1/time", low=0, rule="alignment")
    ]
    cohesion_weight: Annotated[
        float, About("CenteringFactor", "1/time^2", low=0, rule="cohesion")
    ]
    separation_range: Annotated[
        float,
        About("ProtectedRange: radius within which others repel", "length", low=0),
    ]
    perception_range: Annotated[
        float,
        About("VisualRange: radius within which others are seen", "length", low=0),
    ]
    protected_count_once: Annotated[
        bool,
        About(
            "those inside the protected range take no part in alignment and cohesion"
        ),
    ]
    border_margin: Annotated[
        float,
        About("ScreenMargins: distance from a border to turn back at", "length", low=0),
    ]
    border_turn: Annotated[float, About("TurnFactor", "length/time^2", low=0)]
    min_speed: Annotated[
        float, About("MinSpeed, the lower limit of the speed", "length/time", low=0)
    ]
    max_speed: Annotated[
        float, About("MaxSpeed, the upper limit of the speed", "length/time", low=0)
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP, InParts("time")]


AS_WRITTEN = COMMON | {
    "separation_weight": 0.05,
    "alignment_weight": 0.05,
    "cohesion_weight": 0.0005,
    "separation_range": 8.0,
    "perception_range": 40.0,
    "protected_count_once": True,
    "border_margin": 100.0,
    "border_turn": 0.2,
    "min_speed": 3.0,
    "max_speed": 6.0,
    "update": "sequential",
    "n": 100,
    "steps": 1000,
    "dt": 1.0,
    "map": "empty",
    "width": 640.0,
    "height": 480.0,
    "start_speed": 4.0,
    "flock_range": 40.0,
}
"""The document gives no values. These are widely used with this pseudocode; boids,
steps and start are our choice.

There is no program of the authors either, so as_run equals as_written.
"""


def sight(params: Params) -> Sight:
    """Return a view all round, up to the longer of the two ranges, px."""
    return Sight(max(params.separation_range, params.perception_range))


def _pair_potential(params: Params) -> PairPotential:
    separation = (params.separation_weight, params.separation_range)
    return PairPotential(
        *separation,
        params.cohesion_weight,
        params.perception_range,
        params.protected_count_once,
    )


@jit
def _new_velocity(
    params: Params,
    others: Flock,
    own: Flock,
    world: World,
    i: int,
    work: Workspace,
    found: int,
) -> tuple[float, float]:
    """Return the velocity of boid `i` after all rules.

    The order is cohesion, alignment of the changed velocity, separation, borders,
    limits.
    """
    crowd2, range2 = (
        square_range(params.separation_range, False),
        square_range(params.perception_range, False),
    )
    crowd_x, crowd_y, x, y, sum_vx, sum_vy, count = protected_sums(
        others, work.near, found, crowd2, range2, params.protected_count_once
    )
    vx, vy, dt = own.vx[i], own.vy[i], params.dt
    if count > 0:
        share, centering, matching = (
            1.0 / count,
            params.cohesion_weight * dt,
            params.alignment_weight * dt,
        )
        vx, vy = vx + centering * (x * share), vy + centering * (y * share)
        vx, vy = (
            vx + matching * (sum_vx * share - vx),
            vy + matching * (sum_vy * share - vy),
        )
    avoiding, turn = params.separation_weight * dt, params.border_turn * dt
    vx, vy = vx - avoiding * crowd_x, vy - avoiding * crowd_y
    vx += turn * turn_back(own.x[i], world.width, params.border_margin)
    vy += turn * turn_back(own.y[i], world.height, params.border_margin)
    return clamp_speed(vx, vy, params.min_speed, params.max_speed)


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
    """Advance `flock` by `steps` updates; return whether its state stays finite.

    v += dt times each rule, limited at both ends; p += v dt. At rest the pseudocode
    divides by zero: here a boid at rest stays so until a rule moves it.

    Parameters
    ----------
    flock : Flock
        Positions and velocities of N boids, arrays (N,); changed in place.
    world : World
        Size, borders, obstacles and goal.
    params : Params
        Parameters of the model, before robots differ.
    work : Workspace
        Grid, neighbour list, state rows and robot layers of the trial.
    record : Record
        Receives frames, counts and the number of steps done.
    _rng : Generator
        Not used: the model draws no random numbers.
    steps : int
        Number of updates of length `dt`.

    Returns
    -------
    bool
        False after the first update whose state is not finite.
    """
    sequential = params.update == SEQUENTIAL
    others = others_of(flock, work, sequential)
    own = own_of(flock, work)
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            longer = max(robot.separation_range, robot.perception_range)
            range2 = square_range(longer, False)
            found = search(
                others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            vx, vy = _new_velocity(robot, others, own, world, i, work, found)
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, vx = confine(flock.x[i] + vx * params.dt, vx, world.width, world.borders)
            y, vy = confine(
                flock.y[i] + vy * params.dt, vy, world.height, world.borders
            )
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = x, y, vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="nanobot",
    source=(
        "Boids model for nanobot swarms: brief description, pseudocode implementation,"
        " final thoughts"
    ),
    params=Params,
    presets={"as_written": AS_WRITTEN, "as_run": AS_WRITTEN},
    metrics=(
        "speed",
        "polarization",
        "flock_count",
        "largest_flock",
        "largest_flock_share",
        "nearest_neighbour_distance",
        "escapes",
        "potential",
    ),
    sight=sight,
    advance=advance,
    pair_potential=_pair_potential,
    symmetries={
        "translation": {"border_turn": 0.0},
        "rotation": {"border_turn": 0.0},
        "quarter_turn": {},
        "reflection": {},
        "permutation": {},
    },
    demands=(SPEEDS,),
    potential_demands=(
        Demand("separation_range <= perception_range", NARROW_POTENTIAL),
    ),
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
)
