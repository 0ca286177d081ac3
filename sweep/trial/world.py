"""The world of a trial, drawn from its job, for display."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.coverage import coverage_shape
from kernels.moving import given_velocities, place_along, velocities_of
from kernels.settings import Places, WorldSettings
from kernels.shapes import Obstacle, Obstacles, Polygon, boxes_of, shapes_of
from sweep.design import Job
from sweep.spec import settings_of, settings_tuple
from sweep.trial.kinds import kinds_of
from sweep.trial.robots import keys_of
from sweep.trial.scenery import obstacles


class Paths(NamedTuple):
    """Motion of M obstacles.

    Attributes
    ----------
    velocities : array of float, shape (2, M)
    dt : float
        Time step.
    wraps : bool
        Whether obstacles wrap around the world; otherwise the borders reflect
        obstacles.
    """

    velocities: NDArray[np.float64]
    dt: float
    wraps: bool


class TrialWorld(NamedTuple):
    """World of a trial with M obstacles; lengths are in the model's unit.

    Attributes
    ----------
    width, height : float
    obstacles : array of float, shape (M, 5)
        x and y of the centre, half-width, half-height, and 1 for a disc or 0 for a
        rectangle. The row of a polygon is the bounding box, and the row of an arena is
        the world. Moving obstacles are at their initial positions.
    goal : tuple of float, optional
        x and y of the goal, and the radius of the goal; None without boids that
        seek the goal.
    y_down : bool
        Whether y points down.
    kinds : mapping of int
        Number of boids of each type, see `kinds_of`.
    next_goals : Places
        x and y of the further goals, in order.
    polygons : mapping of Polygon
        Polygons and arenas, by row.
    paths : Paths, optional
        Motion of the obstacles; None if obstacles rest.
    """

    width: float
    height: float
    obstacles: NDArray[np.float64]
    goal: tuple[float, float, float] | None = None
    y_down: bool = True
    kinds: Mapping[str, int] = MappingProxyType({})
    next_goals: Places = ()
    polygons: Mapping[int, Polygon] = MappingProxyType({})
    paths: Paths | None = None

    def at(self, step: int) -> "TrialWorld":
        """Return the world with the positions of obstacles after a step."""
        if self.paths is None:
            return self
        rows = self.obstacles.copy()
        velocities, dt, wraps = self.paths
        for axis, length in enumerate((self.width, self.height)):
            ways = velocities[axis] * (step * dt)
            pairs = zip(rows[:, axis].tolist(), ways.tolist(), strict=True)
            rows[:, axis] = [place_along(*pair, length, wraps) for pair in pairs]
        off = rows - self.obstacles
        moved = {
            number: polygon._replace(
                vertices=tuple(
                    (x + off[number, 0], y + off[number, 1])
                    for x, y in polygon.vertices
                )
            )
            for number, polygon in self.polygons.items()
        }
        return self._replace(obstacles=rows, polygons=moved, paths=None)

    @property
    def shapes(self) -> tuple[Obstacle, ...]:
        """Obstacles as shapes, see kernels.shapes."""
        rows = enumerate(shapes_of(self.obstacles))
        return tuple(self.polygons.get(number, row) for number, row in rows)

    @property
    def goals(self) -> Places:
        """All goals that boids seek, in order."""
        return (self.goal[:2], *self.next_goals) if self.goal else ()


def world_of(job: Job) -> TrialWorld:
    """Return the world of a trial."""
    settings = job.settings
    model = job.catalogue.models[job.model]
    described = settings_of(job.model, job.catalogue)
    params = settings_tuple(model.params, settings, described)
    width, height, x, y, radius = (
        float(settings[name])
        for name in ("width", "height", "goal_x", "goal_y", "goal_radius")
    )
    drawn = shapes_of(obstacles(job))
    sought = model.seeks_goal(params, int(settings["n"]))
    next_goals = settings_tuple(WorldSettings, settings, described).next_goals
    return TrialWorld(
        width,
        height,
        boxes_of(drawn, width, height),
        goal=(x, y, radius) if sought else None,
        y_down=model.y_down,
        kinds=kinds_of(job),
        next_goals=next_goals if sought else (),
        polygons={
            number: shape
            for number, shape in enumerate(drawn)
            if isinstance(shape, Polygon)
        },
        paths=_paths(job, drawn),
    )


def pixels_of(job: Job) -> tuple[int, int, float]:
    """Return the rows and columns of the pixels of a world, and the side of a pixel."""
    width, height, pixel = (
        float(job.settings[name]) for name in ("width", "height", "pixel")
    )
    return *coverage_shape(width, height, pixel), pixel


def _paths(job: Job, drawn: Obstacles) -> Paths | None:
    """Return the motion of the obstacles of a trial; None if none moves."""
    speed = float(job.settings["obstacle_speed"])
    partial = given_velocities(drawn, speed)
    if partial is None:
        return None
    velocities = velocities_of(partial, speed, keys_of(job).made)
    wraps = job.settings["borders"] == "torus"
    return Paths(velocities, float(job.settings["dt"]), wraps)
