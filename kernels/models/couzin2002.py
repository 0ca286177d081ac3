"""Animals with zones of repulsion, orientation and attraction, in the plane.

I. D. Couzin, J. Krause, R. James, G. D. Ruxton, N. R. Franks (2002), Collective memory
and spatial sorting in animal groups, Journal of Theoretical Biology 218, 1-11. The
paper has three dimensions, and this model has two. The unit of length is the radius of
the zone of repulsion; the unit of time is the second.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.angles import cosine_sine
from kernels.chance import normal
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import (
    ALL_ROUND,
    cone,
    move,
    move_all,
    search,
    square_range,
)
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.rules.headings import direction, turned, turned_towards
from kernels.settings import COMMON, SEQUENTIAL, UPDATE, About, Demand
from kernels.state import Flock, World
from kernels.workspace import Workspace

PLAIN_SUMS, UNIT_VECTORS = 0, 1


class Params(NamedTuple):
    """The zones, the field of view and the turns of Eqs. (1) to (3)."""

    repulsion_range: Annotated[
        float,
        About(
            "radius of the zone of repulsion, in all directions (Eq. 1)",
            "length",
            low=0,
            symbol="r_r",
        ),
    ]
    orientation_width: Annotated[
        float,
        About(
            "width of the zone of orientation (Eq. 2)",
            "length",
            low=0,
            symbol=r"\Delta r_o",
        ),
    ]
    attraction_width: Annotated[
        float,
        About(
            "width of the zone of attraction (Eq. 3)",
            "length",
            low=0,
            symbol=r"\Delta r_a",
        ),
    ]
    fov: Annotated[
        float,
        About(
            "field of view in the zones of orientation and attraction",
            "degrees",
            0,
            high=360,
            symbol=r"\alpha",
        ),
    ]
    zone_sums: Annotated[
        int,
        About(
            "sum of orientation (Eq. 2) and attraction (Eq. 3). plain_sums: the fuller"
            " zone has the larger weight; unit_vectors: both zones are scaled to"
            " length 1 and have equal weights",
            choices=("plain_sums", "unit_vectors"),
        ),
    ]
    noise: Annotated[
        float,
        About(
            "standard deviation of the Gaussian error of the desired direction",
            "radians",
            low=0,
            symbol=r"\sigma",
        ),
    ]
    max_turn: Annotated[
        float,
        About(
            "maximum turn rate, in degrees per unit of time", low=0, symbol=r"\theta"
        ),
    ]
    max_speed: Annotated[
        float,
        About(
            "constant speed of all boids from the first step on",
            "length/time",
            low=0,
            exclusive=True,
            symbol="s",
        ),
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[
        float,
        About("duration of a time step", "time", low=0, exclusive=True, symbol=r"\tau"),
    ]


AS_WRITTEN = COMMON | {
    "repulsion_range": 1.0,
    "orientation_width": 3.0,
    "attraction_width": 10.0,
    "fov": 270.0,
    "zone_sums": "plain_sums",
    "noise": 0.05,
    "max_turn": 40.0,
    "max_speed": 3.0,
    "update": "synchronous",
    "n": 100,
    "steps": 5000,
    "dt": 0.1,
    "map": "empty",
    "width": 20.0,
    "height": 20.0,
    "goal_x": 10.0,
    "goal_y": 10.0,
    "start_speed": 3.0,
    "start_margin": 5.0,
    "start_draws": "portable",
    "flock_range": 14.0,
    "goal_radius": 1.0,
    "obstacle_radius": 0.5,
    "obstacle_margin": 1.0,
    "contact_distance": 0.01,
    "pixel": 0.1,
}
"""100 animals in an unbounded world, which start within a square of side 10.

There is no program of the authors, so as_run equals as_written.
"""


def _state(orientation_width: float) -> dict[str, object]:
    """Return the preset of one collective state, given by `orientation_width`."""
    return AS_WRITTEN | {
        "orientation_width": orientation_width,
        "flock_range": 11.0 + orientation_width,
    }


def sight(params: Params) -> Sight:
    """Return a view all round, up to the end of the zone of attraction.

    The field of view is applied in `_desired`, since repulsion acts all round.
    """
    widths = params.orientation_width + params.attraction_width
    return Sight(params.repulsion_range + widths)


@jit
def _desired(
    params: Params, others: Flock, own: Flock, i: int, work: Workspace, found: int
) -> tuple[float, float]:
    """Return the desired direction of boid `i`, not scaled; zero without any pull.

    If neighbours are in the zone of repulsion, all round, only these neighbours count.
    The boid then heads away from all of these neighbours, by unit vectors, Eq. (1).
    Otherwise two sums over visible neighbours are added: the unit velocities in the
    zone of orientation, Eq. (2), and the unit vectors to neighbours in the zone of
    attraction, Eq. (3). With `unit_vectors` each sum is normalised to length 1 before
    the addition.
    """
    repulsion2 = params.repulsion_range * params.repulsion_range
    outer = params.repulsion_range + params.orientation_width
    orientation2, view = outer * outer, cone(params.fov)
    own_x, own_y = direction(own.vx[i], own.vy[i], 0.0, 0.0)
    away_x, away_y, crowd = 0.0, 0.0, 0.0
    with_x, with_y, to_x, to_y = 0.0, 0.0, 0.0, 0.0
    for k in range(found):
        square = work.near.distance2[k]
        x, y = direction(work.near.dx[k], work.near.dy[k], 0.0, 0.0)
        along = x * own_x + y * own_y
        if square < repulsion2:
            away_x -= x
            away_y -= y
            crowd += 1.0
        elif along * abs(along) >= view:
            if square < orientation2:
                # The index in the list is written out, since it is equal in all lanes.
                vx = others.vx[work.near.boid[k]]
                vy = others.vy[work.near.boid[k]]
                x, y = direction(vx, vy, 0.0, 0.0)
                with_x += x
                with_y += y
            else:
                to_x += x
                to_y += y
    if params.zone_sums == UNIT_VECTORS:
        with_x, with_y = direction(with_x, with_y, 0.0, 0.0)
        to_x, to_y = direction(to_x, to_y, 0.0, 0.0)
    x = away_x if crowd > 0.0 else with_x + to_x
    y = away_y if crowd > 0.0 else with_y + to_y
    return x, y


@jit
def _missed(rng: Generator, deviation: float) -> tuple[float, float]:
    """Return cosine and sine of a Gaussian angle; `deviation` is in radians."""
    angle = deviation * normal(rng)
    return cosine_sine(angle - math.tau * math.floor(angle / math.tau + 0.5))


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

    A boid without any pull desires its own heading. A Gaussian angle rotates the
    desired direction. The boid turns towards the result by at most max_turn dt, and
    moves by s dt.

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
    dt = params.dt
    others = others_of(flock, work, sequential)
    own = own_of(flock, work)
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            widths = robot.orientation_width + robot.attraction_width
            range2 = square_range(robot.repulsion_range + widths, False)
            found = search(
                others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            own_x, own_y = direction(flock.vx[i], flock.vy[i], 0.0, 0.0)
            x, y = _desired(robot, others, own, i, work, found)
            x, y = direction(x, y, own_x, own_y)
            miss_x, miss_y = _missed(rng, robot.noise)
            x, y = turned(x, y, miss_x, miss_y)
            most = min(math.radians(robot.max_turn) * dt, math.pi)
            cosine, sine = cosine_sine(most)
            x, y = turned_towards(own_x, own_y, x, y, cosine, sine)
            vx, vy = robot.max_speed * x, robot.max_speed * y
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, vx = confine(flock.x[i] + vx * dt, vx, world.width, world.borders)
            y, vy = confine(flock.y[i] + vy * dt, vy, world.height, world.borders)
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = x, y, vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="couzin2002",
    source=(
        "I. D. Couzin, J. Krause, R. James, G. D. Ruxton, N. R. Franks (2002),"
        " Collective memory and spatial sorting in animal groups"
    ),
    params=Params,
    presets={
        "as_written": AS_WRITTEN,
        "as_run": AS_WRITTEN,
        "swarm": _state(0.5),
        "torus": _state(5.0),
        "highly_parallel": _state(12.0),
    },
    metrics=("polarization", "angular_momentum", "largest_flock_share"),
    sight=sight,
    advance=advance,
    symmetries={
        "translation": {"noise": 0.0},
        "rotation": {"noise": 0.0},
        "quarter_turn": {"noise": 0.0},
        "reflection": {"noise": 0.0},
        "permutation": {"noise": 0.0},
    },
    demands=(
        Demand(
            "start_speed > 0",
            "a boid at rest has no heading: start_speed must be more than 0",
        ),
        Demand(
            "start_velocities == 'heading'",
            "all boids have one speed from the start: start_velocities must be heading",
        ),
    ),
    length="r",
    time="s",
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
    equations=r"""
In each step, boid $i$ with position $\mathbf{x}_i$ and heading $\mathbf{u}_i$ chooses a
desired direction, turns towards it and moves. The heading is the unit vector of the
velocity $\mathbf{v}_i$. The paper has three dimensions, and this model has two.

The displacement to boid $j$ is $\mathbf{r}_{ij} = \mathbf{x}_j - \mathbf{x}_i$. A hat
marks a unit vector: $\hat{\mathbf{a}} = \mathbf{a} / |\mathbf{a}|$. Three sets of other
boids influence boid $i$:

- $R_i$, the zone of repulsion: $|\mathbf{r}_{ij}| < r_r$, in all directions.
- $O_i$, the zone of orientation: $r_r \le |\mathbf{r}_{ij}| < r_o$ with
  $r_o = r_r + \Delta r_o$, within the field of view.
- $A_i$, the zone of attraction: $r_o \le |\mathbf{r}_{ij}| < r_a$ with
  $r_a = r_o + \Delta r_a$, within the field of view.

The field of view contains boid $j$ if the angle between $\mathbf{r}_{ij}$ and
$\mathbf{u}_i$ is at most $\alpha / 2$.

**Repulsion** (Eq. 1), **orientation** (Eq. 2) and **attraction** (Eq. 3) are sums of
unit vectors:

$$\mathbf{d}_i^r = -\sum_{j \in R_i} \hat{\mathbf{r}}_{ij}, \qquad
\mathbf{d}_i^o = \sum_{j \in O_i} \hat{\mathbf{v}}_j, \qquad
\mathbf{d}_i^a = \sum_{j \in A_i} \hat{\mathbf{r}}_{ij}$$

**Desired direction.** Repulsion has priority over the other zones:

$$\mathbf{d}_i = \begin{cases}
\mathbf{d}_i^r & R_i \neq \emptyset \\
\mathbf{d}_i^o + \mathbf{d}_i^a & R_i = \emptyset
\end{cases}$$

This is the direction of the paper (`zone_sums: plain_sums`). With
`zone_sums: unit_vectors`, $\hat{\mathbf{d}}_i^o$ and $\hat{\mathbf{d}}_i^a$ replace
$\mathbf{d}_i^o$ and $\mathbf{d}_i^a$. If $\mathbf{d}_i$ is zero, the desired direction
is the heading $\mathbf{u}_i$.

**Noise** rotates the desired direction by a Gaussian angle. $Q(\varphi)$ is the
rotation by the angle $\varphi$:

$$\mathbf{e}_i = Q(\xi_i)\,\hat{\mathbf{d}}_i, \qquad \xi_i \sim N(0, \sigma^2)$$

**Turn.** $\phi_i$ is the angle from $\mathbf{u}_i$ to $\mathbf{e}_i$, with
$-\pi < \phi_i \le \pi$. The turn in one step is at most $\theta\tau$:

$$\mathbf{u}_i \leftarrow Q\left( \max\left( -\theta\tau,
\min(\phi_i, \theta\tau) \right) \right) \mathbf{u}_i$$

**Move:**

$$\mathbf{v}_i \leftarrow s\,\mathbf{u}_i, \qquad
\mathbf{x}_i \leftarrow \mathbf{x}_i + \mathbf{v}_i\,\tau$$

With `update: synchronous`, all boids use the states before the step. With
`update: sequential`, later boids use the new states of earlier boids.
""",
)
