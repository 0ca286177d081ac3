"""A dog that collects stray sheep and drives the herd to a goal.

D. Strombom, R. P. Mann, A. M. Wilson, S. Hailes, A. J. Morton, D. J. T. Sumpter, A. J.
King (2014), Solving the shepherding problem: heuristics for herding autonomous,
interacting agents, Journal of the Royal Society Interface 11, 20140719. Only the
abstract was available. Equations and numbers are the equations and numbers on which
five programs agree. The programs are HerdSim, which names sections of the paper,
shepherd_gym and a program of A. Sheets in Python, and a program in MATLAB of the
Theoretical Ecology and Evolution laboratory. The fifth program is a later program of
Strombom for leading and herding.

If the programs differ, a parameter selects the version, or the version is in this list:

- a dog within three times r_a of a sheep stops (HerdSim, Strombom), or is slow (Sheets:
  0.3 r_a per step): `near_speed`
- the directions of the dog are noisy like the directions of sheep (HerdSim, MATLAB), or
  exact (remaining programs): `dog_noise`
- the task is done when all sheep are at the goal (HerdSim), or when the centre of the
  sheep is at the goal (shepherd_gym): `done_when`. The radius of the goal differs in
  all programs.
- a grazing sheep is at rest or takes a step in a random direction (HerdSim). In the
  program of Sheets this step also follows the inertia and separation of the sheep.
- all boids are updated at once (MATLAB), or the sheep before the dog (HerdSim):
  `update`
- the border is open, as in all programs but HerdSim
- a dog that perceives only some sheep uses their number as N: no program has this case

Directions come from arithmetic alone, so trials are bitwise identical with any
mathematics library.
"""

import math
from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import (
    ALL_ROUND,
    move,
    move_all,
    search,
    square_range,
)
from kernels.recording import STEP, Record, observe
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

CENTRE = 1
TASK_TIME = 0
"""Index of the state row."""
EVERYONE = 10_000_000


class Params(NamedTuple):
    """Parameters of Table 1, and choices in which the programs differ."""

    repulsion_range: Annotated[
        float,
        About(
            "distance below which sheep repel each other", "length", low=0, symbol="r_a"
        ),
    ]
    detection_range: Annotated[
        float,
        About(
            "distance from the dog up to which a sheep flees; farther sheep graze",
            "length",
            low=0,
            symbol="r_s",
        ),
    ]
    attraction_nearest: Annotated[
        int,
        About(
            "number of nearest sheep whose centre of mass attracts a fleeing sheep; all"
            " others if there are fewer",
            "boids",
            low=1,
            high=EVERYONE,
            symbol="n",
        ),
    ]
    interaction_range: Annotated[
        float,
        About(
            "distance up to which sheep and the dog perceive sheep; infinite in the"
            " paper",
            "length",
            low=0,
            symbol="R",
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
        float, About("weight of the attraction to the nearest sheep", low=0, symbol="c")
    ]
    flight_strength: Annotated[
        float, About("weight of the escape from the dog", low=0, symbol=r"\rho_s")
    ]
    noise: Annotated[
        float,
        About(
            "weight of the random direction in the heading of a sheep",
            low=0,
            symbol="e",
        ),
    ]
    graze_probability: Annotated[
        float,
        About(
            "probability that a grazing sheep moves in a step",
            low=0,
            high=1,
            symbol="p",
        ),
    ]
    sheep_speed: Annotated[
        float, About("speed of a moving sheep", "length/time", low=0, symbol=r"\delta")
    ]
    dog_speed: Annotated[
        float, About("speed of the dog", "length/time", 0, symbol=r"\delta_s")
    ]
    near_distance: Annotated[
        float,
        About(
            "distance from a sheep below which the dog has near_speed; three times"
            " repulsion_range in the paper",
            "length",
            0,
            symbol=r"d_{\mathrm{near}}",
        ),
    ]
    near_speed: Annotated[
        float,
        About(
            "speed of the dog near a sheep; at 0 the dog stops",
            "length/time",
            0,
            symbol=r"\delta_{\mathrm{near}}",
        ),
    ]
    dog_noise: Annotated[
        float,
        About(
            "weight of the random direction in the heading of the dog",
            low=0,
            symbol="e_s",
        ),
    ]
    dog_nearest: Annotated[
        int,
        About(
            "number of nearest sheep that the dog perceives; all if there are fewer",
            "boids",
            low=1,
            high=EVERYONE,
            symbol="n_s",
        ),
    ]
    done_when: Annotated[
        int,
        About(
            "condition that ends the task, after which all boids are at rest: all_sheep"
            " at the goal, or the centre of mass of the sheep",
            choices=("all_sheep", "centre"),
        ),
    ]
    target_radius: Annotated[
        float,
        About(
            "distance from the goal below which a sheep, or the centre of mass, is at"
            " the goal",
            "length",
            0,
            symbol=r"r_{\mathrm{goal}}",
        ),
    ]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, TIME_STEP]


AS_WRITTEN = COMMON | {
    "repulsion_range": 2.0,
    "detection_range": 65.0,
    "attraction_nearest": 49,
    "interaction_range": math.inf,
    "inertia": 0.5,
    "repulsion_strength": 2.0,
    "attraction_strength": 1.05,
    "flight_strength": 1.0,
    "noise": 0.3,
    "graze_probability": 0.05,
    "sheep_speed": 1.0,
    "dog_speed": 1.5,
    "near_distance": 6.0,
    "near_speed": 0.0,
    "dog_noise": 0.3,
    "dog_nearest": EVERYONE,
    "done_when": "all_sheep",
    "target_radius": 20.0,
    "update": "synchronous",
    "n": 51,
    "steps": 1650,
    "dt": 1.0,
    "map": "empty",
    "width": 150.0,
    "height": 150.0,
    "goal_x": 0.0,
    "goal_y": 0.0,
    "start_speed": 1.0,
    "start_draws": "opposite",
    "flock_range": 10.0,
    "goal_radius": 20.0,
    "obstacle_radius": 2.0,
    "obstacle_margin": 10.0,
    "contact_distance": 0.1,
}
"""50 sheep, each attracted to all sheep, and a dog, in a field of side 150.

The sheep start in the upper right quarter and the dog in the lower left quarter, with
the goal in the lower left corner. The time of 20 steps per boid and 630 more steps is
from other studies. The radius of the goal is a choice of boidsweep. There is no program
of the authors, so as_run equals as_written.
"""


def sight(params: Params) -> Sight:
    """Return a view all round, up to the interaction range inclusive."""
    return Sight(params.interaction_range, inclusive=True)


def _count_kinds(_params: Params, n: int) -> tuple[int, int]:
    """Return the numbers of sheep and dogs; the last boid is the one dog."""
    return n - 1, 1


@jit
def _way(own: Flock, world: World, i: int, x: float, y: float) -> tuple[float, float]:
    """Return the displacement from boid `i` to (x, y)."""
    dx, dy = x - own.x[i], y - own.y[i]
    if world.minimum_image:
        dx, dy = nearest_image(dx, world.width), nearest_image(dy, world.height)
    return dx, dy


@jit
def _is_done(flock: Flock, world: World, params: Params) -> bool:
    """Return whether all sheep, or the centre of the sheep, are at the goal.

    `done_when` selects the condition. Without any sheep the task is never done.
    """
    sheep = flock.x.size - 1
    reach2 = params.target_radius * params.target_radius
    x, y, there = 0.0, 0.0, 0
    for i in range(sheep):
        dx, dy = _way(flock, world, i, world.goal_x, world.goal_y)
        there += int(dx * dx + dy * dy < reach2)
        x += dx
        y += dy
    if params.done_when == CENTRE:
        return sheep > 0 and x * x + y * y < reach2 * sheep * sheep
    return 0 < sheep == there


@jit
def _grazing(params: Params, rng: Generator) -> tuple[float, float]:
    """Return the velocity of a sheep that is far from the dog."""
    if rng.random() >= params.graze_probability:
        return 0.0, 0.0
    x, y = random_turn(rng, math.tau)
    return params.sheep_speed * x, params.sheep_speed * y


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

    If the dog is within r_s, the velocity is along a sum of unit vectors,
    h H + c C + rho_a R_a + rho_s R_s + e epsilon. H is the heading of the last move.
    C points to the centre of mass of the nearest sheep. R_a is along the sum of the
    unit vectors away from sheep within r_a. R_s points away from the dog. The direction
    of epsilon is random.
    """
    dog = others.x.size - 1
    dog_x, dog_y = _way(own, world, i, others.x[dog], others.y[dog])
    reach = params.detection_range
    is_far = dog_x * dog_x + dog_y * dog_y > reach * reach
    if is_far or not hears_of(work.near.senses, world, i, dog):
        return _grazing(params, rng)
    near = work.near
    range2 = square_range(params.interaction_range, True)
    found = search(others, world, work.grid, i, range2, ALL_ROUND, 0.0, 0.0, work.near)
    found -= int(found > 0 and near.boid[found - 1] == dog)
    crowd2 = params.repulsion_range * params.repulsion_range
    away_x, away_y, to_x, to_y = 0.0, 0.0, 0.0, 0.0
    for k in range(found):
        if near.distance2[k] < crowd2:
            x, y = direction(near.dx[k], near.dy[k], 0.0, 0.0)
            away_x -= x
            away_y -= y
    for k in range(keep_nearest(near, found, params.attraction_nearest)):
        to_x += near.dx[k]
        to_y += near.dy[k]
    own_x, own_y = direction(own.vx[i], own.vy[i], 0.0, 0.0)
    away_x, away_y = direction(away_x, away_y, 0.0, 0.0)
    to_x, to_y = direction(to_x, to_y, 0.0, 0.0)
    flight_x, flight_y = direction(-dog_x, -dog_y, 0.0, 0.0)
    x, y = random_turn(rng, math.tau)
    x = params.noise * x + params.inertia * own_x + params.attraction_strength * to_x
    y = params.noise * y + params.inertia * own_y + params.attraction_strength * to_y
    x += params.repulsion_strength * away_x + params.flight_strength * flight_x
    y += params.repulsion_strength * away_y + params.flight_strength * flight_y
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

    If a sheep is farther than f(N) = r_a N^(2/3) from the centre of mass of the sheep,
    the dog collects the farthest sheep. The dog then goes to a point r_a behind the
    farthest sheep. If not, the dog goes to a point r_a sqrt(N) behind the centre, seen
    from the goal, to drive the herd. Without any sheep the dog keeps its direction.
    """
    dog, near = others.x.size - 1, work.near
    range2 = square_range(params.interaction_range, True)
    found = search(
        others, world, work.grid, dog, range2, ALL_ROUND, 0.0, 0.0, work.near
    )
    found = keep_nearest(near, found, params.dog_nearest)
    speed, aim_x, aim_y = params.dog_speed, own.vx[dog], own.vy[dog]
    if found > 0:
        aim_x, aim_y, nearest2 = _aim(params, own, world, work, found)
        if nearest2 < params.near_distance * params.near_distance:
            speed = params.near_speed
    aim_x, aim_y = direction(aim_x, aim_y, 0.0, 0.0)
    x, y = random_turn(rng, math.tau)
    x, y = aim_x + params.dog_noise * x, aim_y + params.dog_noise * y
    x, y = direction(x, y, aim_x, aim_y)
    return speed * x, speed * y


@jit
def _aim(
    params: Params, own: Flock, world: World, work: Workspace, found: int
) -> tuple[float, float, float]:
    """Return the displacement from the dog to its target, and a squared distance.

    The last number is the square of the distance to the nearest of the `found` sheep in
    `work.near`, at least one.
    """
    near, dog = work.near, own.x.size - 1
    x, y, nearest2 = 0.0, 0.0, math.inf
    for k in range(found):
        x += near.dx[k] / found
        y += near.dy[k] / found
        nearest2 = min(nearest2, near.distance2[k])
    farthest, far2 = 0, -1.0
    for k in range(found):
        dx, dy = near.dx[k] - x, near.dy[k] - y
        if dx * dx + dy * dy > far2:
            farthest, far2 = k, dx * dx + dy * dy
    behind, count = params.repulsion_range, float(found)
    # The sixth powers of the two distances need no library function.
    square = behind * behind
    if far2 * far2 * far2 > square * square * square * (count * count * count * count):
        dx, dy = near.dx[farthest], near.dy[farthest]
        way_x, way_y = direction(dx - x, dy - y, 0.0, 0.0)
        return dx + behind * way_x, dy + behind * way_y, nearest2
    goal_x, goal_y = _way(own, world, dog, world.goal_x, world.goal_y)
    way_x, way_y = direction(x - goal_x, y - goal_y, 0.0, 0.0)
    behind *= math.sqrt(count)
    return x + behind * way_x, y + behind * way_y, nearest2


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

    Once the task is done, the commanded velocity of all boids is zero, and boids draw
    no random numbers.

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
    sequential, dog = params.update == SEQUENTIAL, flock.x.size - 1
    others, own = others_of(flock, work, sequential), own_of(flock, work)
    dt = params.dt
    done = _is_done(flock, world, params)
    for _ in range(steps):
        publish(flock, others, work)
        for i in range(flock.x.size):
            robot = params_of(params, work, i)
            vx, vy = 0.0, 0.0
            if not done and i == dog:
                vx, vy = _dog_velocity(robot, others, own, world, work, rng)
            elif not done:
                vx, vy = _sheep_velocity(robot, others, own, world, work, i, rng)
            vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)
            x, vx = confine(flock.x[i] + vx * dt, vx, world.width, world.borders)
            y, vy = confine(flock.y[i] + vy * dt, vy, world.height, world.borders)
            flock.x[i], flock.y[i], flock.vx[i], flock.vy[i] = x, y, vx, vy
            if sequential:
                move(work.grid, i, x, y)
        if not sequential:
            move_all(work.grid, flock)
        done = done or _is_done(flock, world, params)
        if done and work.state[TASK_TIME, dog] == 0.0:
            for i in range(flock.x.size):
                work.state[TASK_TIME, i] = (record.progress[STEP] + 1) * dt
        if not observe(flock, world, record):
            return False
    return True


STILL = {
    "noise": 0.0,
    "dog_noise": 0.0,
    "graze_probability": 0.0,
}
"""Parameters without randomness in the results."""

MODEL = Model(
    name="strombom2014",
    source=(
        "D. Strombom, R. P. Mann, A. M. Wilson, S. Hailes, A. J. Morton, D. J. T."
        " Sumpter, A. J. King (2014), Solving the shepherding problem: heuristics for"
        " herding autonomous, interacting agents"
    ),
    params=Params,
    presets={
        "as_written": AS_WRITTEN,
        "as_run": AS_WRITTEN,
        "slow_near": AS_WRITTEN | {"near_speed": 0.6},
        "local_dog": AS_WRITTEN | {"dog_nearest": 20},
    },
    metrics=("herded", "herd_radius", "herd_goal_distance", "dog_offset"),
    sight=sight,
    advance=advance,
    symmetries={
        "translation": STILL | {"dog_speed": 0.0, "target_radius": 0.0},
        "rotation": STILL,
        "quarter_turn": STILL,
        "reflection": STILL,
        "permutation": STILL,
    },
    state={"task_time": About("when the task was done; 0 before", "time")},
    kinds=("sheep", "dog"),
    count_kinds=_count_kinds,
    demands=(Demand("n >= 2", "there is a dog and at least one sheep: n must be 2"),),
    length="m",
    time="step",
    y_down=False,
    publishes=True,
    drives=True,
    goals_in_turn=False,
    shared=("target_radius", "dt"),
    equations=r"""
The last boid is the dog, and all others are sheep. In each step, boid $i$ with position
$x_i$ chooses a velocity $v_i$ and moves:

$$x_i \leftarrow x_i + v_i\,\Delta t$$

Only the abstract of the paper was available. The equations come from other programs.
The direction of a vector is

$$U(f) = \frac{f}{|f|}, \qquad U(0) = 0$$

All random directions $\hat{\varepsilon}$ are independent unit vectors with a uniform
angle. $x_d$ is the position of the dog.

**Grazing:** A sheep farther than $r_s$ from the dog moves with probability $p$, with
$v_i = \delta\,\hat{\varepsilon}_i$. Otherwise the sheep is at rest, with $v_i = 0$.

**Fleeing:** A sheep at most $r_s$ from the dog sums five directions:

$$f_i = h\,H_i + c\,C_i + \rho_a A_i + \rho_s F_i + e\,\hat{\varepsilon}_i, \qquad
v_i \leftarrow \delta\,U(f_i)$$

If $f_i$ is zero, $H_i$ replaces $U(f_i)$. Only other sheep at most $R$ from sheep $i$
act on sheep $i$. $M_i$ are the $n$ nearest sheep, or all if there are fewer. The lower
index decides between equal distances. $N_i$ are the sheep nearer than $r_a$.

**Inertia** $H_i = U(v_i)$ is the direction of the previous velocity, and zero after a
step at rest.

**Attraction** points to the centre of mass of the nearest sheep:

$$C_i = U\left( \sum_{j \in M_i} (x_j - x_i) \right)$$

**Repulsion** points away from near sheep:

$$A_i = U\left( \sum_{j \in N_i} U(x_i - x_j) \right)$$

**Escape** $F_i = U(x_i - x_d)$ points away from the dog.

**Dog:** The dog perceives the $n_s$ nearest sheep at most $R$ away, or all if there are
fewer. $N$ is the number of perceived sheep, and $G$ the centre of mass. Sheep $m$ is
the perceived sheep farthest from $G$. The dog collects sheep $m$ if the distance
$|x_m - G|$ exceeds $r_a N^{2/3}$. Otherwise the dog drives the herd to the goal $g$.
The target of the dog is

$$T = \begin{cases}
x_m + r_a\,U(x_m - G) & |x_m - G| > r_a N^{2/3} \\
G + r_a \sqrt{N}\,U(G - g) & \mathrm{otherwise}
\end{cases}$$

$$v_d \leftarrow s\,U\left( U(T - x_d) + e_s\,\hat{\varepsilon}_d \right)$$

The speed $s$ is $\delta_{\mathrm{near}}$ if a perceived sheep is nearer than
$d_{\mathrm{near}}$, otherwise $\delta_s$. If the sum is zero, the dog moves in the
direction of $T$. If the dog perceives no sheep, $U(v_d)$ replaces $U(T - x_d)$.

**End:** The task is done when all sheep are nearer than $r_{\mathrm{goal}}$ to the
goal. With `done_when: centre`, the centre of mass of all sheep must be nearer than
$r_{\mathrm{goal}}$. From then on, all boids have the velocity zero. The state
`task_time` of all boids is 0 at first, and then the time of the end.

**Update:** With `update: synchronous`, all boids react to the state before the step.
With `update: sequential`, boids move in turn, the dog last, and later boids perceive
the new states of earlier boids.

**Start:** In the presets, sheep begin in the quarter of the world with the greatest $x$
and $y$. The dog begins in the opposite quarter. Positions and headings are uniformly
random.
""",
)
