"""Robots that flock to a goal and steer round obstacles.

The source is Rustamani et al. (2024).
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import add_in_turn, limit, limit_components
from kernels.events import DEAD_ENDS
from kernels.goals import goal_of
from kernels.jit import jit
from kernels.model import MOST_CELLS, Model, OccupancySettings, Sight
from kernels.neighbours import cone, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.avoidance import steer_to_avoid
from kernels.rules.borders import confine
from kernels.rules.social import alignment_from, cohesion, separation_direction
from kernels.rules.steering import arrival, seek
from kernels.settings import (
    COMMON,
    SEQUENTIAL,
    TIME_STEP,
    UPDATE,
    About,
    Demand,
    InParts,
)
from kernels.state import Flock, World
from kernels.workspace import Workspace

SAFETY_FIRST, FLOCKING_FIRST = 0, 1


class Params(NamedTuple):
    """Weights, gains, perception, limits and the occupancy grid of section 2."""

    obstacle_weight: Annotated[
        float,
        About(
            "weight of the obstacle avoidance (Algorithm 7)",
            "length/time^2",
            low=0,
            rule="obstacle",
            symbol=r"w_{\mathrm{obs}}",
        ),
    ]
    separation_weight: Annotated[
        float,
        About(
            "weight of the separation rule (Algorithm 2)",
            "length/time^2",
            low=0,
            rule="separation",
            symbol=r"w_{\mathrm{sep}}",
        ),
    ]
    arrival_weight: Annotated[
        float,
        About(
            "weight of the arrival at the goal (Algorithm 6)",
            "1/time",
            low=0,
            rule="arrival",
            to_goal=True,
            symbol=r"w_{\mathrm{arr}}",
        ),
    ]
    seek_weight: Annotated[
        float,
        About(
            "weight of the seek rule, the steering towards the goal (Algorithm 5)",
            "1/time",
            low=0,
            rule="seek",
            to_goal=True,
            symbol=r"w_{\mathrm{seek}}",
        ),
    ]
    alignment_weight: Annotated[
        float,
        About(
            "weight of the alignment rule (Algorithm 3)",
            "1/time",
            low=0,
            rule="alignment",
            symbol=r"w_{\mathrm{ali}}",
        ),
    ]
    cohesion_weight: Annotated[
        float,
        About(
            "weight of the cohesion rule (Algorithm 4)",
            "1/time^2",
            low=0,
            rule="cohesion",
            symbol=r"w_{\mathrm{coh}}",
        ),
    ]
    priority: Annotated[
        int,
        About(
            "order in which the rules are added (Table 1). safety_first: obstacle,"
            " separation, arrival, seek, alignment, cohesion; flocking_first: cohesion,"
            " alignment, arrival, seek, obstacle, separation",
            choices=("safety_first", "flocking_first"),
        ),
    ]
    alignment_gain: Annotated[
        float,
        About(
            "gain of the alignment rule, a factor besides alignment_weight",
            low=0,
            symbol=r"k_{\mathrm{ali}}",
        ),
    ]
    navigation_gain: Annotated[
        float,
        About(
            "desired speed of the seek rule per distance from the goal (Algorithm 5)",
            "1/time",
            low=0,
            symbol=r"k_{\mathrm{nav}}",
        ),
    ]
    arrival_gain: Annotated[
        float,
        About(
            "ratio of the desired speed of the arrival rule to max_speed",
            low=0,
            symbol=r"k_{\mathrm{arr}}",
        ),
    ]
    arrival_limited: Annotated[
        bool,
        About("whether max_acceleration limits the arrival rule, like the seek rule"),
    ]
    stop_distance: Annotated[
        float,
        About(
            "distance from the goal below which the arrival rule is zero (Algorithm 6)",
            "length",
            low=0,
            symbol=r"r_{\mathrm{stop}}",
        ),
    ]
    slow_distance: Annotated[
        float,
        About(
            "distance from the goal below which the arrival rule slows boids down"
            " (Algorithm 6)",
            "length",
            low=0,
            exclusive=True,
            symbol=r"r_{\mathrm{slow}}",
        ),
    ]
    leader_share: Annotated[
        float,
        About(
            "fraction of leaders, the first boids, which alone know the goal; the"
            " number is rounded",
            low=0,
            high=1,
            symbol=r"\lambda",
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
            "field of view, the full angle of the cone about the heading",
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
    range_inclusive: Annotated[
        bool, About("whether a neighbour exactly at the range counts")
    ]
    look_ahead: Annotated[
        float,
        About(
            "length of the path ahead that obstacle avoidance checks (Algorithm 7)",
            "length",
            low=0,
            high=1e6,
            symbol=r"\ell",
        ),
    ]
    path_step: Annotated[
        float,
        About(
            "distance between the points checked on a path (Algorithm 8)",
            "length",
            low=1e-3,
            symbol=r"\delta",
        ),
    ]
    angle_step: Annotated[
        float,
        About(
            "angle between headings that obstacle avoidance tries (Algorithm 7)",
            "radians",
            low=1e-3,
            symbol=r"\alpha",
        ),
    ]
    grid_cell: Annotated[
        float,
        About(
            "side of a cell of the occupancy grid",
            "length",
            low=0,
            exclusive=True,
            symbol="s",
        ),
    ]
    inflation: Annotated[
        float,
        About(
            "distance from an obstacle below which a cell of the grid is occupied",
            "length",
            low=0,
            symbol="b",
        ),
    ]
    acceleration_pool: Annotated[
        float,
        About(
            "length of the summed acceleration above which no further rule is added"
            " (Algorithm 9)",
            "length/time^2",
            low=0,
            symbol=r"a_{\mathrm{pool}}",
        ),
    ]
    max_acceleration: Annotated[
        float,
        About(
            "upper limit of the acceleration (Algorithm 9)",
            "length/time^2",
            low=0,
            symbol=r"a_{\max}",
        ),
    ]
    max_speed: Annotated[
        float,
        About("upper limit of the speed", "length/time", low=0, symbol=r"v_{\max}"),
    ]
    component_limits: Annotated[
        bool,
        About(
            "whether max_speed and max_acceleration limit each component instead of the"
            " length"
        ),
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP, InParts("time")]


AS_WRITTEN = COMMON | {
    "obstacle_weight": 1.0,
    "separation_weight": 1.0,
    "arrival_weight": 1.0,
    "seek_weight": 1.0,
    "alignment_weight": 1.0,
    "cohesion_weight": 1.0,
    "priority": "safety_first",
    "alignment_gain": 1.0,
    "navigation_gain": 0.8,
    "arrival_gain": 1.0,
    "arrival_limited": True,
    "stop_distance": 0.05,
    "slow_distance": 0.05,
    "leader_share": 1.0,
    "perception_range": 2.4,
    "fov": 360.0,
    "separation_range": math.inf,
    "range_inclusive": False,
    "look_ahead": 0.8,
    "path_step": 0.16,
    "angle_step": 0.5,
    "grid_cell": 0.05,
    "inflation": 0.2,
    "acceleration_pool": 10.0,
    "max_acceleration": 10.0,
    "max_speed": 0.8,
    "component_limits": False,
    "update": "synchronous",
    "n": 10,
    "steps": 600,
    "dt": 0.1,
    "map": "arena",
    "width": 10.0,
    "height": 10.0,
    "obstacle_radius": 0.5,
    "obstacle_margin": 1.0,
    "goal_x": 9.0,
    "goal_y": 9.0,
    "goal_radius": 1.0,
    "start_speed": 0.4,
    "start_margin": 0.5,
    "flock_range": 2.4,
    "contact_distance": 0.1,
    "pixel": 0.05,
}
"""The algorithms of the publication, with weights of 1.

The publication has one tolerance for stopping and slowing, without a value. Here the
value is the tolerance for stopping in the program. The publication gives no weights, so
all weights are 1, and no author ran this preset. The joint effect of the algorithms
depends on the weights, so this preset shows the effect of each algorithm alone. The
publication does not state the start. Boids start uniformly in the arena with half the
speed, a choice of boidsweep. Every robot is a separate process that reacts to the last
published states of all robots, so the update is synchronous.
"""
AS_RUN = AS_WRITTEN | {
    "obstacle_weight": 6.6,
    "separation_weight": 1.8,
    "arrival_weight": 1.5,
    "seek_weight": 0.4,
    "alignment_weight": 1.4,
    "cohesion_weight": 0.5,
    "alignment_gain": 3.0,
    "arrival_gain": 0.3,
    "arrival_limited": False,
    "slow_distance": 1.0,
    "leader_share": 0.5,
    "perception_range": 1.2,
    "flock_range": 1.2,
    "separation_range": 0.35,
    "acceleration_pool": 6.65,
    "component_limits": True,
}
"""Last version of the program of the authors."""
AS_REPORTED = AS_RUN | {
    "obstacle_weight": 6.3,
    "separation_weight": 1.5,
    "seek_weight": 0.5,
    "leader_share": 0.3,
    "fov": 360.0 / 1.4,
    "acceleration_pool": 6.5,
}
"""Version of the program of the authors at the time of the publication."""


def sight(params: Params) -> Sight:
    """Return a view up to the perception range, m, within the field of view."""
    return Sight(params.perception_range, params.fov, params.range_inclusive)


def _occupancy(params: Params) -> OccupancySettings:
    return OccupancySettings(params.grid_cell, params.inflation)


@jit
def _leaders(params: Params, n: int) -> int:
    """Return the number of leaders, the first of `n` boids, which know the goal."""
    return math.floor(params.leader_share * n + 0.5)


MOST_LOOKS = 10**6
"""Most positions on all paths that one boid checks per step; published: about 60."""
DEMANDS = (
    Demand(
        f"ceil(width / grid_cell) * ceil(height / grid_cell) <= {MOST_CELLS}",
        f"the occupancy grid would have more than {MOST_CELLS:,} cells",
    ),
    Demand(
        "obstacle_weight == 0 or 2 * path_step <= look_ahead",
        "no point of a path is looked at: look_ahead must be at least twice path_step",
    ),
    Demand(
        f"obstacle_weight == 0 or angle_step <= {math.pi}",
        "no other heading is looked at: angle_step must be at most pi",
    ),
    Demand(
        f"obstacle_weight == 0 or {2 * math.pi} * look_ahead <= {MOST_LOOKS} *"
        " angle_step * path_step",
        f"more than {MOST_LOOKS:,} places would be looked at by each boid: angle_step"
        " or path_step is too small, or look_ahead too large",
    ),
)


@jit
def _limited(params: Params, x: float, y: float, most: float) -> tuple[float, float]:
    """Return the vector (x, y) limited to `most`.

    With `component_limits` each component is limited, otherwise the length.
    """
    return (
        limit_components(x, y, most) if params.component_limits else limit(x, y, most)
    )


@jit
def _avoidance(
    params: Params, own: Flock, i: int, work: Workspace, record: Record
) -> tuple[float, float]:
    """Return the weighted steering of boid `i` round obstacles.

    A dead end is counted in the events of `record`.
    """
    ahead, step, turn = params.look_ahead, params.path_step, params.angle_step
    x, y, is_dead_end = steer_to_avoid(
        work.occupancy, own.x[i], own.y[i], own.vx[i], own.vy[i], ahead, step, turn
    )
    record.watch.events[DEAD_ENDS] += int(is_dead_end)
    return params.obstacle_weight * x, params.obstacle_weight * y


@jit
def _flocking(
    params: Params, others: Flock, own: Flock, i: int, work: Workspace, found: int
) -> tuple[tuple[float, float], tuple[float, float], tuple[float, float]]:
    """Return the weighted separation, alignment and cohesion of boid `i`."""
    crowd2 = square_range(params.separation_range, params.range_inclusive)
    crowd_x, crowd_y = separation_direction(work.near, found, crowd2)
    with_x, with_y = alignment_from(
        own.vx[i], own.vy[i], others, work.near, found, math.inf
    )
    to_x, to_y = cohesion(work.near, found, math.inf)
    away, pace = (
        params.separation_weight,
        params.alignment_weight * params.alignment_gain,
    )
    together = params.cohesion_weight
    return (
        (away * crowd_x, away * crowd_y),
        (pace * with_x, pace * with_y),
        (together * to_x, together * to_y),
    )


@jit
def _navigation(
    params: Params, own: Flock, world: World, work: Workspace, i: int, leads: bool
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the weighted arrival and seek of boid `i`.

    The terms are zero unless the boid `leads`: only leaders know the goal.
    """
    if not leads:
        return (0.0, 0.0), (0.0, 0.0)
    goal_x, goal_y = goal_of(world, work.goals, i)
    dx, dy, vx, vy = goal_x - own.x[i], goal_y - own.y[i], own.vx[i], own.vy[i]
    stop, slow, gain = params.stop_distance, params.slow_distance, params.arrival_gain
    there_x, there_y = arrival(dx, dy, vx, vy, stop, slow, params.max_speed, gain)
    if params.arrival_limited:
        there_x, there_y = _limited(params, there_x, there_y, params.max_acceleration)
    x, y = seek(dx, dy, vx, vy, params.navigation_gain)
    x, y = _limited(params, x, y, params.max_acceleration)
    last, first = params.arrival_weight, params.seek_weight
    return (last * there_x, last * there_y), (first * x, first * y)


@jit
def _acceleration(
    params: Params,
    others: Flock,
    own: Flock,
    world: World,
    i: int,
    leads: bool,
    work: Workspace,
    found: int,
    record: Record,
) -> tuple[float, float]:
    """Return the limited sum of the terms of boid `i` in order of priority.

    Terms are added until the sum is longer than `acceleration_pool`.
    """
    obstacle = _avoidance(params, own, i, work, record)
    apart, along, together = _flocking(params, others, own, i, work, found)
    there, sought = _navigation(params, own, world, work, i, leads)
    terms = (obstacle, apart, there, sought, along, together)
    if params.priority == FLOCKING_FIRST:
        terms = (together, along, there, sought, obstacle, apart)
    ax, ay, has_room = 0.0, 0.0, True
    for x, y in terms:
        ax, ay, has_room = add_in_turn(ax, ay, x, y, has_room, params.acceleration_pool)
    return _limited(params, ax, ay, params.max_acceleration)


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

    v += a dt, limited to max_speed; p += v dt. A boid at rest keeps the heading of its
    last velocity.

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
    leaders = _leaders(params, flock.x.size)
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
                work.heading_x[i],
                work.heading_y[i],
                work.near,
            )
            ax, ay = _acceleration(
                robot, others, own, world, i, i < leaders, work, found, record
            )
            vx, vy = _limited(
                robot,
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
            if vx != 0.0 or vy != 0.0:
                work.heading_x[i], work.heading_y[i] = vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="rustamani2024",
    source=(
        "F. Y. Rustamani et al. (2024), Controlling a swarm of robots in 2D simulator"
        " Stage using Reynolds' rules"
    ),
    params=Params,
    presets={
        "as_written": AS_WRITTEN,
        "as_run": AS_RUN,
        "as_reported": AS_REPORTED,
    },
    metrics=(
        "speed",
        "polarization",
        "flock_count",
        "largest_flock_share",
        "boids_lost",
        "elongation",
        "neighbours_ahead",
        "share_arrived",
        "time_to_goal",
        "collisions",
        "boid_collisions",
        "dead_end_time",
    ),
    sight=sight,
    advance=advance,
    goal_seekers=_leaders,
    occupancy=_occupancy,
    faces_heading=True,
    symmetries={
        "translation": {
            "arrival_weight": 0.0,
            "seek_weight": 0.0,
            "obstacle_weight": 0.0,
        },
        "rotation": {"obstacle_weight": 0.0, "component_limits": False},
        "quarter_turn": {"obstacle_weight": 0.0},
        "reflection": {"obstacle_weight": 0.0},
        "permutation": {"leader_share": 1.0},
    },
    demands=DEMANDS,
    length="m",
    time="s",
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=True,
    shared=("leader_share", "grid_cell", "inflation", "dt"),
    equations=r"""
In each step, boid $i$ with position $p_i$ and velocity $v_i$ accelerates and moves
(Eqs. 1 and 2):

$$v_i \leftarrow L(v_i + a_i\,\Delta t,\,v_{\max}), \qquad
p_i \leftarrow p_i + v_i\,\Delta t$$

$L$ limits a vector. With `component_limits`, as the preset `as_run` has, $L$ cuts each
component to the interval from $-c$ to $c$. Otherwise $L$ limits the length:

$$L(f, c) = f\,\min\left(1, \frac{c}{|f|}\right)$$

**Neighbours** $N_i$ (Eqs. 3 to 6, Algorithm 1) are the other boids nearer than $R$ and
within a cone about the heading. The heading is the direction of the last velocity that
was not zero, and $(1, 0)$ if there was none. The cone has the full angle $\varphi$,
edge included. The angle of the paper is $\varphi / 2$. With `range_inclusive`, a boid
exactly at a range counts.

**Separation** (Algorithm 2) is a unit vector. $S_i$ are the neighbours nearer than
$r_s$ that are not at $p_i$. The vector is zero if $u$ is zero:

$$f_{\mathrm{sep}} = \frac{u}{|u|}, \qquad
u = \sum_{j \in S_i} \frac{p_i - p_j}{|p_i - p_j|^2}$$

**Alignment** (Algorithm 3) and **cohesion** (Algorithm 4) are zero without neighbours:

$$f_{\mathrm{ali}} = k_{\mathrm{ali}}
\left( \frac{1}{|N_i|} \sum_{j \in N_i} v_j - v_i \right), \qquad
f_{\mathrm{coh}} = \frac{1}{|N_i|} \sum_{j \in N_i} p_j - p_i$$

**Leaders** are the first $\lambda n$ of $n$ boids, rounded. Seek and arrival are zero
for all other boids. $g_i$ is the goal of boid $i$. **Seek** (Algorithm 5) is limited:

$$f_{\mathrm{seek}} = L\left(k_{\mathrm{nav}} (g_i - p_i) - v_i,\,a_{\max}\right)$$

**Arrival** (Algorithm 6) is zero at a distance $D = |g_i - p_i|$ below
$r_{\mathrm{stop}}$. Otherwise:

$$f_{\mathrm{arr}} = k_{\mathrm{arr}}\,v_{\max}\,
\min\left(1, \frac{D}{r_{\mathrm{slow}}}\right) \frac{g_i - p_i}{D} - v_i$$

With `arrival_limited`, as the preset `as_written` has, $L(f_{\mathrm{arr}}, a_{\max})$
replaces $f_{\mathrm{arr}}$. In the paper, one tolerance is both $r_{\mathrm{stop}}$ and
$r_{\mathrm{slow}}$.

**Obstacle avoidance** (Algorithms 7 and 8) uses an occupancy grid of cells with side
$s$. A cell is occupied if the centre is nearer than $b$ to an obstacle. All points
outside the grid count as occupied. $\theta_i$ is the direction of $v_i$. A heading
$\theta$ is free if no point of the path is in an occupied cell. The points are:

$$p_i + \frac{k\,\ell}{K} (\cos\theta, \sin\theta), \qquad k = 1, \ldots, K - 1$$

$K$ is $\ell / \delta$, rounded down. If $\theta_i$ is not free, the boid tries
$\theta_i + \alpha$, $\theta_i - \alpha$, $\theta_i + 2 \alpha$ and so on, up to half a
turn. The first free heading $\theta$ gives
$f_{\mathrm{obs}} = (\cos\theta, \sin\theta)$. $f_{\mathrm{obs}}$ is zero if $\theta_i$
is free, at a dead end (no free heading), and at rest.

**Sum** (Algorithm 9): $a_i = 0$ at first. Each rule $r$ is added in the order of
`priority` as long as $|a_i| \leq a_{\mathrm{pool}}$:

$$a_i \leftarrow a_i + w_r f_r$$

After the last rule, $a_i \leftarrow L(a_i, a_{\max})$. With `priority: safety_first`,
the order is obstacle avoidance, separation, arrival, seek, alignment, cohesion. With
`priority: flocking_first`, the order is cohesion, alignment, arrival, seek, obstacle
avoidance, separation. In the paper, $a_{\mathrm{pool}}$ equals $a_{\max}$.

**Update:** With `update: synchronous`, all boids react to the state before the step.
With `update: sequential`, boids move in turn, and later boids perceive the new states
of earlier boids. The model has no noise.
""",
)
