"""A model with a fold: each boid goes along x with a velocity v, and
v' = field + v - v^3. It has two stable velocities between two turning points, and one
elsewhere. And the metric that shows it.
"""

from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.jit import jit
from kernels.metrics import Metric
from kernels.model import Model, Sight
from kernels.neighbours import move_all
from kernels.recording import Record, observe
from kernels.settings import COMMON, About
from kernels.state import Flock, World, remember
from kernels.workspace import Workspace


class Params(NamedTuple):
    """The field, and the time of a step."""

    field: Annotated[float, About("what drives boids to the right", "")]
    dt: Annotated[float, About("time of one update", "time", low=0, exclusive=True)]


STANDARD = (
    COMMON
    | {"field": 0.0, "dt": 0.1, "n": 3, "steps": 400, "map": "empty"}
    | {"width": 10.0, "height": 10.0, "start_speed": 0.0}
)


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
    """Take `steps` steps of Euler's method, whose equilibria are exact."""
    for _ in range(steps):
        remember(flock, work.before)
        for i in range(flock.x.size):
            v = flock.vx[i]
            flock.vx[i] = v + params.dt * (params.field + v - v * v * v)
            flock.vy[i] = 0.0
        move_all(work.grid, flock)
        if not observe(flock, world, record):
            return False
    return True


def sight(_params: Params) -> Sight:
    """Nobody sees anybody."""
    return Sight(1.0)


@jit
def rightwards(frames, filled, _ground, _observation, values):
    """Mean x component of the velocity."""
    for f in range(filled):
        total = 0.0
        for i in range(frames.bodies.shape[2]):
            total += frames.bodies[f, 2, i]
        values[f] = total / frames.bodies.shape[2]


MODEL = Model(
    name="fold",
    source="",
    params=Params,
    presets={"standard": STANDARD},
    metrics=("speed",),
    sight=sight,
    advance=advance,
    update_order="all boids at once",
)
METRICS = {
    "rightwards": Metric(
        rightwards, "length/time", "mean velocity to the right", "a test"
    )
}
