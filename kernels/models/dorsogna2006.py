"""Self-propelled boids that attract and repel boids by a potential.

M. R. D'Orsogna, Y. L. Chuang, A. L. Bertozzi, L. S. Chayes (2006), Self-propelled
particles with soft-core interactions: patterns, stability, and collapse, Physical
Review Letters 96, 104302. Lengths, times and masses are dimensionless in the paper.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.elementary import exp, expm1
from kernels.indices import whole
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.near import Near
from kernels.neighbours import (
    ALL_ROUND,
    move,
    move_all,
    search,
    square_range,
)
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.sensing import others_of, publish
from kernels.rules.borders import confine
from kernels.settings import (
    COMMON,
    INTERACTION_RANGE,
    SEQUENTIAL,
    TIME_STEP,
    UPDATE,
    About,
    Demand,
    InParts,
)
from kernels.state import Flock, World
from kernels.workspace import Workspace

TINY = 1e-300


class Params(NamedTuple):
    """Constants of Eqs. (1) to (3)."""

    propulsion: Annotated[
        float,
        About(
            "strength of the self-propulsion (Eq. 2); a slow boid accelerates at the"
            " rate propulsion / mass",
            "1/time",
            low=0,
            symbol=r"\alpha",
        ),
    ]
    friction: Annotated[
        float,
        About(
            "coefficient of the friction (Eq. 2), in time/length^2; the speed of a"
            " free boid tends to sqrt(propulsion / friction)",
            low=0,
            symbol=r"\beta",
        ),
    ]
    mass: Annotated[
        float, About("mass of a boid (Eq. 2)", low=0, exclusive=True, symbol="m")
    ]
    repulsion_strength: Annotated[
        float,
        About(
            "height of the repulsive potential (Eq. 3)",
            "length^2/time^2",
            low=0,
            symbol="C_r",
        ),
    ]
    repulsion_length: Annotated[
        float,
        About(
            "decay length of the repulsive potential (Eq. 3)",
            "length",
            low=0,
            exclusive=True,
            symbol=r"\ell_r",
        ),
    ]
    attraction_strength: Annotated[
        float,
        About(
            "depth of the attractive potential (Eq. 3)",
            "length^2/time^2",
            low=0,
            symbol="C_a",
        ),
    ]
    attraction_length: Annotated[
        float,
        About(
            "decay length of the attractive potential (Eq. 3)",
            "length",
            low=0,
            exclusive=True,
            symbol=r"\ell_a",
        ),
    ]
    interaction_range: Annotated[float, INTERACTION_RANGE]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP, InParts("time")]


AS_WRITTEN = COMMON | {
    "propulsion": 1.6,
    "friction": 0.5,
    "mass": 1.0,
    "repulsion_strength": 0.5,
    "repulsion_length": 0.5,
    "attraction_strength": 1.0,
    "attraction_length": 1.0,
    "interaction_range": math.inf,
    "update": "synchronous",
    "n": 40,
    "steps": 20_000,
    "dt": 0.01,
    "map": "empty",
    "width": 20.0,
    "height": 20.0,
    "goal_x": 10.0,
    "goal_y": 10.0,
    "start_velocities": "components",
    "start_speed": 1.0,
    "start_margin": 8.0,
    "flock_range": 1.0,
    "goal_radius": 1.0,
    "obstacle_radius": 0.5,
    "obstacle_margin": 1.0,
    "contact_distance": 0.01,
    "pixel": 0.1,
}
"""C = C_r / C_a = 0.5 and l = l_r / l_a = 0.5: rings; boids circle in two directions.

The world has no borders, and boids start within a square of side 4 in the middle of the
world. There is no program of the authors, so as_run equals as_written.
"""
MILL = AS_WRITTEN | {
    "repulsion_strength": 1.0,
    "attraction_strength": 0.5,
    "attraction_length": 2.0,
    "n": 100,
}
"""C = 2 and l = 0.25: a mill with a hole in the middle."""


def sight(params: Params) -> Sight:
    """Return a view all round, up to the interaction range inclusive."""
    return Sight(params.interaction_range, inclusive=True)


@jit
def _force(params: Params, near: Near, found: int) -> tuple[float, float]:
    """Return the sum of -grad U over the `found` neighbours in `near`.

    The potential is U(r) = C_r exp(-r / l_r) - C_a exp(-r / l_a), Eq. (3). A neighbour
    at the same position has no direction and adds nothing.
    """
    push = params.repulsion_strength / params.repulsion_length
    pull = params.attraction_strength / params.attraction_length
    push_rate = -1.0 / params.repulsion_length
    pull_rate = -1.0 / params.attraction_length
    for k in range(whole(found)):  # a vectorised loop without sums
        distance = math.sqrt(near.distance2[k])
        slope = pull * exp(pull_rate * distance)
        slope -= push * exp(push_rate * distance)
        near.factor[k] = slope / distance if distance > 0.0 else 0.0
    x, y = 0.0, 0.0
    for k in range(found):
        x += near.factor[k] * near.dx[k]
        y += near.factor[k] * near.dy[k]
    return x, y


@jit
def _pacing(params: Params, dt: float) -> tuple[float, float]:
    """Return `decay` and `brake` of `_paced` for half a step of length `dt`."""
    rate = params.propulsion / params.mass
    grown = -expm1(-rate * dt) / rate if rate > 0.0 else dt
    return exp(-rate * dt), params.friction / params.mass * grown


@jit
def _paced(vx: float, vy: float, decay: float, brake: float) -> tuple[float, float]:
    """Return a velocity after a time of propulsion and friction.

    The solution of m v' = (alpha - beta |v|^2) v is v / sqrt(D + B |v|^2). After the
    time t, `decay` D is exp(-2 alpha t / m), and `brake` B is beta (1 - D) / alpha. The
    speed sqrt(alpha / beta) does not change. D is at least TINY, so that boids at rest
    stay at rest after any time.
    """
    share = 1.0 / math.sqrt(max(decay, TINY) + brake * (vx * vx + vy * vy))
    return share * vx, share * vy


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

    Eqs. (1) and (2), x' = v and m v' = (alpha - beta |v|^2) v - grad U, by leapfrog.
    Propulsion acts for half a step, then the force at the position for a whole step,
    then propulsion for the second half. Then the boid moves by v dt. So velocities are
    half a step behind positions, and the error of a path is of the order of dt^2.

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
    others, dt = others_of(flock, work, sequential), params.dt
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            range2 = square_range(robot.interaction_range, True)
            found = search(
                others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near
            )
            ax, ay = _force(robot, work.near, found)
            decay, brake = _pacing(robot, dt)
            vx, vy = _paced(flock.vx[i], flock.vy[i], decay, brake)
            vx, vy = vx + ax / robot.mass * dt, vy + ay / robot.mass * dt
            vx, vy = _paced(vx, vy, decay, brake)
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
    name="dorsogna2006",
    source=(
        "M. R. D'Orsogna, Y. L. Chuang, A. L. Bertozzi, L. S. Chayes (2006),"
        " Self-propelled particles with soft-core interactions: patterns, stability,"
        " and collapse"
    ),
    params=Params,
    presets={"as_written": AS_WRITTEN, "as_run": AS_WRITTEN, "mill": MILL},
    metrics=("speed", "flock_radius", "dispersion", "angular_momentum"),
    sight=sight,
    advance=advance,
    symmetries={
        "translation": {},
        "rotation": {},
        "quarter_turn": {},
        "reflection": {},
        "permutation": {},
    },
    demands=(
        Demand(
            "propulsion * dt <= mass",
            "a boid gets up its speed in the time mass / propulsion, and dt must be no"
            " longer",
        ),
    ),
    length="l",
    time="t",
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
    equations=r"""
Boid $i$ with position $\mathbf{x}_i$ and velocity $\mathbf{v}_i$ follows the equations
of motion (Eqs. 1 and 2):

$$\frac{d\mathbf{x}_i}{dt} = \mathbf{v}_i, \qquad
m \frac{d\mathbf{v}_i}{dt} = \left( \alpha - \beta |\mathbf{v}_i|^2 \right) \mathbf{v}_i
- \nabla U(\mathbf{x}_i)$$

**Interaction potential** (Eq. 3), with the distance
$r_{ij} = |\mathbf{x}_j - \mathbf{x}_i|$:

$$U(\mathbf{x}_i) = \sum_{j \in N_i} \left( C_r\,e^{-r_{ij} / \ell_r}
- C_a\,e^{-r_{ij} / \ell_a} \right)$$

$N_i$ is the set of other boids within the interaction range of boid $i$, range
inclusive and in all directions. The interaction range is infinite in the paper. The
force is the negative gradient:

$$\mathbf{F}_i = \sum_{j \in N_i} \left( \frac{C_a}{\ell_a} e^{-r_{ij} / \ell_a}
- \frac{C_r}{\ell_r} e^{-r_{ij} / \ell_r} \right)
\frac{\mathbf{x}_j - \mathbf{x}_i}{r_{ij}}$$

A neighbour at the same position exerts no force.

**Propulsion and friction** alone have an exact solution. After half a time step the
velocity is $P(\mathbf{v}_i)$:

$$P(\mathbf{v}) = \frac{\mathbf{v}}{\sqrt{D + B |\mathbf{v}|^2}}, \qquad
D = e^{-\alpha \Delta t / m}, \qquad
B = \frac{\beta}{\alpha} \left( 1 - D \right)$$

Without propulsion ($\alpha = 0$), $B$ is $\beta \Delta t / m$.

**Time step** (leapfrog). Propulsion acts for half a step, the force for a whole step,
and propulsion for the other half. The boid then moves with the new velocity:

$$\mathbf{v}_i \leftarrow P\left( P(\mathbf{v}_i) + \frac{\mathbf{F}_i}{m} \Delta t
\right), \qquad
\mathbf{x}_i \leftarrow \mathbf{x}_i + \mathbf{v}_i\,\Delta t$$

The paper gives the continuous equations. The model has no speed limit and no noise.

With `update: synchronous`, all boids use the states before the step. With
`update: sequential`, later boids use the new states of earlier boids.
""",
)
