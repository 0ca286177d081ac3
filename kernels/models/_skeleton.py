"""A model to copy: boids that seek the mean position of those they see, and nothing
else.

Copy this file, rename the model and enter it in `kernels.models.MODELS`. The file of a
model holds four things and no more: its `Params`, one preset per published version,
`sight`, and `advance`. What else there is to say of a model are fields of `Model`.
"""

from typing import Annotated, NamedTuple

from numpy.random import Generator

from kernels.arbitration import limit
from kernels.jit import jit
from kernels.model import Model, Sight
from kernels.neighbours import cone, move, move_all, search, square_range
from kernels.recording import Record, observe
from kernels.rules.borders import confine
from kernels.rules.social import cohesion
from kernels.settings import COMMON, SEQUENTIAL, UPDATE, About
from kernels.state import Flock, World, remember
from kernels.workspace import Workspace


class Params(NamedTuple):
    """Every number of the paper that a study may want to change, each with what it
    means, its unit and its range.

    Names that other models have too (`cohesion_weight`, `fov`, `max_speed`, `update`,
    `dt`) mean the same here. A setting that is the weight of a rule names it as `rule`;
    the page draws what each rule does.
    """

    cohesion_weight: Annotated[
        float,
        About(
            "strength of the pull towards the others",
            "1/time^2",
            low=0,
            rule="cohesion",
        ),
    ]
    perception_range: Annotated[
        float, About("radius within which others are seen", "length", low=0)
    ]
    fov: Annotated[
        float,
        About(
            "field of view, the whole cone about the velocity",
            "degrees",
            low=0,
            high=360,
        ),
    ]
    max_acceleration: Annotated[
        float, About("longest acceleration", "length/time^2", low=0)
    ]
    max_speed: Annotated[float, About("upper limit of the speed", "length/time", low=0)]
    update: Annotated[int, UPDATE]
    dt: Annotated[float, About("time of one update", "time", low=0, exclusive=True)]


AS_WRITTEN = COMMON | {
    "cohesion_weight": 0.01,
    "perception_range": 50.0,
    "fov": 360.0,
    "max_acceleration": 0.5,
    "max_speed": 5.0,
    "update": "synchronous",
    "n": 100,
    "steps": 500,
    "dt": 1.0,
    "map": "empty",
    "width": 800.0,
    "height": 600.0,
    "borders": "torus",
    "start_speed": 3.0,
}
AS_RUN = AS_WRITTEN | {"fov": 270.0, "update": "sequential"}


def sight(params: Params) -> Sight:
    """Whom a boid sees: up to which distance, px, and in which field of view."""
    return Sight(params.perception_range, params.fov)


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
    """Advance `flock` by `steps` updates; return False after the first step that is not
    finite.

    `seen` is what boids react to: the flock itself in a sequential update, a copy from
    before the step otherwise. In a sequential update the grid is told of every move at
    once, otherwise of all moves after the step. Every model writes this loop out,
    because papers differ in it and a reader must see how.
    """
    sequential = params.update == SEQUENTIAL
    range2 = square_range(params.perception_range, False)
    view = cone(params.fov)
    seen = flock if sequential else work.before
    for _ in range(steps):
        remember(flock, seen)
        for i in range(flock.x.size):
            found = search(
                seen,
                world,
                work.grid,
                i,
                range2,
                view,
                seen.vx[i],
                seen.vy[i],
                work.near,
            )
            x, y = cohesion(work.near, found, range2)
            ax, ay = limit(
                params.cohesion_weight * x,
                params.cohesion_weight * y,
                params.max_acceleration,
            )
            vx, vy = limit(
                flock.vx[i] + ax * params.dt,
                flock.vy[i] + ay * params.dt,
                params.max_speed,
            )
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
    name="skeleton",
    source="A. Author (year), title of the document",
    params=Params,
    presets={"as_written": AS_WRITTEN, "as_run": AS_RUN},
    metrics=("speed", "polarization", "flock_count"),
    sight=sight,
    advance=advance,
)
