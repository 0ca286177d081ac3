"""Boids with obstacles, with sweeps over one weight at a time.

The source is Nguyen (2024), "Monte Carlo analysis of boid simulations".
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import limit
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.rules.obstacles import repulsion_unit
from kernels.rules.social import ranged_sums
from kernels.rules.steering import wander
from kernels.settings import COMMON, SEQUENTIAL, TIME_STEP, UPDATE, About, InParts
from kernels.state import Flock, World
from kernels.workspace import Workspace


class Params(NamedTuple):
    """Weights and ranges of Eqs. (1) to (9)."""

    separation_weight: Annotated[
        float,
        About(
            "weight of the separation rule (Eq. 3)",
            low=0,
            rule="separation",
            symbol="w_s",
        ),
    ]
    alignment_weight: Annotated[
        float,
        About(
            "weight of the alignment rule (Eq. 3)",
            low=0,
            rule="alignment",
            symbol="w_a",
        ),
    ]
    cohesion_weight: Annotated[
        float,
        About(
            "weight of the cohesion rule (Eq. 3)",
            low=0,
            rule="cohesion",
            symbol="w_c",
        ),
    ]
    wander_weight: Annotated[
        float,
        About(
            "weight of the random acceleration (Eq. 3)",
            low=0,
            rule="wander",
            symbol="w_w",
        ),
    ]
    obstacle_weight: Annotated[
        float,
        About(
            "weight of the repulsion from obstacles (Eq. 3)",
            low=0,
            rule="obstacle",
            symbol="w_o",
        ),
    ]
    separation_range: Annotated[
        float,
        About("range of the separation rule (Eq. 4)", "length", low=0, symbol="r_s"),
    ]
    alignment_range: Annotated[
        float,
        About("range of the alignment rule (Eq. 5)", "length", low=0, symbol="r_a"),
    ]
    cohesion_range: Annotated[
        float,
        About("range of the cohesion rule (Eq. 6)", "length", low=0, symbol="r_c"),
    ]
    wander_range: Annotated[
        float,
        About(
            "largest component of the random acceleration (Eq. 8)",
            "length/time^2",
            low=0,
            symbol="r_w",
        ),
        InParts("noise"),
    ]
    obstacle_range: Annotated[
        float,
        About(
            "reach of an obstacle beyond its surface",
            "length",
            low=0,
            symbol=r"\rho",
        ),
    ]
    max_force: Annotated[
        float,
        About(
            "limit of the acceleration of each rule, before its weight (Eq. 9)",
            "length/time^2",
            low=0,
            symbol=r"F_{\max}",
        ),
    ]
    displacement_factor: Annotated[
        float,
        About("factor of the velocity in each move (Eq. 2)", low=0, symbol=r"\gamma"),
    ]
    drag: Annotated[
        float,
        About(
            "fraction of the velocity that is lost after each move",
            low=0,
            high=1,
            symbol="d",
        ),
        InParts("share"),
    ]
    range_inclusive: Annotated[
        bool, About("whether a neighbour exactly at the range counts")
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP, InParts("time")]


AS_WRITTEN = COMMON | {
    "separation_weight": 1.0,
    "alignment_weight": 1.0,
    "cohesion_weight": 1.0,
    "wander_weight": 1.0,
    "obstacle_weight": 10.0,
    "separation_range": 50.0,
    "alignment_range": 50.0,
    "cohesion_range": 200.0,
    "wander_range": 0.2,
    "obstacle_range": math.inf,
    "max_force": 0.5,
    "displacement_factor": 1.0,
    "drag": 0.0,
    "range_inclusive": True,
    "update": "synchronous",
    "n": 200,
    "steps": 500,
    "dt": 1.0,
    "map": "random_obstacles",
    "width": 1280.0,
    "height": 740.0,
    "borders": "open",
    "n_obstacles": 6,
    "start_speed": 3.0,
    "start_free": False,
}
AS_RUN = AS_WRITTEN | {
    "obstacle_range": 10.0,
    "displacement_factor": 3.0,
    "drag": 0.1,
    "range_inclusive": False,
    "update": "sequential",
    "borders": "torus",
    "minimum_image": False,  # the program wraps positions and measures in the plane
    "obstacle_positions": "integer",
    "start_positions": "integer",
    "start_velocities": "components",
    "start_speed": 1.0,
}


def sight(params: Params) -> Sight:
    """Return a view all round, up to the longest of the three ranges, px."""
    ranges = params.separation_range, params.alignment_range, params.cohesion_range
    return Sight(max(ranges), inclusive=params.range_inclusive)


def _obstacle_reach(params: Params) -> float:
    return params.obstacle_range


@jit
def _acceleration(
    params: Params,
    others: Flock,
    own: Flock,
    world: World,
    i: int,
    work: Workspace,
    found: int,
    rng: Generator,
) -> tuple[float, float]:
    """Return the weighted sum of Eq. (3) for boid `i`.

    Each force is limited to max_force; the wander term and the sum have no limit.
    """
    most, inclusive = params.max_force, params.range_inclusive
    away_x, away_y, vx, vy, aligned, to_x, to_y, joined = ranged_sums(
        others,
        work.near,
        found,
        square_range(params.separation_range, inclusive),
        square_range(params.alignment_range, inclusive),
        square_range(params.cohesion_range, inclusive),
    )
    x, y = limit(away_x, away_y, most)
    ax, ay = params.separation_weight * x, params.separation_weight * y
    share = 1.0 / max(aligned, 1.0)
    x = vx * share - own.vx[i] if aligned > 0.0 else 0.0
    y = vy * share - own.vy[i] if aligned > 0.0 else 0.0
    x, y = limit(x, y, most)
    ax, ay = ax + params.alignment_weight * x, ay + params.alignment_weight * y
    share = 1.0 / max(joined, 1.0)
    x, y = limit(to_x * share, to_y * share, most)
    ax, ay = ax + params.cohesion_weight * x, ay + params.cohesion_weight * y
    x, y = wander(rng, params.wander_range)
    ax, ay = ax + params.wander_weight * x, ay + params.wander_weight * y
    x, y = limit(
        *repulsion_unit(world, work.reach, params.obstacle_range, own.x[i], own.y[i]),
        most,
    )
    return ax + params.obstacle_weight * x, ay + params.obstacle_weight * y


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
    """Advance `flock` by `steps` updates; return whether its state stays finite.

    Eqs. (1) and (2): v += a dt, p += displacement_factor v dt, then the drag removes a
    fraction of v.

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
    rng : Generator
        Source of the model's random numbers.
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
    dt = params.dt
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            crowd, along = robot.separation_range, robot.alignment_range
            range2 = square_range(max(crowd, along, robot.cohesion_range), True)
            found = search(
                others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            ax, ay = _acceleration(robot, others, own, world, i, work, found, rng)
            vx, vy = flock.vx[i] + ax * dt, flock.vy[i] + ay * dt
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            step, kept = robot.displacement_factor * dt, 1.0 - robot.drag
            x, vx = confine(flock.x[i] + step * vx, vx, world.width, world.borders)
            y, vy = confine(flock.y[i] + step * vy, vy, world.height, world.borders)
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = (
                x,
                y,
                vx * kept,
                vy * kept,
            )
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="nguyen2024",
    source=(
        "Q. C. Nguyen (2024), Monte Carlo analysis of boid simulations with obstacles:"
        " a physics-based perspective"
    ),
    params=Params,
    presets={"as_written": AS_WRITTEN, "as_run": AS_RUN},
    metrics=(
        "speed",
        "flock_radius",
        "turn_rate",
        "turn_rate_unwrapped",
        "dispersion",
        "polarization",
    ),
    sight=sight,
    advance=advance,
    obstacle_reach=_obstacle_reach,
    symmetries={
        "translation": {},
        "rotation": {"wander_weight": 0.0},
        "quarter_turn": {"wander_weight": 0.0},
        "reflection": {"wander_weight": 0.0},
        "permutation": {"wander_weight": 0.0},
    },
    publishes=True,
    drives=True,
    goals_in_turn=False,
    equations=r"""
In each step, boid $i$ with position $p_i$ and velocity $v_i$ accelerates and moves
(Eqs. 1 and 2):

$$v_i \leftarrow v_i + a_i\,\Delta t, \qquad
p_i \leftarrow p_i + \gamma\,v_i\,\Delta t, \qquad
v_i \leftarrow (1 - d)\,v_i$$

The acceleration is a weighted sum of five rules (Eq. 3):

$$a_i = w_s L(s_i) + w_a L(\ell_i) + w_c L(c_i) + w_w\,\omega_i + w_o L(o_i)$$

Each rule but the random acceleration is limited to the length $F_{\max}$ (Eq. 9):

$$L(f) = f\,\min\left(1, \frac{F_{\max}}{|f|}\right)$$

$S_i$, $A_i$ and $C_i$ are the other boids within $r_s$, $r_a$ and $r_c$ of boid $i$. A
sum over no boid is zero.

**Separation** (Eq. 4) points away from near boids:

$$s_i = \sum_{j \in S_i} \frac{p_i - p_j}{\max(|p_i - p_j|,\,1)}$$

**Alignment** (Eq. 5) is the difference from the mean velocity:

$$\ell_i = \frac{1}{|A_i|} \sum_{j \in A_i} v_j - v_i$$

**Cohesion** (Eq. 6) points to the mean position:

$$c_i = \frac{1}{|C_i|} \sum_{j \in C_i} p_j - p_i$$

**Obstacles** (Eq. 7) repel boids. $O_i$ are the obstacles whose surface is nearer than
$\rho$. $q_k$ is the centre of obstacle $k$, or the nearest point of a polygon:

$$o_i = \sum_{k \in O_i} \frac{p_i - q_k}{|p_i - q_k|}$$

**Wander** (Eq. 8) is a random acceleration with independent uniform components:

$$\omega_i \sim U(-r_w, r_w)^2$$
""",
    shared=("dt",),
)
