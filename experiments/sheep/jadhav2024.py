"""A dog that drives sheep, which also align with each other.

V. Jadhav, R. Pasqua, C. Zanon, M. Roy, G. Tredan, R. Bon, V. Guttal, G. Theraulaz
(2024), Collective responses of flocking sheep (Ovis aries) to a herding dog (border
collie), Communications Biology 7, 1543. The model changes the model of Strombom et al.
(2014), see strombom2014. Rules and numbers are those of the authors' program in MATLAB,
`herding_model.m`, but for the sum of headings. The text of the paper was not available.

The program sums the headings of the aligning sheep by `sum` without a dimension. For
one sheep, which the program has, `sum` adds the two components of the heading. The sign
of this number is then added to both components: sheep are pushed along (1, 1) or
(-1, -1). The preset as_run has this rule, and as_written has the sum of headings.

The model differs from strombom2014 in these rules:

- a sheep is attracted to a random choice of its nearest sheep, and sums directions to
  the chosen sheep, not their positions
- a sheep aligns with one of the chosen sheep
- a sheep far from the dog has no random steps, but still repels near sheep
- a dog near a sheep is slow, and keeps its heading
- no event ends the task

Directions come from arithmetic alone, so trials are bitwise identical with any
mathematics library.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.near import Near
from kernels.neighbours import ALL_ROUND, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.robots.actuation import drive
from kernels.robots.differing import params_of
from kernels.robots.hearing import hears_of
from kernels.robots.sensing import others_of, own_of, publish
from kernels.rules.borders import confine
from kernels.rules.headings import direction, random_turn
from kernels.settings import COMMON, SEQUENTIAL, TIME_STEP, UPDATE, About, Demand
from kernels.state import Flock, World
from kernels.topology import keep_nearest
from kernels.torus import nearest_image
from kernels.workspace import Workspace

COMPONENTS = 1
EVERYONE = 10_000_000


class Params(NamedTuple):
    """Parameters of the authors' program."""

    repulsion_range: Annotated[
        float,
        About(
            "distance below which sheep repel each other, and up to which the dog is"
            " near a sheep",
            "length",
            low=0,
            symbol="r_a",
        ),
    ]
    detection_range: Annotated[
        float,
        About(
            "distance from the dog up to which a sheep flees", "length", 0, symbol="r_d"
        ),
    ]
    interaction_range: Annotated[
        float,
        About(
            "distance up to which sheep and the dog perceive sheep; infinite in the"
            " program",
            "length",
            low=0,
            symbol="R",
        ),
    ]
    attraction_nearest: Annotated[
        int,
        About(
            "number of nearest sheep from which a fleeing sheep chooses; all others if"
            " there are fewer",
            "boids",
            low=1,
            high=EVERYONE,
            symbol="K",
        ),
    ]
    attraction_chosen: Annotated[
        int,
        About(
            "number of randomly chosen sheep that attract a fleeing sheep",
            "boids",
            low=1,
            high=EVERYONE,
            symbol="k",
        ),
    ]
    alignment_chosen: Annotated[
        int,
        About(
            "number of the chosen sheep with whose headings a fleeing sheep aligns",
            "boids",
            low=1,
            high=EVERYONE,
            symbol="m",
        ),
    ]
    alignment_sum: Annotated[
        int,
        About(
            "direction of the alignment. headings: along the sum of the headings;"
            " components: (1, 1) or (-1, -1) by the sign of the sum of all components,"
            " as in the program for one aligning sheep",
            choices=("headings", "components"),
        ),
    ]
    inertia: Annotated[
        float, About("weight of the previous heading of a sheep", low=0, symbol="h")
    ]
    repulsion_strength: Annotated[
        float,
        About("weight of the repulsion from other sheep", low=0, symbol=r"\rho_a"),
    ]
    attraction_strength: Annotated[
        float, About("weight of the attraction to the chosen sheep", low=0, symbol="c")
    ]
    alignment_strength: Annotated[
        float, About("weight of the alignment", low=0, symbol=r"\alpha")
    ]
    flight_strength: Annotated[
        float, About("weight of the escape from the dog", low=0, symbol=r"\rho_d")
    ]
    noise: Annotated[
        float,
        About(
            "weight of the random direction in the heading of a fleeing sheep",
            low=0,
            symbol="e",
        ),
    ]
    sheep_speed: Annotated[
        float, About("speed of a moving sheep", "length/time", low=0, symbol="v_s")
    ]
    dog_speed: Annotated[
        float, About("speed of the dog", "length/time", 0, symbol="v_d")
    ]
    near_speed: Annotated[
        float,
        About(
            "speed of the dog near a sheep",
            "length/time",
            0,
            symbol=r"v_{\mathrm{near}}",
        ),
    ]
    dog_noise: Annotated[
        float,
        About(
            "weight of the random direction in the heading of the dog",
            low=0,
            symbol="e_d",
        ),
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP]


AS_WRITTEN = COMMON | {
    "repulsion_range": 2.0,
    "detection_range": 12.0,
    "interaction_range": math.inf,
    "attraction_nearest": 10,
    "attraction_chosen": 4,
    "alignment_chosen": 1,
    "alignment_sum": "headings",
    "inertia": 0.5,
    "repulsion_strength": 2.0,
    "attraction_strength": 1.5,
    "alignment_strength": 1.3,
    "flight_strength": 1.0,
    "noise": 0.3,
    "sheep_speed": 1.0,
    "dog_speed": 1.5,
    "near_speed": 0.05,
    "dog_noise": 0.3,
    "update": "synchronous",
    "n": 15,
    "steps": 369,
    "dt": 1.0,
    "map": "empty",
    "width": 600.0,
    "height": 600.0,
    "goal_x": 300.0,
    "goal_y": 300.0,
    "start_speed": 1.0,
    "start_draws": "around_goal",
    "start_center_x": 550.0,
    "start_center_y": 300.0,
    "start_radius": 3.0,
    "flock_range": 5.0,
    "goal_radius": 20.0,
    "obstacle_radius": 2.0,
    "obstacle_margin": 10.0,
    "contact_distance": 0.1,
}
"""14 sheep and a dog, 250 from the goal, in 370 frames.

In the program, sheep start in a square of side 6, and the dog in a square of side 36
with the same corner. Here concentric discs with the diameters 6 and 36 replace the
squares, so the dog starts nearer. The direction from the goal is random in both.
"""
AS_RUN = AS_WRITTEN | {"alignment_sum": "components"}
"""The program as it runs, with its sum of headings."""


def sight(params: Params) -> Sight:
    """Return a view all round, up to the interaction range inclusive."""
    return Sight(params.interaction_range, inclusive=True)


def _count_kinds(_params: Params, n: int) -> tuple[int, int]:
    """Return the numbers of sheep and dogs; the last boid is the one dog."""
    return n - 1, 1


@jit
def _displacement(
    own: Flock, world: World, i: int, x: float, y: float
) -> tuple[float, float]:
    """Return the displacement from boid `i` to (x, y)."""
    dx = x - own.x[i]
    dy = y - own.y[i]
    if world.minimum_image:
        dx = nearest_image(dx, world.width)
        dy = nearest_image(dy, world.height)
    return dx, dy


@jit
def _heading(flock: Flock, work: Workspace, i: int) -> tuple[float, float]:
    """Return the heading of a boid, or the last heading of a boid at rest."""
    return direction(flock.vx[i], flock.vy[i], work.heading_x[i], work.heading_y[i])


@jit
def _remember_headings(flock: Flock, work: Workspace) -> None:
    """Keep the headings of moving boids, for boids that come to rest."""
    for i in range(flock.x.size):
        work.heading_x[i], work.heading_y[i] = _heading(flock, work, i)


@jit
def _repulsion(near: Near, found: int, reach: float) -> tuple[float, float]:
    """Return the unit vector along the sum of the unit vectors away from near sheep."""
    x = 0.0
    y = 0.0
    for k in range(found):
        if near.distance2[k] < reach * reach:
            to_x, to_y = direction(near.dx[k], near.dy[k], 0.0, 0.0)
            x -= to_x
            y -= to_y
    return direction(x, y, 0.0, 0.0)


@jit
def _choose(near: Near, found: int, count: int, rng: Generator) -> int:
    """Move up to `count` random neighbours to the front; return their number."""
    chosen = min(found, count)
    for k in range(chosen):
        other = k + int(rng.random() * (found - k))
        boid = near.boid[k]
        dx = near.dx[k]
        dy = near.dy[k]
        near.boid[k] = near.boid[other]
        near.dx[k] = near.dx[other]
        near.dy[k] = near.dy[other]
        near.boid[other] = boid
        near.dx[other] = dx
        near.dy[other] = dy
    return chosen


@jit
def _sheep_velocity(
    params: Params,
    others: Flock,
    own: Flock,
    world: World,
    work: Workspace,
    i: int,
    rng: Generator,
) -> tuple[float, float]:
    """Return the velocity of sheep `i`.

    If the dog is within r_d, the velocity is along a sum of unit vectors, h H + rho_a R
    + rho_d F + c C + alpha A + e epsilon. H is the heading of the last move. R points
    away from near sheep, and F away from the dog. C is along the sum of the directions
    to the chosen sheep, and A along the sum of the headings of the aligning ones. The
    direction of epsilon is random. Without the dog, only H and R count, and a sheep
    without near sheep is at rest.
    """
    dog = others.x.size - 1
    near = work.near
    dog_x, dog_y = _displacement(own, world, i, others.x[dog], others.y[dog])
    reach2 = params.detection_range * params.detection_range
    flees = dog_x * dog_x + dog_y * dog_y <= reach2
    flees = flees and hears_of(near.senses, world, i, dog)
    range2 = square_range(params.interaction_range, True)
    found = search(others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, near)
    found -= int(found > 0 and near.boid[found - 1] == dog)
    own_x, own_y = _heading(own, work, i)
    away_x, away_y = _repulsion(near, found, params.repulsion_range)
    x = params.inertia * own_x + params.repulsion_strength * away_x
    y = params.inertia * own_y + params.repulsion_strength * away_y
    if not flees:
        if away_x == 0.0 and away_y == 0.0:
            return 0.0, 0.0
        x, y = direction(x, y, own_x, own_y)
        return params.sheep_speed * x, params.sheep_speed * y
    found = keep_nearest(near, found, params.attraction_nearest)
    found = _choose(near, found, params.attraction_chosen, rng)
    to_x = 0.0
    to_y = 0.0
    with_x = 0.0
    with_y = 0.0
    for k in range(found):
        unit_x, unit_y = direction(near.dx[k], near.dy[k], 0.0, 0.0)
        to_x += unit_x
        to_y += unit_y
        if k < params.alignment_chosen:
            unit_x, unit_y = _heading(others, work, int(near.boid[k]))
            with_x += unit_x
            with_y += unit_y
    to_x, to_y = direction(to_x, to_y, 0.0, 0.0)
    if params.alignment_sum == COMPONENTS:
        total = with_x + with_y
        with_x = float(int(total > 0.0) - int(total < 0.0))
        with_y = with_x
    else:
        with_x, with_y = direction(with_x, with_y, 0.0, 0.0)
    flight_x, flight_y = direction(-dog_x, -dog_y, 0.0, 0.0)
    random_x, random_y = random_turn(rng, math.tau)
    x += params.flight_strength * flight_x + params.attraction_strength * to_x
    y += params.flight_strength * flight_y + params.attraction_strength * to_y
    x += params.alignment_strength * with_x + params.noise * random_x
    y += params.alignment_strength * with_y + params.noise * random_y
    x, y = direction(x, y, own_x, own_y)
    return params.sheep_speed * x, params.sheep_speed * y


@jit
def _dog_velocity(
    params: Params,
    others: Flock,
    own: Flock,
    world: World,
    work: Workspace,
    rng: Generator,
) -> tuple[float, float]:
    """Return the velocity of the dog, which perceives N sheep.

    Up to r_a from a sheep, the dog is slow and keeps its heading. Otherwise the dog
    collects the farthest sheep if this sheep is at least r_a N^(2/3) from the centre of
    mass of the sheep, and else drives the herd. The target is a point r_a behind the
    farthest sheep, or r_a sqrt(N) behind the centre, seen from the goal. Without any
    sheep the dog keeps its direction.
    """
    dog = own.x.size - 1
    near = work.near
    own_x, own_y = _heading(own, work, dog)
    range2 = square_range(params.interaction_range, True)
    found = search(others, world, work.grid, dog, range2, ALL_ROUND, 0.0, 0.0, near)
    centre_x = 0.0
    centre_y = 0.0
    nearest2 = math.inf
    for k in range(found):
        centre_x += near.dx[k] / found
        centre_y += near.dy[k] / found
        nearest2 = min(nearest2, near.distance2[k])
    behind = params.repulsion_range
    if nearest2 <= behind * behind:
        return params.near_speed * own_x, params.near_speed * own_y
    target_x = own_x
    target_y = own_y
    if found > 0:
        farthest = 0
        farthest2 = -1.0
        for k in range(found):
            dx = near.dx[k] - centre_x
            dy = near.dy[k] - centre_y
            if dx * dx + dy * dy > farthest2:
                farthest = k
                farthest2 = dx * dx + dy * dy
        count = float(found)
        # The sixth powers of the two distances need no library function.
        limit = behind * behind * behind * count * count
        if farthest2 * farthest2 * farthest2 >= limit * limit:
            target_x = near.dx[farthest]
            target_y = near.dy[farthest]
            away_x, away_y = direction(
                target_x - centre_x, target_y - centre_y, 0.0, 0.0
            )
        else:
            goal_x, goal_y = _displacement(own, world, dog, world.goal_x, world.goal_y)
            target_x = centre_x
            target_y = centre_y
            away_x, away_y = direction(centre_x - goal_x, centre_y - goal_y, 0.0, 0.0)
            behind *= math.sqrt(count)
        target_x += behind * away_x
        target_y += behind * away_y
    target_x, target_y = direction(target_x, target_y, 0.0, 0.0)
    random_x, random_y = random_turn(rng, math.tau)
    x = target_x + params.dog_noise * random_x
    y = target_y + params.dog_noise * random_y
    x, y = direction(x, y, target_x, target_y)
    return params.dog_speed * x, params.dog_speed * y


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
    dog = flock.x.size - 1
    others = others_of(flock, work, sequential)
    own = own_of(flock, work)
    dt = params.dt
    for _ in range(steps):
        publish(flock, others, work)
        _remember_headings(flock, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            if i == dog:
                vx, vy = _dog_velocity(robot, others, own, world, work, rng)
            else:
                vx, vy = _sheep_velocity(robot, others, own, world, work, i, rng)
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, vx = confine(flock.x[i] + vx * dt, vx, world.width, world.borders)
            y, vy = confine(flock.y[i] + vy * dt, vy, world.height, world.borders)
            flock.x[i] = x
            flock.y[i] = y
            flock.vx[i] = vx
            flock.vy[i] = vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


STILL = {
    "noise": 0.0,
    "dog_noise": 0.0,
    "attraction_chosen": EVERYONE,
    "alignment_sum": "headings",
}
"""Parameters without randomness in the results."""

MODEL = Model(
    name="jadhav2024",
    source=(
        "V. Jadhav, R. Pasqua, C. Zanon, M. Roy, G. Tredan, R. Bon, V. Guttal, G."
        " Theraulaz (2024), Collective responses of flocking sheep (Ovis aries) to a"
        " herding dog (border collie), Communications Biology 7, 1543"
    ),
    params=Params,
    presets={"as_written": AS_WRITTEN, "as_run": AS_RUN},
    metrics=("herd_radius", "dog_distance", "herd_goal_distance"),
    sight=sight,
    advance=advance,
    symmetries={
        "translation": STILL | {"dog_speed": 0.0},
        "rotation": STILL | {"alignment_chosen": EVERYONE},
        "quarter_turn": STILL | {"alignment_chosen": EVERYONE},
        "reflection": STILL | {"alignment_chosen": EVERYONE},
        "permutation": STILL | {"alignment_chosen": EVERYONE},
    },
    kinds=("sheep", "dog"),
    count_kinds=_count_kinds,
    demands=(Demand("n >= 2", "there is a dog and at least one sheep: n must be 2"),),
    length="m",
    time="step",
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("dt",),
    equations=r"""
The last boid is the dog, and all others are sheep. In each step, boid $i$ with position
$x_i$ chooses a velocity $v_i$ and moves:

$$x_i \leftarrow x_i + v_i\,\Delta t$$

The equations are those of the authors' program. The direction of a vector is

$$U(f) = \frac{f}{|f|}, \qquad U(0) = 0$$

All random directions $\hat{\varepsilon}$ are independent unit vectors with a uniform
angle. $x_d$ is the position of the dog, and $H_i$ the direction of the last velocity of
boid $i$ that was not zero.

Sheep and the dog perceive only sheep that are at most $R$ away.

**Repulsion** points away from the set $N_i$ of sheep nearer than $r_a$:

$$R_i = U\left( \sum_{j \in N_i} U(x_i - x_j) \right)$$

**A sheep farther than $r_d$ from the dog** is at rest if $R_i = 0$. Otherwise

$$v_i \leftarrow v_s\,U\left( h\,H_i + \rho_a R_i \right)$$

**A sheep at most $r_d$ from the dog** flees:

$$v_i \leftarrow v_s\,U\left( h\,H_i + \rho_a R_i + \rho_d F_i + c\,C_i + \alpha A_i
+ e\,\hat{\varepsilon}_i \right), \qquad F_i = U(x_i - x_d)$$

$M_i$ are $k$ sheep, chosen at random in each step from the $K$ nearest sheep. $L_i$ are
$m$ of the sheep in $M_i$, at random. If there are fewer sheep, all are chosen.

$$C_i = U\left( \sum_{j \in M_i} U(x_j - x_i) \right), \qquad
A_i = U\left( \sum_{j \in L_i} H_j \right)$$

With `alignment_sum: components`, the program's sum, the sign of the sum of all
components of the headings is both components of $A_i$:

$$A_i = \mathrm{sgn}\left( \sum_{j \in L_i} (H_{j,x} + H_{j,y}) \right)\,(1,\; 1)$$

If the whole sum in $v_i$ is zero, $H_i$ replaces its direction.

**Dog:** If a sheep is at most $r_a$ away, $v_d \leftarrow v_{\mathrm{near}} H_d$.
Otherwise, with the centre of mass $G$ of the $N$ sheep, the sheep $f$ that is farthest
from $G$, and the goal $g$,

$$v_d \leftarrow v_d\,U\left( U(T - x_d) + e_d\,\hat{\varepsilon}_d \right), \qquad
T = \begin{cases}
x_f + r_a\,U(x_f - G) & |x_f - G| \ge r_a N^{2/3} \\
G + r_a \sqrt{N}\,U(G - g) & \mathrm{otherwise}
\end{cases}$$

If the sum is zero, the dog moves in the direction of $T$. If the dog perceives no
sheep, $H_d$ replaces $U(T - x_d)$.

**Update:** With `update: synchronous`, all boids react to the state before the step.
With `update: sequential`, boids move in turn, the dog last, and later boids perceive
the new states of earlier boids.

**Start:** In the presets, sheep begin in a disc of radius 3, and the dog in a disc of
radius 18 around the same centre. The centre is 250 from the goal in a random direction.
Positions and headings are uniformly random.
""",
)
