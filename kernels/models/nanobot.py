"""Boids with a protected range.

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
    """Arguments of the pseudocode, and one choice of the pseudocode."""

    separation_weight: Annotated[
        float,
        About(
            "weight of the separation rule (AvoidFactor)",
            "1/time^2",
            low=0,
            rule="separation",
            symbol="w_s",
        ),
    ]
    alignment_weight: Annotated[
        float,
        About(
            "weight of the alignment rule (MatchingFactor)",
            "1/time",
            low=0,
            rule="alignment",
            symbol="w_a",
        ),
    ]
    cohesion_weight: Annotated[
        float,
        About(
            "weight of the cohesion rule (CenteringFactor)",
            "1/time^2",
            low=0,
            rule="cohesion",
            symbol="w_c",
        ),
    ]
    separation_range: Annotated[
        float,
        About(
            "range of the separation rule (ProtectedRange)",
            "length",
            low=0,
            symbol="r_p",
        ),
    ]
    perception_range: Annotated[
        float,
        About(
            "range of the alignment and cohesion rules (VisualRange)",
            "length",
            low=0,
            symbol="r_v",
        ),
    ]
    protected_count_once: Annotated[
        bool,
        About(
            "whether boids within the range of separation are left out of alignment and"
            " cohesion"
        ),
    ]
    border_margin: Annotated[
        float,
        About(
            "distance from a border below which boids turn back (ScreenMargins)",
            "length",
            low=0,
            symbol="m",
        ),
    ]
    border_turn: Annotated[
        float,
        About(
            "acceleration away from a near border (TurnFactor)",
            "length/time^2",
            low=0,
            symbol=r"\tau",
        ),
    ]
    min_speed: Annotated[
        float,
        About(
            "lower limit of the speed (MinSpeed)",
            "length/time",
            low=0,
            symbol=r"v_{\min}",
        ),
    ]
    max_speed: Annotated[
        float,
        About(
            "upper limit of the speed (MaxSpeed)",
            "length/time",
            low=0,
            symbol=r"v_{\max}",
        ),
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
"""Values that are widely used with the pseudocode; the publication gives no values.

The numbers of boids and steps and the start are choices of boidsweep. There is no
program of the authors, so as_run equals as_written.
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
    divides by zero. Here a boid at rest stays at rest until a rule moves the boid.

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
    equations=r"""
In each step, the rules change the velocity $v_i$ of boid $i$ in the order below. Each
rule acts on the velocity that the previous rule left. Names in parentheses are those of
the pseudocode.

**Neighbours:** $P_i$ are the other boids nearer than $r_p$ (ProtectedRange), in any
direction. $V_i$ are the other boids nearer than $r_v$ (VisualRange). A boid exactly at
a range does not count. With `protected_count_once`, as in the pseudocode, $V_i$ does
not include the boids in $P_i$.

**Cohesion** (CenteringFactor) steers to the mean position:

$$v_i \leftarrow v_i + w_c\,\Delta t
\left( \frac{1}{|V_i|} \sum_{j \in V_i} p_j - p_i \right)$$

**Alignment** (MatchingFactor) approaches the mean velocity. The bracket has the
velocity after cohesion:

$$v_i \leftarrow v_i + w_a\,\Delta t
\left( \frac{1}{|V_i|} \sum_{j \in V_i} v_j - v_i \right)$$

Cohesion and alignment change nothing if $V_i$ is empty.

**Separation** (AvoidFactor) steers away from near boids:

$$v_i \leftarrow v_i + w_s\,\Delta t \sum_{j \in P_i} (p_i - p_j)$$

**Borders** (TurnFactor, ScreenMargins) turn boids back. $W$ is the width of the world.
The first case that holds counts:

$$v_{i,x} \leftarrow v_{i,x} + b_{i,x}\,\tau\,\Delta t, \qquad
b_{i,x} = \begin{cases}
1 & x_i < m \\
-1 & x_i > W - m \\
0 & \mathrm{otherwise}
\end{cases}$$

The $y$ component follows the same equations, with the height of the world. The borders
act beyond the edge of the world, too.

**Speed limits** (MinSpeed, MaxSpeed) scale the velocity:

$$v_i \leftarrow \begin{cases}
v_{\max}\,v_i / |v_i| & |v_i| > v_{\max} \\
v_{\min}\,v_i / |v_i| & 0 < |v_i| < v_{\min} \\
v_i & \mathrm{otherwise}
\end{cases}$$

A velocity of zero stays zero, where the pseudocode divides by zero.

**Move:** The boid then moves. The pseudocode has $\Delta t = 1$:

$$p_i \leftarrow p_i + v_i\,\Delta t$$

**Update:** With `update: sequential`, as in the pseudocode, boids move in turn. Later
boids perceive the new states of earlier boids. With `update: synchronous`, all boids
react to the state before the step. The model has no noise.
""",
)
