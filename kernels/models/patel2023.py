"""Rovers that flock among rocks inside an arena (Patel 2023)."""

from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import clamp_speed
from kernels.jit import jit
from kernels.model import NARROW_POTENTIAL, Model, PairPotential, Sight
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import is_measured, others_of, own_of, publish
from kernels.rules.borders import confine, turn_back
from kernels.rules.obstacles import repulsion_linear
from kernels.rules.social import alignment_from, cohesion, separation_linear
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

ALWAYS, IN_MARGIN, NEVER = 0, 1, 2


class Params(NamedTuple):
    """Parameters of Table I; lengths in pixels, ten per metre."""

    separation_weight: Annotated[
        float,
        About(
            "weight of the separation rule (Eq. 6)",
            "1/time^2",
            low=0,
            rule="separation",
            symbol="a",
        ),
    ]
    alignment_weight: Annotated[
        float,
        About(
            "weight of the alignment rule (Eq. 11)",
            "1/time",
            low=0,
            rule="alignment",
            symbol="b",
        ),
    ]
    cohesion_weight: Annotated[
        float,
        About(
            "weight of the cohesion rule (Eq. 16)",
            "1/time^2",
            low=0,
            rule="cohesion",
            symbol="c",
        ),
    ]
    obstacle_weight: Annotated[
        float,
        About(
            "weight of the repulsion from obstacles (Eq. 25)",
            "1/time^2",
            low=0,
            rule="obstacle",
            symbol="d",
        ),
    ]
    separation_range: Annotated[
        float,
        About(
            "range of the separation rule (Eq. 5)",
            "length",
            low=0,
            symbol=r"R_{\mathrm{separation}}",
        ),
    ]
    alignment_range: Annotated[
        float,
        About(
            "range of the alignment rule (Eq. 8)",
            "length",
            low=0,
            symbol=r"R_{\mathrm{alignment}}",
        ),
    ]
    cohesion_range: Annotated[
        float,
        About(
            "range of the cohesion rule (Eq. 13)",
            "length",
            low=0,
            symbol=r"R_{\mathrm{cohesion}}",
        ),
    ]
    obstacle_range: Annotated[
        float,
        About(
            "reach of an obstacle beyond its surface (Eq. 24)",
            "length",
            low=0,
            symbol=r"R_{\mathrm{obstacle}}",
        ),
    ]
    border_margin: Annotated[
        float,
        About(
            "distance from a border below which boids turn back",
            "length",
            low=0,
            symbol="M",
        ),
    ]
    border_turn: Annotated[
        float,
        About(
            "acceleration away from a near border (Eqs. 18 and 19)",
            "length/time^2",
            low=0,
            symbol=r"T_{\mathrm{border}}",
        ),
    ]
    border_adds_velocity: Annotated[
        int,
        About(
            "where the border rule, besides the turn, adds a component of the velocity"
            " to itself (Eqs. 18 to 21)",
            choices=("always", "in_margin", "never"),
        ),
    ]
    min_speed: Annotated[
        float,
        About(
            "lower limit of the speed (Eq. 22)",
            "length/time",
            low=0,
            symbol=r"V_{\min}",
        ),
    ]
    max_speed: Annotated[
        float,
        About(
            "upper limit of the speed (Eq. 22)",
            "length/time",
            low=0,
            symbol=r"V_{\max}",
        ),
    ]
    range_inclusive: Annotated[
        bool, About("whether a neighbour exactly at the range counts")
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP, InParts("time")]


AS_WRITTEN = COMMON | {
    "separation_weight": 0.15,
    "alignment_weight": 0.1,
    "cohesion_weight": 0.005,
    "obstacle_weight": 0.25,
    "separation_range": 50.0,
    "alignment_range": 80.0,
    "cohesion_range": 80.0,
    "obstacle_range": 60.0,
    "border_margin": 175.0,
    "border_turn": 10.0,
    "border_adds_velocity": "in_margin",
    "min_speed": 7.0,
    "max_speed": 10.0,
    "range_inclusive": False,
    "update": "sequential",
    "n": 10,
    "steps": 500,
    "dt": 1.0,
    "map": "random_obstacles",
    "width": 1200.0,
    "height": 1200.0,
    "n_obstacles": 5,
    "obstacle_radius": 0.0,
    "start_velocities": "components",
    "start_speed": 10.0,
    "start_margin": 100.0,
    "start_free": False,
    "flock_range": 80.0,
}
"""The world is the window; the arena is at least 100 px from the borders.

Rocks are points. The publication gives neither the frame rate nor the length of a
trial; 500 steps are a choice of boidsweep.
"""
AS_RUN = AS_WRITTEN | {"border_adds_velocity": "always"}
AS_INTENDED = AS_WRITTEN | {"border_adds_velocity": "never"}
"""The border rule without the velocity: T alone turns a rover back.

In the publication the border rule gives V + T or V - T, Eqs. (18) and (19). Eq. (21)
adds the result to V, so a component of the velocity doubles in a margin. The program
gives V outside margins, so every component doubles in every step there. The authors
probably intended neither version.
"""


NO_BORDERS = {"border_turn": 0.0, "border_adds_velocity": "never"}


def sight(params: Params) -> Sight:
    """Return a view all round, up to the longest of the three ranges, px."""
    ranges = params.separation_range, params.alignment_range, params.cohesion_range
    return Sight(max(ranges), inclusive=params.range_inclusive)


def _obstacle_reach(params: Params) -> float:
    return params.obstacle_range


def _pair_potential(params: Params) -> PairPotential:
    separation = (params.separation_weight, params.separation_range)
    return PairPotential(
        *separation, params.cohesion_weight, params.cohesion_range, False
    )


@jit
def _move(moved: Flock, world: World, params: Params, i: int) -> None:
    """Move boid `i` of `moved` at a speed within the limits: Eqs. (22) and (2)."""
    vx, vy = clamp_speed(moved.vx[i], moved.vy[i], params.min_speed, params.max_speed)
    moved.x[i], moved.vx[i] = confine(
        moved.x[i] + vx * params.dt, vx, world.width, world.borders
    )
    moved.y[i], moved.vy[i] = confine(
        moved.y[i] + vy * params.dt, vy, world.height, world.borders
    )


@jit
def _border(params: Params, position: float, velocity: float, length: float) -> float:
    """Return one component of V_border, Eqs. (18) and (19).

    `border_adds_velocity` selects the version of the publication, of the program or of
    the probable intention.
    """
    back = turn_back(position, length, params.border_margin)
    adds = params.border_adds_velocity
    added = velocity if adds == ALWAYS or (adds == IN_MARGIN and back != 0.0) else 0.0
    return back * params.border_turn + added


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

    Each of the five rules acts on the result of the rule before.
    """
    near, dt = work.near, params.dt
    x, y = separation_linear(
        near, found, square_range(params.separation_range, params.range_inclusive)
    )
    weight = params.separation_weight * dt
    vx, vy = own.vx[i] + weight * x, own.vy[i] + weight * y
    x, y = alignment_from(
        vx,
        vy,
        others,
        near,
        found,
        square_range(params.alignment_range, params.range_inclusive),
    )
    weight = params.alignment_weight * dt
    vx, vy = vx + weight * x, vy + weight * y
    x, y = cohesion(
        near, found, square_range(params.cohesion_range, params.range_inclusive)
    )
    weight = params.cohesion_weight * dt
    vx, vy = vx + weight * x, vy + weight * y
    vx += _border(params, own.x[i], vx, world.width) * dt
    vy += _border(params, own.y[i], vy, world.height) * dt
    x, y = repulsion_linear(
        world, work.reach, params.obstacle_range, own.x[i], own.y[i]
    )
    weight = params.obstacle_weight * dt
    return vx + weight * x, vy + weight * y


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

    p += v dt, then v += dt times the sum of the rules at the new position. In a
    synchronous update all boids move before any boid perceives. The velocity at the end
    of a step is limited only at the beginning of the next step. So recorded velocities
    exceed the moves: in as_run about 21 px per step, while moves are 10 px. With
    sensing or communication, boids know all positions, also their own, from before the
    move.

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
    moved = flock if sequential or is_measured(work) else work.before
    own = own_of(moved, work)
    for _ in range(steps):
        publish(flock, others, work)
        if not sequential:
            for i in range(flock.x.size):
                _move(moved, world, params_of(params, work, i), i)
            move_all(work.grid, moved)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            crowd, along = robot.separation_range, robot.alignment_range
            range2 = square_range(max(crowd, along, robot.cohesion_range), True)
            if sequential:
                _move(moved, world, robot, i)
                move(work.grid, i, moved.x[i], moved.y[i])
            found = search(
                others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            vx, vy = _new_velocity(robot, others, own, world, i, work, found)
            vx, vy = drive(work, i, moved.vx[i], moved.vy[i], vx, vy)
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = (
                moved.x[i],
                moved.y[i],
                vx,
                vy,
            )
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="patel2023",
    source=(
        "S. Patel (2023), Pattern formation: investigating boids algorithm for"
        " multi-robot systems"
    ),
    params=Params,
    presets={"as_written": AS_WRITTEN, "as_run": AS_RUN, "as_intended": AS_INTENDED},
    metrics=(
        "speed",
        "polarization",
        "flock_count",
        "largest_flock",
        "potential",
        "flock_potential",
        "equilibrium",
        "collisions",
        "boid_collisions",
        "escapes",
    ),
    sight=sight,
    advance=advance,
    obstacle_reach=_obstacle_reach,
    pair_potential=_pair_potential,
    symmetries={
        "translation": NO_BORDERS,
        "rotation": NO_BORDERS,
        "quarter_turn": {},
        "reflection": {},
        "permutation": {},
    },
    demands=(SPEEDS,),
    potential_demands=(Demand("separation_range <= cohesion_range", NARROW_POTENTIAL),),
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
    equations=r"""
In each step, boid $i$ with position $P_i$ and velocity $V_i$ first clamps the speed and
moves (Eqs. 22, 23 and 2):

$$V_i \leftarrow \begin{cases}
V_{\max}\,V_i / |V_i| & |V_i| > V_{\max} \\
V_{\min}\,V_i / |V_i| & 0 < |V_i| < V_{\min} \\
V_i & \mathrm{otherwise}
\end{cases}$$

$$P_i \leftarrow P_i + V_i\,\Delta t$$

Five rules then change the velocity at the new position, in the order below. Each rule
acts on the velocity that the previous rule left. The speed after the rules is limited
only in the next step, so recorded speeds can exceed $V_{\max}$. A velocity of zero
stays zero. The paper has $\Delta t = 1$.

**Neighbours** are the other boids nearer than the range of the rule, in any direction.
With `range_inclusive`, a boid exactly at the range counts. $X_s$, $X_a$ and $X_c$ are
the neighbours within $R_{\mathrm{separation}}$, $R_{\mathrm{alignment}}$ and
$R_{\mathrm{cohesion}}$ (Eqs. 5, 8 and 13).

**Separation** (Eqs. 6 and 7) steers away from near boids:

$$V_i \leftarrow V_i + a\,\Delta t \sum_{j \in X_s} (P_i - P_j)$$

**Alignment** (Eqs. 9 to 12) approaches the mean velocity:

$$V_i \leftarrow V_i + b\,\Delta t
\left( \frac{1}{|X_a|} \sum_{j \in X_a} V_j - V_i \right)$$

**Cohesion** (Eqs. 14 to 17) steers to the mean position:

$$V_i \leftarrow V_i + c\,\Delta t
\left( \frac{1}{|X_c|} \sum_{j \in X_c} P_j - P_i \right)$$

Alignment and cohesion change nothing without neighbours.

**Borders** (Eqs. 18 to 21) turn boids back. $W$ is the width of the world. The first
case that holds counts:

$$V_{i,x} \leftarrow V_{i,x} +
\left( \beta\,T_{\mathrm{border}} + \eta\,V_{i,x} \right) \Delta t, \qquad
\beta = \begin{cases}
1 & P_{i,x} < M \\
-1 & P_{i,x} > W - M \\
0 & \mathrm{otherwise}
\end{cases}$$

The $y$ component follows the same equations, with the height of the world. The
parameter `border_adds_velocity` sets $\eta$:

- `in_margin`: $\eta = 1$ where $\beta$ is not 0, otherwise $\eta = 0$. The equations of
  the paper say this, and the preset is `as_written`.
- `always`: $\eta = 1$. The program of the author does this, and the preset is `as_run`.
- `never`: $\eta = 0$. Only the turn remains, and the preset is `as_intended`.

**Obstacles** (Eqs. 24 to 26) repel boids. $Z$ are the obstacles whose surface is nearer
than $R_{\mathrm{obstacle}}$:

$$V_i \leftarrow V_i + d\,\Delta t \sum_{o \in Z} (P_i - P_o)$$

$P_o$ is the centre of obstacle $o$. For a polygon, $P_o$ is the nearest point of the
border, and inside the polygon the vector $P_i - P_o$ is reversed. A rectangle counts as
a disc with its larger half-width as radius. The paper has obstacles without a radius.

**Update:** With `update: sequential`, each boid moves and applies the rules before the
next boid moves. With `update: synchronous`, all boids move first. All boids then react
to these positions and limited velocities. The model has no noise.
""",
)
