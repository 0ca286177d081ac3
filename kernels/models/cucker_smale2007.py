"""Boids that adopt the velocities of boids, with weights that fall with distance.

F. Cucker, S. Smale (2007), Emergent behavior in flocks, IEEE Transactions on Automatic
Control 52, 852-862. Lengths and times are dimensionless in the paper.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.elementary import power
from kernels.indices import whole
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.settings import (
    COMMON,
    INTERACTION_RANGE,
    SEQUENTIAL,
    UPDATE,
    About,
)
from kernels.state import Flock, World
from kernels.workspace import Workspace

SUM, MEAN = 0, 1


class Params(NamedTuple):
    """Constants of the weights a_ij = K / (sigma^2 + |x_i - x_j|^2)^beta."""

    strength: Annotated[
        float,
        About(
            "coupling strength of the velocity alignment; a rate in 1/time if exponent"
            " is 0",
            low=0,
            symbol="K",
        ),
    ]
    decay_length: Annotated[
        float,
        About(
            "distance from which the alignment weight decreases",
            "length",
            low=0,
            exclusive=True,
            symbol=r"\sigma",
        ),
    ]
    exponent: Annotated[
        float,
        About(
            "decay exponent of the alignment weight, which at large distances falls as"
            " the distance to the power of -2 exponent",
            low=0,
            symbol=r"\beta",
        ),
    ]
    weights: Annotated[
        int,
        About(
            "sum: sum over all neighbours, as in the paper (Eq. 1); mean: the sum"
            " divided by the number of boids",
            choices=("sum", "mean"),
        ),
    ]
    interaction_range: Annotated[float, INTERACTION_RANGE]
    update: Annotated[int, UPDATE]
    dt: Annotated[
        float,
        About("duration of a time step", "time", low=0, exclusive=True, symbol="h"),
    ]


AS_WRITTEN = COMMON | {
    "strength": 1.0,
    "decay_length": 1.0,
    "exponent": 0.4,
    "weights": "sum",
    "interaction_range": math.inf,
    "update": "synchronous",
    "n": 50,
    "steps": 1000,
    "dt": 0.01,
    "map": "empty",
    "width": 20.0,
    "height": 20.0,
    "goal_x": 10.0,
    "goal_y": 10.0,
    "start_velocities": "components",
    "start_speed": 1.0,
    "start_margin": 5.0,
    "flock_range": 5.0,
    "goal_radius": 1.0,
    "obstacle_radius": 0.5,
    "obstacle_margin": 1.0,
    "contact_distance": 0.01,
    "pixel": 0.1,
}
"""beta = 0.4, below the limit 1/2 up to which every flock agrees; no borders.

There is no program of the authors, so as_run equals as_written.
"""
CONDITIONAL = AS_WRITTEN | {"exponent": 0.8, "weights": "mean"}
"""beta = 0.8: a flock agrees if distances and velocity differences are small enough."""


def sight(params: Params) -> Sight:
    """Return a view all round, up to the interaction range inclusive."""
    return Sight(params.interaction_range, inclusive=True)


@jit
def _pull(
    params: Params, others: Flock, own: Flock, i: int, work: Workspace, found: int
) -> tuple[float, float]:
    """Return the sum of a_ij (v_j - v_i) over `found` neighbours of boid `i`, Eq. (1).

    With weights `mean` the sum is divided by the number of boids.
    """
    sigma2, near = params.decay_length * params.decay_length, work.near
    for k in range(whole(found)):  # a vectorised loop without sums
        near.factor[k] = power(sigma2 + near.distance2[k], -params.exponent)
    x, y = 0.0, 0.0
    for k in range(found):
        x += near.factor[k] * (others.vx[near.boid[k]] - own.vx[i])
        y += near.factor[k] * (others.vy[near.boid[k]] - own.vy[i])
    share = 1.0 / others.x.size if params.weights == MEAN else 1.0
    return params.strength * share * x, params.strength * share * y


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

    The update is the flock of the paper in discrete time. The position is
    x(t + h) = x(t) + h v(t), with the velocity from before the step. The velocity is
    v_i(t + h) = v_i(t) + h times the pull. If h times the sum of the weights of a boid
    is at most 1, the new velocity is a mean of old velocities.

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
    own, dt = own_of(flock, work), params.dt
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            range2 = square_range(robot.interaction_range, True)
            found = search(
                others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            ax, ay = _pull(robot, others, own, i, work, found)
            way_x, way_y = flock.vx[i], flock.vy[i]
            vx, vy = way_x + ax * dt, way_y + ay * dt
            vx, vy = drive(work, i, way_x, way_y, vx, vy)
            x, vx = confine(flock.x[i] + way_x * dt, vx, world.width, world.borders)
            y, vy = confine(flock.y[i] + way_y * dt, vy, world.height, world.borders)
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = x, y, vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


MODEL = Model(
    name="cucker_smale2007",
    source="F. Cucker, S. Smale (2007), Emergent behavior in flocks",
    params=Params,
    presets={
        "as_written": AS_WRITTEN,
        "as_run": AS_WRITTEN,
        "conditional": CONDITIONAL,
    },
    metrics=("polarization", "speed", "flock_radius"),
    sight=sight,
    advance=advance,
    symmetries={
        "translation": {},
        "rotation": {},
        "quarter_turn": {},
        "reflection": {},
        "permutation": {},
    },
    length="l",
    time="t",
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
    equations=r"""
In each step, boid $i$ with position $\mathbf{x}_i$ and velocity $\mathbf{v}_i$ aligns
its velocity and moves:

$$\mathbf{x}_i \leftarrow \mathbf{x}_i + h\,\mathbf{v}_i, \qquad
\mathbf{v}_i \leftarrow \mathbf{v}_i + h\,\mathbf{a}_i$$

The displacement uses the velocity before the step.

**Alignment** (Eq. 1) is a weighted sum of velocity differences:

$$\mathbf{a}_i = \sum_{j \in N_i} a_{ij} \left( \mathbf{v}_j - \mathbf{v}_i \right)$$

The weight decreases with the distance:

$$a_{ij} = \frac{K}{c}
\left( \sigma^2 + |\mathbf{x}_i - \mathbf{x}_j|^2 \right)^{-\beta}$$

In the paper $c = 1$ (`weights: sum`). With `weights: mean`, $c$ is the number of boids
of the swarm.

$N_i$ is the set of other boids within the interaction range of boid $i$, range
inclusive and in all directions. The interaction range is infinite in the paper. The
model has no speed limit and no noise.

With `update: synchronous`, all boids use the states before the step. With
`update: sequential`, later boids use the new states of earlier boids.
""",
)
