"""Coverage by boids with a prioritised acceleration budget (Aziel and Chen 2025)."""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import limit, serve
from kernels.goals import goal_of
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import cone, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.rules.obstacles import repulsion_inverse, wall_repulsion
from kernels.rules.social import flocking_sums
from kernels.settings import (
    COMMON,
    SEQUENTIAL,
    TIME_STEP,
    UPDATE,
    About,
    InParts,
)
from kernels.state import Flock, World
from kernels.workspace import Workspace

OBSTACLE_FIRST, SEPARATION_FIRST = 0, 1


class Params(NamedTuple):
    """Gains, perception and limits of sections 2 and 3.4."""

    separation_weight: Annotated[
        float,
        About(
            "weight of the separation rule",
            "1/time^2",
            low=0,
            rule="separation",
            symbol=r"k_{\mathrm{col}}",
        ),
    ]
    alignment_weight: Annotated[
        float,
        About(
            "weight of the alignment rule",
            "1/time",
            low=0,
            rule="alignment",
            symbol=r"k_{\mathrm{ali}}",
        ),
    ]
    cohesion_weight: Annotated[
        float,
        About(
            "weight of the cohesion rule",
            "1/time^2",
            low=0,
            rule="cohesion",
            symbol=r"k_{\mathrm{coh}}",
        ),
    ]
    obstacle_weight: Annotated[
        float,
        About(
            "weight of the repulsion from obstacles",
            "length^2/time^2",
            low=0,
            rule="obstacle",
            symbol=r"k_{\mathrm{obs}}",
        ),
    ]
    wall_weight: Annotated[
        float,
        About(
            "weight of the repulsion from the walls of the world",
            "length^2/time^2",
            low=0,
            rule="wall",
            symbol=r"k_{\mathrm{wall}}",
        ),
    ]
    goal_weight: Annotated[
        float,
        About(
            "weight of the attraction to the goal",
            "1/time^2",
            low=0,
            rule="goal",
            to_goal=True,
            symbol=r"k_{\mathrm{goal}}",
        ),
    ]
    perception_range: Annotated[
        float,
        About(
            "distance up to which a boid perceives others", "length", low=0, symbol="R"
        ),
    ]
    fov: Annotated[
        float,
        About(
            "field of view, the full angle of the cone about the velocity",
            "degrees",
            low=0,
            high=360,
            symbol=r"\varphi",
        ),
    ]
    separation_range: Annotated[
        float,
        About(
            "range of the separation rule among perceived boids",
            "length",
            low=0,
            symbol="r_s",
        ),
    ]
    obstacle_range: Annotated[
        float,
        About(
            "reach of an obstacle beyond its surface", "length", low=0, symbol=r"\rho"
        ),
    ]
    epsilon: Annotated[
        float,
        About(
            "length that is added to distances in the obstacle and wall forces",
            "length",
            low=0,
            symbol=r"\varepsilon",
        ),
    ]
    max_acceleration: Annotated[
        float,
        About(
            "acceleration budget that all forces share",
            "length/time^2",
            low=0,
            symbol=r"a_{\max}",
        ),
    ]
    max_speed: Annotated[
        float,
        About("upper limit of the speed", "length/time", low=0, symbol=r"v_{\max}"),
    ]
    priority: Annotated[
        int,
        About(
            "order of the first two forces, obstacle and separation; wall, alignment,"
            " cohesion and goal follow",
            choices=("obstacle_first", "separation_first"),
        ),
    ]
    walls_are_obstacles: Annotated[
        bool,
        About("whether wall and obstacle forces are summed and served as one force"),
    ]
    range_inclusive: Annotated[
        bool, About("whether a neighbour exactly at the range counts")
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP, InParts("time")]


AS_WRITTEN = COMMON | {
    "separation_weight": 0.003,
    "alignment_weight": 0.003,
    "cohesion_weight": 0.213,
    "obstacle_weight": 1.0,
    "wall_weight": 10.0,
    "goal_weight": 0.0,
    "perception_range": 50.0,
    "fov": 150.0,
    "separation_range": 50.0,
    "obstacle_range": math.inf,
    "epsilon": 1e-10,
    "max_acceleration": 0.5,
    "max_speed": 5.0,
    "priority": "obstacle_first",
    "walls_are_obstacles": True,
    "range_inclusive": True,
    "update": "synchronous",
    "n": 100,
    "steps": 3600,
    "dt": 1.0,
    "map": "cafeteria",
    "width": 800.0,
    "height": 600.0,
    "start_speed": 5.0,
    "goal_x": 400.0,
    "goal_y": 300.0,
}
AS_RUN = AS_WRITTEN | {
    "obstacle_weight": 500.0,
    "separation_range": 20.0,
    "obstacle_range": 40.0,
    "priority": "separation_first",
    "walls_are_obstacles": False,
    "range_inclusive": False,
    "update": "sequential",
    "start_margin": 50.0,
    "start_draws": "python_random",
    "footprint": "stamp",
    "coverage_cv_ddof": 1,
}


def sight(params: Params) -> Sight:
    """Return a view up to the perception range, px, within the field of view."""
    return Sight(params.perception_range, params.fov, params.range_inclusive)


def _obstacle_reach(params: Params) -> float:
    return params.obstacle_range


@jit
def _obstacle_and_wall(
    params: Params, world: World, work: Workspace, x: float, y: float
) -> tuple[float, float, float, float]:
    """Return the obstacle force and the wall force at (x, y).

    If walls are obstacles, the first force is the sum of the two forces, and the second
    force is zero.
    """
    obstacle_x, obstacle_y = repulsion_inverse(
        world, work.reach, params.obstacle_range, params.epsilon, x, y
    )
    obstacle_x, obstacle_y = (
        params.obstacle_weight * obstacle_x,
        params.obstacle_weight * obstacle_y,
    )
    wall_x = params.wall_weight * wall_repulsion(x, world.width, params.epsilon)
    wall_y = params.wall_weight * wall_repulsion(y, world.height, params.epsilon)
    if params.walls_are_obstacles:
        return obstacle_x + wall_x, obstacle_y + wall_y, 0.0, 0.0
    return obstacle_x, obstacle_y, wall_x, wall_y


@jit
def _acceleration(
    params: Params,
    others: Flock,
    own: Flock,
    world: World,
    i: int,
    work: Workspace,
    found: int,
) -> tuple[float, float]:
    """Return the sum of the forces on boid `i`, served in order of priority.

    Each force gets the rest of the budget `max_acceleration` after earlier forces.
    """
    x, y = own.x[i], own.y[i]
    range2 = square_range(params.separation_range, params.range_inclusive)
    crowd_x, crowd_y, to_x, to_y, sum_vx, sum_vy = flocking_sums(
        others, work.near, found, range2
    )
    first_x, first_y = (
        -params.separation_weight * crowd_x,
        -params.separation_weight * crowd_y,
    )
    second_x, second_y, wall_x, wall_y = _obstacle_and_wall(params, world, work, x, y)
    if params.priority == OBSTACLE_FIRST:
        first_x, first_y, second_x, second_y = second_x, second_y, first_x, first_y
    ax, ay, left = serve(0.0, 0.0, first_x, first_y, params.max_acceleration)
    ax, ay, left = serve(ax, ay, second_x, second_y, left)
    ax, ay, left = serve(ax, ay, wall_x, wall_y, left)
    if found > 0:
        share = 1.0 / found
        weight = params.alignment_weight
        ax, ay, left = serve(
            ax,
            ay,
            weight * (sum_vx * share - own.vx[i]),
            weight * (sum_vy * share - own.vy[i]),
            left,
        )
        weight = params.cohesion_weight
        ax, ay, left = serve(
            ax, ay, weight * (to_x * share), weight * (to_y * share), left
        )
    if params.goal_weight > 0.0:
        weight = params.goal_weight
        goal_x, goal_y = goal_of(world, work.goals, i)
        ax, ay, left = serve(ax, ay, weight * (goal_x - x), weight * (goal_y - y), left)
    return ax, ay


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

    v += a dt, limited to max_speed; p += v dt.

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
            range2 = square_range(robot.perception_range, robot.range_inclusive)
            view = cone(robot.fov)
            found = search(
                others,
                world,
                work.grid,
                i,
                range2,
                view,
                own.vx[i],
                own.vy[i],
                work.near,
            )
            ax, ay = _acceleration(robot, others, own, world, i, work, found)
            vx, vy = limit(
                flock.vx[i] + ax * params.dt,
                flock.vy[i] + ay * params.dt,
                robot.max_speed,
            )
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
    name="aziel_chen2025",
    source=(
        "B. Aziel and J. Chen (2025), Performance analysis of the boids algorithm in"
        " coverage scenarios"
    ),
    params=Params,
    presets={"as_written": AS_WRITTEN, "as_run": AS_RUN},
    metrics=("coverage", "coverage_total", "coverage_cv", "escapes", "collisions"),
    sight=sight,
    advance=advance,
    obstacle_reach=_obstacle_reach,
    symmetries={
        "translation": {"wall_weight": 0.0, "goal_weight": 0.0},
        "rotation": {"wall_weight": 0.0},
        "quarter_turn": {},
        "reflection": {},
        "permutation": {},
    },
    publishes=True,
    drives=True,
    goals_in_turn=True,
    shared=("dt",),
    equations=r"""
In each step, boid $i$ with position $p_i$ and velocity $v_i$ accelerates and moves:

$$v_i \leftarrow L(v_i + a_i\,\Delta t,\,v_{\max}), \qquad
p_i \leftarrow p_i + v_i\,\Delta t$$

$L$ limits the length of a vector:

$$L(f, c) = f\,\min\left(1, \frac{c}{|f|}\right)$$

**Neighbours** $N_i$ are the other boids within $R$ of boid $i$ and within a cone about
$v_i$. The cone has the full angle $\varphi$, edge included. A boid at rest perceives
others all round. With `range_inclusive`, a boid exactly at a range counts. The
equations of the paper (section 2) have no numbers.

**Separation** points away from near neighbours. $S_i$ are the neighbours within $r_s$:

$$f_{\mathrm{col}} = k_{\mathrm{col}} \sum_{j \in S_i} (p_i - p_j)$$

**Alignment** is the difference from the mean velocity, and zero without neighbours:

$$f_{\mathrm{ali}} = k_{\mathrm{ali}}
\left( \frac{1}{|N_i|} \sum_{j \in N_i} v_j - v_i \right)$$

**Cohesion** points to the mean position, and is zero without neighbours:

$$f_{\mathrm{coh}} = k_{\mathrm{coh}}
\left( \frac{1}{|N_i|} \sum_{j \in N_i} p_j - p_i \right)$$

**Obstacles** repel boids. $O_i$ are the obstacles whose surface is nearer than $\rho$:

$$f_{\mathrm{obs}} = k_{\mathrm{obs}} \sum_{m \in O_i}
\frac{p_i - o_m}{|p_i - o_m|\,(|p_i - o_m| + \varepsilon)}$$

$o_m$ is the centre of obstacle $m$. For a polygon, $o_m$ is the nearest point of the
border, and inside the polygon the vector $p_i - o_m$ is reversed. A rectangle counts as
a disc with its larger half-width as radius. The paper has no $k_{\mathrm{obs}}$, and
the denominator $(|p_i - o_m| + \varepsilon)^2$. For small $\varepsilon$ both
denominators agree.

**Walls** repel boids. $W$ is the width of the world. The $y$ component has the height:

$$f_{\mathrm{wall}, x} = k_{\mathrm{wall}}
\left( \frac{1}{x_i + \varepsilon} - \frac{1}{W - x_i + \varepsilon} \right)$$

Outside the world, the wall force points outwards.

**Goal** $g_i$ attracts boid $i$. The paper has no equation for this force:

$$f_{\mathrm{goal}} = k_{\mathrm{goal}} (g_i - p_i)$$

**Priority:** The budget is $B = a_{\max}$ at first, and $a_i = 0$. Each force $f$ in
turn gets a part of the budget:

$$a_i \leftarrow a_i + L(f, B), \qquad B \leftarrow \max(0, B - |f|)$$

With `priority: obstacle_first`, the order is obstacles, separation, walls, alignment,
cohesion and goal. With `priority: separation_first`, separation precedes obstacles.
With `walls_are_obstacles`, the sum of wall and obstacle forces takes the place of the
obstacle force. The preset `as_written` serves obstacles with walls first, then
separation. The preset `as_run` serves separation, obstacles and walls in this order. In
`as_run`, $r_s$ is shorter than $R$, and $\rho$ is finite. In the paper, $r_s$ equals
$R$, and $\rho$ is infinite.

**Update:** With `update: synchronous`, all boids react to the state before the step.
With `update: sequential`, boids move in turn, and later boids perceive the new states
of earlier boids. The model has no noise.
""",
)
