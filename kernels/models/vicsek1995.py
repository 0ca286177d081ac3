"""Boids of equal speed that adopt the mean heading of neighbours, with noise.

T. Vicsek, A. Czirok, E. Ben-Jacob, I. Cohen, O. Shochet (1995), Novel type of phase
transition in a system of self-driven particles, Physical Review Letters 75, 1226-1229.
The unit of length is the interaction range; the unit of time is the step.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.rules.headings import direction, random_turn, turned, velocity_sum_from
from kernels.settings import COMMON, SEQUENTIAL, TIME_STEP, UPDATE, About, Demand
from kernels.state import Flock, World
from kernels.workspace import Workspace

SCALAR, VECTORIAL = 0, 1
OLD_HEADING, NEW_HEADING = 0, 1


class Params(NamedTuple):
    """Parameters that the papers vary, and choices in which the papers differ."""

    noise: Annotated[
        float,
        About(
            "width of the interval of the noise angle (Eq. 2), in radians, with scalar"
            " noise; length of the random vector, dimensionless, with vectorial noise",
            "radians",
            low=0,
            high=math.tau,
            symbol=r"\eta",
        ),
    ]
    noise_type: Annotated[
        int,
        About(
            "scalar: a random angle is added to the mean heading (Eq. 2); vectorial: a"
            " random vector is added to the sum of headings, multiplied by their"
            " number",
            choices=("scalar", "vectorial"),
        ),
    ]
    moves_with: Annotated[
        int,
        About(
            "heading of the displacement in a step. old_heading: heading before the"
            " step (Eq. 1); new_heading: heading after the step",
            choices=("old_heading", "new_heading"),
        ),
    ]
    max_speed: Annotated[
        float,
        About(
            "constant speed of all boids from the first step on",
            "length/time",
            low=0,
            exclusive=True,
            symbol="v",
        ),
    ]
    interaction_range: Annotated[
        float,
        About(
            "range of the mean heading (Eq. 2), inclusive", "length", low=0, symbol="r"
        ),
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP]


AS_WRITTEN = COMMON | {
    "noise": 2.0,
    "noise_type": "scalar",
    "moves_with": "old_heading",
    "max_speed": 0.03,
    "interaction_range": 1.0,
    "update": "synchronous",
    "n": 100,
    "steps": 2000,
    "dt": 1.0,
    "map": "empty",
    "width": 5.0,
    "height": 5.0,
    "borders": "torus",
    "minimum_image": True,
    "start_speed": 0.03,
    "start_draws": "portable",
    "flock_range": 1.0,
    "goal_radius": 1.0,
    "obstacle_radius": 0.5,
    "obstacle_margin": 1.0,
    "contact_distance": 0.01,
    "pixel": 0.05,
}
"""Vicsek et al. (1995): N = 100 of figure 2a, at the density 4 of the paper.

There is no program of the authors, so as_run equals as_written.
"""
GREGOIRE_CHATE2004 = AS_WRITTEN | {
    "noise": 0.6,
    "noise_type": "vectorial",
    "moves_with": "new_heading",
    "max_speed": 0.5,
    "start_speed": 0.5,
    "n": 512,
    "width": 16.0,
    "height": 16.0,
}
"""Vectorial noise at speed 0.5 and density 2.

G. Gregoire, H. Chate (2004), Onset of collective and cohesive motion, Physical Review
Letters 92, 025702.
"""
NAGY2007 = AS_WRITTEN | {
    "noise": 3.0,
    "max_speed": 0.1,
    "start_speed": 0.1,
    "n": 400,
    "width": 10.0,
    "height": 10.0,
}
"""Scalar noise at a small speed, with the density of Vicsek et al. (1995).

M. Nagy, I. Daruka, T. Vicsek (2007), New aspects of the continuous phase transition in
the scalar noise model (SNM) of collective motion, Physica A 373, 445-454.
"""


def sight(params: Params) -> Sight:
    """Return a view all round, up to the interaction range inclusive."""
    return Sight(params.interaction_range, inclusive=True)


@jit
def _new_velocity(
    params: Params,
    others: Flock,
    own: Flock,
    i: int,
    work: Workspace,
    found: int,
    rng: Generator,
) -> tuple[float, float]:
    """Return the new velocity of boid `i`.

    Scalar noise follows Eq. (2) of Vicsek et al. (1995): the average heading plus a
    random angle. With the vectorial noise of Gregoire and Chate (2004), the velocity is
    along a sum. The terms are the n unit vectors of the headings and eta n e, with a
    random unit vector e. If the sum is zero, the boid keeps the old heading. The
    function draws one number per boid and step for any noise. The function sums
    velocities, so a faster boid has a larger weight if speeds differ, for example
    between robots.
    """
    own_x, own_y = own.vx[i], own.vy[i]
    x, y, count = velocity_sum_from(own_x, own_y, others, work.near, found)
    vectorial = params.noise_type == VECTORIAL
    cosine, sine = random_turn(rng, math.tau if vectorial else params.noise)
    if vectorial:
        push = params.noise * count * math.sqrt(own_x * own_x + own_y * own_y)
        x, y = x + push * cosine, y + push * sine
    x, y = direction(x, y, own_x, own_y)
    if not vectorial:
        x, y = turned(x, y, cosine, sine)
    return params.max_speed * x, params.max_speed * y


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

    Eq. (1) of Vicsek et al. (1995), p += v dt, with the velocity from before the step,
    as in the paper, or with the new velocity. Before the first step the speed is
    start_speed.

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
    moves_with_new = params.moves_with == NEW_HEADING
    others = others_of(flock, work, sequential)
    own = own_of(flock, work)
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            range2 = square_range(robot.interaction_range, True)
            found = search(
                others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            vx, vy = _new_velocity(robot, others, own, i, work, found, rng)
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            way_x = vx if moves_with_new else flock.vx[i]
            way_y = vy if moves_with_new else flock.vy[i]
            x, vx = confine(
                flock.x[i] + way_x * params.dt, vx, world.width, world.borders
            )
            y, vy = confine(
                flock.y[i] + way_y * params.dt, vy, world.height, world.borders
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
    name="vicsek1995",
    source=(
        "T. Vicsek, A. Czirok, E. Ben-Jacob, I. Cohen, O. Shochet (1995), Novel type of"
        " phase transition in a system of self-driven particles"
    ),
    params=Params,
    presets={
        "as_written": AS_WRITTEN,
        "as_run": AS_WRITTEN,
        "gregoire_chate2004": GREGOIRE_CHATE2004,
        "nagy2007": NAGY2007,
    },
    metrics=("polarization", "flock_count", "largest_flock_share"),
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
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
    equations=r"""
In each step, boid $i$ with position $\mathbf{x}_i$ and velocity $\mathbf{v}_i$ takes a
new heading $\theta_i'$ and moves. All boids have the same speed $v$:

$$\mathbf{v}_i' = v \left( \cos\theta_i',\; \sin\theta_i' \right)$$

$N_i$ is the set of boids within the range $r$ of boid $i$, range inclusive and in all
directions. Boid $i$ is a member of $N_i$. $\mathrm{arg}(\mathbf{a})$ is the angle of a
vector $\mathbf{a}$.

**Scalar noise** (Eq. 2, `noise_type: scalar`) turns the mean heading of $N_i$ by a
uniform random angle:

$$\theta_i' = \mathrm{arg}\left( \sum_{j \in N_i} \mathbf{v}_j \right) + \xi_i, \qquad
\xi_i \sim U\left( -\frac{\eta}{2}, \frac{\eta}{2} \right)$$

**Vectorial noise** (Gregoire and Chate 2004, `noise_type: vectorial`) adds a random
vector to the sum, multiplied by the number $|N_i|$ of boids in $N_i$:

$$\theta_i' = \mathrm{arg}\left( \sum_{j \in N_i} \mathbf{v}_j
+ \eta\,|N_i|\,|\mathbf{v}_i|\,\mathbf{e}_i \right), \qquad
\mathbf{e}_i = \left( \cos\xi_i,\; \sin\xi_i \right), \qquad
\xi_i \sim U(-\pi, \pi)$$

If a sum is zero, its angle is the angle of $\mathbf{v}_i$. A faster boid has a larger
weight in the sum if the speeds of boids differ.

**Move** (Eq. 1):

$$\mathbf{x}_i \leftarrow \mathbf{x}_i + \mathbf{w}_i\,\Delta t, \qquad
\mathbf{v}_i \leftarrow \mathbf{v}_i', \qquad
\mathbf{w}_i = \begin{cases}
\mathbf{v}_i & \mathrm{old} \\
\mathbf{v}_i' & \mathrm{new}
\end{cases}$$

The parameter `moves_with` selects the velocity before the step (`old_heading`, as in
the paper) or the new velocity (`new_heading`).

With `update: synchronous`, all boids use the states before the step. With
`update: sequential`, later boids use the new states of earlier boids.
""",
)
