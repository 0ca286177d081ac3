"""Drones that flock in an arena with walls, and brake in time.

G. Vasarhelyi, C. Viragh, G. Somorjai, T. Nepusz, A. E. Eiben, T. Vicsek (2018),
Optimized flocking of autonomous drones in confined environments, Science Robotics 3,
eaat3536. The equations are from the simulator of the authors (csviragh/robotsim). The
parameters with the letters of the paper are from secondary sources.

Sensing, communication and actuation are parameters of all models; see kernels.robots.
The motor loop uses the velocity u that a drone measures, as in the simulator:
v + (w - u) (1 - exp(-dt / lag)). Actuation gives an equal result for the commanded
velocity w + v - u. This result is the exact solution for a constant w. The simulator
takes an Euler step, v + (w - u) dt / lag. With the dt of 0.01 s and the lag of 1 s in
the simulator, the Euler step is half a percent faster.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import limit
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.polygons import from_border, is_polygon
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.rules.headings import direction
from kernels.settings import (
    COMMON,
    SEQUENTIAL,
    TIME_STEP,
    UPDATE,
    About,
    Demand,
    InParts,
)
from kernels.state import Corners, Flock, World
from kernels.workspace import Workspace

WANTED_X, WANTED_Y, WAIT = 0, 1, 2
SCALED, CUT = 0, 1


class Params(NamedTuple):
    """Parameters of the paper, and additions of its simulator."""

    flock_speed: Annotated[
        float,
        About(
            "preferred speed of a drone",
            "length/time",
            low=0,
            symbol=r"v^{\mathrm{flock}}",
        ),
    ]
    repulsion_range: Annotated[
        float,
        About(
            "distance between two drones below which repulsion acts",
            "length",
            low=0,
            symbol=r"r_0^{\mathrm{rep}}",
        ),
    ]
    repulsion_gain: Annotated[
        float,
        About(
            "gain of the repulsion: added speed per unit of length below the range",
            "1/time",
            0,
            symbol=r"p^{\mathrm{rep}}",
        ),
    ]
    friction_range: Annotated[
        float,
        About(
            "distance between two drones at which the braking curve of the friction"
            " ends",
            "length",
            low=0,
            symbol=r"r_0^{\mathrm{frict}}",
        ),
    ]
    friction_gain: Annotated[
        float,
        About(
            "gain of the friction: fraction of the excess velocity difference that"
            " friction removes",
            low=0,
            symbol=r"C^{\mathrm{frict}}",
        ),
    ]
    friction_tolerance: Annotated[
        float,
        About(
            "velocity difference that friction allows at any distance",
            "length/time",
            low=0,
            symbol=r"v^{\mathrm{frict}}",
        ),
    ]
    friction_slope: Annotated[
        float,
        About(
            "slope of the linear part of the braking curve of the friction",
            "1/time",
            low=0,
            exclusive=True,
            symbol=r"p^{\mathrm{frict}}",
        ),
    ]
    friction_acceleration: Annotated[
        float,
        About(
            "deceleration in the square-root part of the braking curve of the friction",
            "length/time^2",
            low=0,
            symbol=r"a^{\mathrm{frict}}",
        ),
    ]
    walls: Annotated[
        bool,
        About(
            "whether the borders of the world have shill agents, in the same way as"
            " obstacles"
        ),
    ]
    shill_range: Annotated[
        float,
        About(
            "distance from a wall or an obstacle at which the braking curve of its"
            " shill agent ends",
            "length",
            low=0,
            symbol=r"r_0^{\mathrm{shill}}",
        ),
    ]
    shill_speed: Annotated[
        float,
        About(
            "speed of a shill agent, directed away from its wall or obstacle",
            "length/time",
            0,
            symbol=r"v^{\mathrm{shill}}",
        ),
    ]
    shill_slope: Annotated[
        float,
        About(
            "slope of the linear part of the braking curve of shill agents",
            "1/time",
            low=0,
            exclusive=True,
            symbol=r"p^{\mathrm{shill}}",
        ),
    ]
    shill_acceleration: Annotated[
        float,
        About(
            "deceleration in the square-root part of the braking curve of shill agents",
            "length/time^2",
            low=0,
            symbol=r"a^{\mathrm{shill}}",
        ),
    ]
    speed_limit: Annotated[
        int,
        About(
            "scaled: the commanded velocity has the length flock_speed, as in the"
            " program of the authors; cut: the commanded velocity is limited to"
            " max_speed, as in the paper",
            choices=("scaled", "cut"),
        ),
    ]
    max_speed: Annotated[
        float,
        About(
            "limit of the commanded speed if speed_limit is cut",
            "length/time",
            low=0,
            symbol=r"v^{\max}",
        ),
    ]
    interaction_range: Annotated[
        float,
        About(
            "maximum distance of interacting drones, as a drone perceives it,"
            " inclusive",
            "length",
            low=0,
            symbol="R",
        ),
    ]
    control_period: Annotated[
        float,
        About(
            "time between two updates of the commanded velocity, which is constant"
            " between them",
            "time",
            low=0,
            symbol="T",
        ),
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP, InParts("time")]


AS_RUN = COMMON | {
    "flock_speed": 4.0,
    "repulsion_range": 25.6,
    "repulsion_gain": 0.13,
    "friction_range": 85.3,
    "friction_gain": 0.05,
    "friction_tolerance": 0.63,
    "friction_slope": 3.2,
    "friction_acceleration": 4.16,
    "walls": True,
    "shill_range": 0.3,
    "shill_speed": 13.6,
    "shill_slope": 3.55,
    "shill_acceleration": 3.02,
    "speed_limit": "scaled",
    "max_speed": 6.0,
    "interaction_range": 100.0,
    "control_period": 0.2,
    "motor_lag": 1.0,
    "motor_acceleration": 6.0,
    "motor_noise": math.sqrt(2 * 0.2),
    "update": "synchronous",
    "n": 100,
    "steps": 60_000,
    "dt": 0.01,
    "map": "empty",
    "width": 250.0,
    "height": 250.0,
    "goal_x": 125.0,
    "goal_y": 125.0,
    "start_speed": 0.0,
    "start_distance": 8.0,
    "flock_range": 87.4262,
    "goal_radius": 10.0,
    "obstacle_radius": 5.0,
    "obstacle_margin": 5.0,
    "contact_distance": 3.0,
    "pixel": 1.0,
}
"""Optimum of the paper at 4 m/s, with the velocity scaling of the authors' program.

Flocks are linked up to friction_range plus the braking distance from flock_speed.
Drones start at rest, at a distance that a drone moves in 2 s. Gusts add the variance
2 * 0.2 m^2/s^3 to each component of a velocity. Sensing is ideal in this preset; the
paper, and the program as shipped, have the sensing of REAL.
"""
AS_WRITTEN = AS_RUN | {"speed_limit": "cut"}
"""Preset AS_RUN with the formula of the paper for the speed limit."""
TUNED4_V6 = AS_RUN | {
    "flock_speed": 6.0,
    "max_speed": 8.0,
    "start_distance": 12.0,
    "flock_range": 89.83,
}
TUNED4_V8 = AS_RUN | {
    "flock_speed": 8.0,
    "max_speed": 10.0,
    "start_distance": 16.0,
    "flock_range": 93.1954,
}
"""Optimum at 4 m/s with a changed speed; optima at 6 and 8 m/s are not known."""
FIELD6 = TUNED4_V6 | {
    "repulsion_range": 35.0,
    "repulsion_gain": 0.1,
    "friction_range": 65.0,
    "friction_gain": 0.5,
    "friction_tolerance": 2.0,
    "friction_slope": 1.0,
    "friction_acceleration": 3.0,
    "shill_range": 5.0,
    "shill_speed": 14.0,
    "shill_slope": 2.0,
    "shill_acceleration": 2.5,
    "flock_range": 72.5,
}
FIELD8 = FIELD6 | {
    "flock_speed": 8.0,
    "repulsion_range": 50.0,
    "friction_range": 80.0,
    "shill_range": 30.0,
    "max_speed": 10.0,
    "start_distance": 16.0,
    "flock_range": 92.1667,
}
"""Parameters that the authors chose by hand for outdoor experiments."""

REAL = AS_RUN | {
    "interaction_range": math.inf,
    "radio_range": 100.0,
    "position_noise": math.sqrt(0.005 / 0.010541),
    "velocity_noise": math.sqrt(0.005),
    "noise_time": 10.0,
    "noise_form": "coupled",
    "own_noise": "independent",
    "sensing_delay": 1.0,
    "sensing_period": 0.2,
}
"""Sensing and communication of the program as shipped.

The error of a velocity has the variance 0.005 m^2/s^2 and the damping 0.1 / s. The
spring constant of the position error is 0.010541 / s^2. Messages have a latency of 1 s
and a range of 100 m of true distance.
"""
LOSSY = REAL | {"packet_loss": 1.0, "packet_loss_range": 80.0}
"""Preset REAL with the packet loss of the program: a fraction (d / 80 m)^2."""


def sight(params: Params) -> Sight:
    """Return a view all round, up to the interaction range inclusive."""
    return Sight(params.interaction_range, inclusive=True)


def _obstacle_reach(_params: Params) -> float:
    """Return infinity: a fast drone brakes for an obstacle at any distance."""
    return math.inf


@jit
def _braking_square(way: float, acceleration: float, slope: float) -> float:
    """Return the square of D(r, a, p), the speed with the braking distance `way`.

    A drone brakes by a constant acceleration first, then in proportion to the distance
    left.
    """
    linear = slope * max(way, 0.0)
    turn = acceleration / slope
    if linear < turn:
        return linear * linear
    return 2.0 * acceleration * max(way, 0.0) - turn * turn


@jit
def _shilled(
    params: Params, x: float, y: float, vx: float, vy: float, distance: float
) -> tuple[float, float]:
    """Return the velocity that the shill agent at a wall adds.

    The agent moves along the unit vector (x, y) away from the wall. The added velocity
    removes the part of the velocity difference to the agent that exceeds the braking
    curve at this `distance`.
    """
    dx, dy = params.shill_speed * x - vx, params.shill_speed * y - vy
    square = dx * dx + dy * dy
    way = distance - params.shill_range
    due = _braking_square(way, params.shill_acceleration, params.shill_slope)
    share = 1.0 - math.sqrt(due / square) if square > due else 0.0
    return share * dx, share * dy


@jit
def _from_walls(
    params: Params, world: World, x: float, y: float, vx: float, vy: float
) -> tuple[float, float]:
    """Return the velocity added by the shill agents of the nearer wall per axis."""
    off_x, off_y = x - 0.5 * world.width, y - 0.5 * world.height
    way_x = -1.0 if off_x > 0.0 else 1.0
    way_y = -1.0 if off_y > 0.0 else 1.0
    across, along = 0.5 * world.width - abs(off_x), 0.5 * world.height - abs(off_y)
    ax, ay = _shilled(params, way_x, 0.0, vx, vy, across)
    bx, by = _shilled(params, 0.0, way_y, vx, vy, along)
    return ax + bx, ay + by


@jit
def _out_of(world: World, m: int, x: float, y: float) -> tuple[float, float, float]:
    """Return the unit vector out of obstacle `m` at (x, y), and the distance.

    Outside, the vector leads from the nearest point of the border to (x, y); inside,
    from (x, y) to the border, and the distance is negative. In the middle of a disc,
    and on the border of a polygon, the vector is zero.
    """
    return _out_of_shape(world.corners, world, m, x, y)


@jit
def _out_of_shape(
    corners: Corners | None, world: World, m: int, x: float, y: float
) -> tuple[float, float, float]:
    if corners is not None and is_polygon(corners, m):
        from_x, from_y, solid = from_border(corners, m, x, y)
        distance = math.sqrt(from_x * from_x + from_y * from_y)
        sign = -1.0 if solid else 1.0
        ux, uy = direction(sign * from_x, sign * from_y, 0.0, 0.0)
        return ux, uy, sign * distance
    dx, dy = x - world.obstacle_x[m], y - world.obstacle_y[m]
    if world.is_round[m]:
        ux, uy = direction(dx, dy, 0.0, 0.0)
        return ux, uy, math.sqrt(dx * dx + dy * dy) - world.half_width[m]
    side_x = -1.0 if dx < 0.0 else 1.0
    side_y = -1.0 if dy < 0.0 else 1.0
    across = abs(dx) - world.half_width[m]
    along = abs(dy) - world.half_height[m]
    if across <= 0.0 and along <= 0.0:
        beside = across > along
        ux, uy = side_x if beside else 0.0, 0.0 if beside else side_y
        return ux, uy, max(across, along)
    across, along = max(across, 0.0), max(along, 0.0)
    distance = math.sqrt(across * across + along * along)
    return side_x * across / distance, side_y * along / distance, distance


@jit
def _from_obstacles(
    params: Params, world: World, x: float, y: float, vx: float, vy: float
) -> tuple[float, float]:
    """Return the velocity added by the shill agents of all obstacles."""
    ax, ay = 0.0, 0.0
    for m in range(world.obstacle_x.size):
        ux, uy, distance = _out_of(world, m, x, y)
        dx, dy = _shilled(params, ux, uy, vx, vy, distance)
        ax += dx
        ay += dy
    return ax, ay


@jit
def _from_others(
    params: Params, others: Flock, own: Flock, i: int, work: Workspace, found: int
) -> tuple[float, float]:
    """Return the sum of repulsion and friction by the `found` drones in `work.near`.

    A neighbour nearer than r0_rep repels by p_rep (r0_rep - r). Let m be the larger of
    v_frict and D(r - r0_frict, a_frict, p_frict). If velocities differ by more than m,
    friction adds C_frict (|v_j - v_i| - m) along v_j - v_i.
    """
    tolerance2 = params.friction_tolerance * params.friction_tolerance
    x, y = 0.0, 0.0
    for k in range(found):
        j = work.near.boid[k]
        distance = math.sqrt(work.near.distance2[k])
        near = distance < params.repulsion_range and distance > 0.0
        push = params.repulsion_gain * (params.repulsion_range - distance)
        share = push / distance if near else 0.0
        dvx, dvy = others.vx[j] - own.vx[i], others.vy[j] - own.vy[i]
        square = dvx * dvx + dvy * dvy
        way = distance - params.friction_range
        curve = _braking_square(
            way, params.friction_acceleration, params.friction_slope
        )
        due = max(tolerance2, curve)
        rest = 1.0 - math.sqrt(due / square) if square > due else 0.0
        x += params.friction_gain * rest * dvx - share * work.near.dx[k]
        y += params.friction_gain * rest * dvy - share * work.near.dy[k]
    return x, y


@jit
def _wanted(
    params: Params,
    others: Flock,
    own: Flock,
    world: World,
    i: int,
    work: Workspace,
    found: int,
) -> tuple[float, float]:
    """Return the commanded velocity of drone `i`.

    The terms of the sum are the present direction with speed v_flock, repulsion,
    friction and the shill agents. `speed_limit` decides the length of the sum.
    """
    own_x, own_y, vx, vy = own.x[i], own.y[i], own.vx[i], own.vy[i]
    ux, uy = direction(vx, vy, 0.0, 0.0)
    x, y = _from_others(params, others, own, i, work, found)
    x, y = x + params.flock_speed * ux, y + params.flock_speed * uy
    if params.walls:
        ax, ay = _from_walls(params, world, own_x, own_y, vx, vy)
        x, y = x + ax, y + ay
    ax, ay = _from_obstacles(params, world, own_x, own_y, vx, vy)
    x, y = x + ax, y + ay
    if params.speed_limit == CUT:
        return limit(x, y, params.max_speed)
    ux, uy = direction(x, y, 0.0, 0.0)
    return params.flock_speed * ux, params.flock_speed * uy


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

    Each drone updates the commanded velocity at the start, and at the end of each
    control period. Positions move by the velocity from before the step, p += v dt. A
    border that mirrors a velocity also mirrors the commanded velocity.

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
    others, own = others_of(flock, work, sequential), own_of(flock, work)
    dt = params.dt
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            if work.state[WAIT, i] < 0.5 * dt:
                range2 = square_range(robot.interaction_range, True)
                found = search(
                    others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
                )
                wx, wy = _wanted(robot, others, own, world, i, work, found)
                work.state[WANTED_X, i], work.state[WANTED_Y, i] = wx, wy
                work.state[WAIT, i] += robot.control_period
            work.state[WAIT, i] -= dt
            wx, wy = work.state[WANTED_X, i], work.state[WANTED_Y, i]
            vx, vy = flock.vx[i], flock.vy[i]
            x, y = flock.x[i] + vx * dt, flock.y[i] + vy * dt
            missed_x, missed_y = vx - own.vx[i], vy - own.vy[i]
            vx, vy = drive(work, i, vx, vy, wx + missed_x, wy + missed_y)
            _, wx = confine(x, wx, world.width, world.borders)
            _, wy = confine(y, wy, world.height, world.borders)
            x, vx = confine(x, vx, world.width, world.borders)
            y, vy = confine(y, vy, world.height, world.borders)
            work.state[WANTED_X, i], work.state[WANTED_Y, i] = wx, wy
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = x, y, vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


EXACT = {
    "motor_noise": 0.0,
    "position_noise": 0.0,
    "velocity_noise": 0.0,
    "noise_form": "independent",
    "packet_loss": 0.0,
}
"""Parameters without any randomness."""

MODEL = Model(
    name="vasarhelyi2018",
    source=(
        "G. Vasarhelyi, C. Viragh, G. Somorjai, T. Nepusz, A. E. Eiben, T. Vicsek"
        " (2018), Optimized flocking of autonomous drones in confined environments"
    ),
    params=Params,
    presets={
        "as_written": AS_WRITTEN,
        "as_run": AS_RUN,
        "tuned4_v6": TUNED4_V6,
        "tuned4_v8": TUNED4_V8,
        "field6": FIELD6,
        "field8": FIELD8,
        "real": REAL,
        "lossy": LOSSY,
    },
    metrics=(
        "speed",
        "velocity_correlation",
        "flock_correlation",
        "pairs_in_contact",
        "depth_outside",
        "boids_alone",
        "smallest_flock",
        "nearest_neighbour_distance",
        "least_distance",
    ),
    sight=sight,
    advance=advance,
    obstacle_reach=_obstacle_reach,
    symmetries={
        "translation": {"walls": False} | EXACT,
        "rotation": {"walls": False} | EXACT,
        "quarter_turn": EXACT,
        "reflection": EXACT,
        "permutation": EXACT,
    },
    state={
        "wanted_x": About("commanded velocity of a drone, along x", "length/time"),
        "wanted_y": About("commanded velocity of a drone, along y", "length/time"),
        "wait": About("time until the next choice of the command", "time"),
    },
    vectors=(("wanted_x", "wanted_y"),),
    demands=(
        Demand(
            "dt <= control_period",
            "a wanted velocity is chosen at most once a step: control_period must be at"
            " least dt",
        ),
    ),
    length="m",
    time="s",
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
    equations=r"""
Drone $i$ has the position $\mathbf{x}_i$ and the velocity $\mathbf{v}_i$. The drone
chooses a commanded velocity $\mathbf{w}_i$ in the first step and again after each
control period $T$. $\mathbf{w}_i$ is constant between these times.

The rules use the positions and velocities that drone $i$ perceives. Its own measured
velocity is $\mathbf{u}_i$. $N_i$ is the set of other drones within the perceived
distance $R$, range inclusive and in all directions. $\mathbf{r}_{ij}$ is the vector
from drone $j$ to drone $i$, with the length $r_{ij}$.

**Braking curve.** $D$ is the speed from which a drone can brake within the distance
$r$:

$$D(r, a, p) = \begin{cases}
0 & r \le 0 \\
p\,r & 0 < p\,r < a / p \\
\sqrt{2 a r - a^2 / p^2} & p\,r \ge a / p
\end{cases}$$

**Repulsion** acts between drones that are nearer than $r_0^{\mathrm{rep}}$:

$$\mathbf{v}_i^{\mathrm{rep}} = \sum_{j \in N_i} p^{\mathrm{rep}}
\max\left( 0,\; r_0^{\mathrm{rep}} - r_{ij} \right) \frac{\mathbf{r}_{ij}}{r_{ij}}$$

**Friction** reduces velocity differences
$\mathbf{u}_{ij} = \mathbf{v}_j - \mathbf{u}_i$ whose length $u_{ij}$ exceeds an allowed
value $m_{ij}$:

$$m_{ij} = \max\left( v^{\mathrm{frict}},\;
D(r_{ij} - r_0^{\mathrm{frict}}, a^{\mathrm{frict}}, p^{\mathrm{frict}}) \right), \qquad
\mathbf{v}_i^{\mathrm{frict}} = \sum_{j \in N_i} C^{\mathrm{frict}}
\max\left( 0,\; u_{ij} - m_{ij} \right) \frac{\mathbf{u}_{ij}}{u_{ij}}$$

**Shill agents** are virtual drones at walls and obstacles. Shill agent $s$ is at the
distance $r_{is}$, negative inside an obstacle or outside the world. Its velocity is
$v^{\mathrm{shill}} \mathbf{n}_s$, with the unit vector $\mathbf{n}_s$ away from the
wall or the obstacle:

$$\mathbf{v}_i^{\mathrm{shill}} = \sum_{s} \max\left( 0,\; u_{is}
- D(r_{is} - r_0^{\mathrm{shill}}, a^{\mathrm{shill}}, p^{\mathrm{shill}}) \right)
\frac{\mathbf{u}_{is}}{u_{is}}, \qquad
\mathbf{u}_{is} = v^{\mathrm{shill}} \mathbf{n}_s - \mathbf{u}_i$$

Each obstacle has one shill agent, at its point nearest to the drone. With
`walls: true`, the nearer wall along $x$ and the nearer wall along $y$ have one each.

**Commanded velocity.** The first term is zero for a drone at rest:

$$\mathbf{s}_i = v^{\mathrm{flock}} \frac{\mathbf{u}_i}{|\mathbf{u}_i|}
+ \mathbf{v}_i^{\mathrm{rep}} + \mathbf{v}_i^{\mathrm{frict}}
+ \mathbf{v}_i^{\mathrm{shill}}, \qquad
\mathbf{w}_i = \frac{\mathbf{s}_i}{|\mathbf{s}_i|} \begin{cases}
v^{\mathrm{flock}} & \mathrm{scaled} \\
\min(|\mathbf{s}_i|, v^{\max}) & \mathrm{cut}
\end{cases}$$

The parameter `speed_limit` selects `scaled`, as in the program of the authors, or
`cut`, as in the paper.

**Move.** The position changes with the velocity before the step. $A$ is the actuation
of all models with its lag, limits and noise:

$$\mathbf{x}_i \leftarrow \mathbf{x}_i + \mathbf{v}_i\,\Delta t, \qquad
\mathbf{v}_i \leftarrow A\left( \mathbf{v}_i,\;
\mathbf{w}_i + \mathbf{v}_i - \mathbf{u}_i \right)$$

For a lag $\tau$ (`motor_lag`) alone,
$A(\mathbf{v}, \mathbf{c}) = \mathbf{c} + e^{-\Delta t/\tau}(\mathbf{v} - \mathbf{c})$.
A reflecting border also mirrors $\mathbf{w}_i$.

With `update: synchronous`, all drones use the states before the step. With
`update: sequential`, later drones use the new states of earlier drones.
""",
)
