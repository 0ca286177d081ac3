"""Requirements of moving obstacles on a model and on the recorded metrics."""

import numpy as np

from kernels.shapes import velocity_of
from sweep.design.points import Points
from sweep.design.published_steps import check_published
from sweep.spec import Mistakes, Place, Study


def check_obstacles(study: Study, points: Points) -> None:
    """Raise SpecError if obstacles move, and the study does not support motion.

    The model must publish each step and look at obstacles directly. Visits cannot be
    counted by pixels, and no obstacle may cross the world within one step.
    """
    if place := _moving(study, points):
        mistakes = Mistakes()
        ability = "that begins its steps with `publish`"
        mistakes.read(check_published, study, "a moving obstacle", ability, place=place)
        mistakes.read(_check_looks, study, place)
        mistakes.read(_check_way, study, points)
        mistakes.check()


def _check_looks(study: Study, place: Place) -> None:
    """Raise SpecError for a model with an occupancy grid, and for counts by pixels."""
    model = study.catalogue.models[study.model]
    if model.occupancy:
        raise study.document.error(
            place,
            "a moving obstacle needs a model that looks at obstacles, but"
            f" {model.name} looks at an occupancy grid of the start",
        )
    names = [
        *(
            name
            for name in study.record.metrics
            if study.catalogue.metrics[name].covers
        ),
        *(["heatmaps"] if study.record.heatmaps else []),
    ]
    if names:
        raise study.document.error(
            place,
            "moving obstacles exclude counts of visits per pixel, because pixels are"
            f" not always free: leave {', '.join(names)} out of"
            " `record`",
        )


def _check_way(study: Study, points: Points) -> None:
    """Raise SpecError if an obstacle crosses the world within one step.

    An obstacle acts only at the position after the step, not on the way.
    """
    dt = points.column("dt")
    maps = points.column("map")
    width = points.column("width")
    height = points.column("height")
    speed = points.column("obstacle_speed")
    with np.errstate(over="ignore"):
        way = speed * dt
    ways = [("obstacle_speed", way > np.minimum(width, height))]
    for name, own in study.maps.items():
        velocities = [velocity_of(shape) or (0.0, 0.0) for shape in own.obstacles]
        vx, vy = np.abs(np.array(velocities).reshape(-1, 2)).max(axis=0, initial=0.0)
        ways.append((name, (maps == name) & ((vx * dt > width) | (vy * dt > height))))
    for name, far in ways:
        if far.any():
            where = points.describe(int(np.argmax(far)), ("dt", "width", "height"))
            raise study.document.error(
                ("maps", name) if name in study.maps else study.place_of(name) or (),
                "an obstacle moves farther in one step than the world is wide or high"
                f"{where}: {name} needs lower velocities, or a smaller dt",
            )


def _moving(study: Study, points: Points) -> Place:
    """Return the key of the spec that lets obstacles move, or ()."""
    if (points.column("obstacle_speed") > 0.0).any():
        return study.place_of("obstacle_speed") or ("model",)
    for name in dict.fromkeys(points.column("map").tolist()):
        own = study.maps.get(str(name))
        if own and any(any(velocity_of(shape) or ()) for shape in own.obstacles):
            return "maps", str(name)
    return ()
