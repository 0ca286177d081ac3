"""What obstacles that move need of a model and of what is recorded."""

import numpy as np

from kernels.shapes import velocity_of
from sweep.design.points import Points
from sweep.design.published_steps import check_published
from sweep.spec.document import Place
from sweep.spec.mistakes import Mistakes
from sweep.spec.study import Study


def check_obstacles(study: Study, points: Points) -> None:
    """Raise SpecError where obstacles move, and the model does not let them, or what is
    recorded would mean nothing, or one goes round the world within a step.
    """
    if place := _moving(study, points):
        mistakes = Mistakes()
        what = "that begins its steps with `publish`"
        mistakes.read(check_published, study, "a moving obstacle", what, place)
        mistakes.read(_check_looks, study, place)
        mistakes.read(_check_way, study, points)
        mistakes.check()


def _check_looks(study: Study, place: Place) -> None:
    """Raise SpecError for a model that looks at a grid of the start, and for what is
    counted by pixels.
    """
    model = study.known.models[study.model]
    if model.occupancy:
        raise study.document.error(
            place,
            "a moving obstacle needs a model that looks at it, and"
            f" {model.name} looks at an occupancy grid, which is that of the start",
        )
    names = [
        *(name for name in study.record.metrics if study.known.metrics[name].covers),
        *(["heatmaps"] if study.record.heatmaps else []),
    ]
    if names:
        raise study.document.error(
            place,
            "where obstacles move no visits can be counted by pixels, which would be"
            f" free for a while or not at all: leave {', '.join(names)} out of what is"
            " recorded",
        )


def _check_way(study: Study, points: Points) -> None:
    """Raise SpecError where an obstacle goes round the world within one step: it acts
    where it is then, and what it has passed meets nobody.
    """
    dt, maps = points.column("dt"), points.column("map")
    width, height = points.column("width"), points.column("height")
    speed = points.column("obstacle_speed")
    with np.errstate(over="ignore"):
        way = speed * dt
    ways = [("obstacle_speed", way > np.minimum(width, height))]
    for name, own in study.maps.items():
        velocities = [velocity_of(one) or (0.0, 0.0) for one in own.obstacles]
        vx, vy = np.abs(np.array(velocities).reshape(-1, 2)).max(axis=0, initial=0.0)
        ways.append((name, (maps == name) & ((vx * dt > width) | (vy * dt > height))))
    for name, far in ways:
        if far.any():
            where = points.describe(int(np.argmax(far)), ("dt", "width", "height"))
            raise study.document.error(
                ("maps", name) if name in study.maps else study.place_of(name) or (),
                "an obstacle moves farther in one step than the world is wide or high"
                f"{where}: {name} needs lower velocities, or a shorter step",
            )


def _moving(study: Study, points: Points) -> Place:
    """Where the spec says that obstacles move; () where none does."""
    if (points.column("obstacle_speed") > 0.0).any():
        return study.place_of("obstacle_speed") or ("model",)
    for name in dict.fromkeys(points.column("map").tolist()):
        own = study.maps.get(str(name))
        if own and any(any(velocity_of(one) or ()) for one in own.obstacles):
            return "maps", str(name)
    return ()
