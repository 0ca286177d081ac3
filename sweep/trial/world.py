"""The world of a trial, drawn from its job, for whoever shows it."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.moving import given_velocities, place_along, velocities_of
from kernels.settings import Places, WorldSettings
from kernels.shapes import Obstacle, Obstacles, Polygon, boxes_of, shapes_of
from sweep.design.jobs import Job
from sweep.spec.settings import settings_of, settings_tuple
from sweep.trial.kinds import kinds_of
from sweep.trial.robots import keys_of
from sweep.trial.scenery import obstacles


class Paths(NamedTuple):
    """How obstacles move: `velocities` (2, M), the time of a step, and whether they
    wrap round the world; else they are mirrored at its borders.
    """

    velocities: NDArray[np.float64]
    dt: float
    wraps: bool


class TrialWorld(NamedTuple):
    """The size of a trial's world, and its obstacles (M, 5) as kernels.worlds has them.

    A row is x and y of a centre, half width, half height, and 1 for a disc or 0 for a
    rectangle. That of a polygon is the rectangle about it, of an arena the world;
    `polygons` are these, by their rows. `goal` is x and y of the goal and the radius
    about it, None where no boid seeks it, and `next_goals` where boids go from there
    on, one after the other. Lengths are in the model's unit; `y_down` says that y
    points down. `kinds` are those of its boids, as `kinds_of` has them. Where obstacles
    move, they are where they begin, and `paths` are theirs.
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
        """The world with its obstacles where they are after so many steps."""
        if self.paths is None:
            return self
        rows, (velocities, dt, wraps) = self.obstacles.copy(), self.paths
        for axis, length in enumerate((self.width, self.height)):
            ways = velocities[axis] * (step * dt)
            pairs = zip(rows[:, axis].tolist(), ways.tolist(), strict=True)
            rows[:, axis] = [place_along(*pair, length, wraps) for pair in pairs]
        off = rows - self.obstacles
        moved = {
            number: one._replace(
                vertices=tuple(
                    (x + off[number, 0], y + off[number, 1]) for x, y in one.vertices
                )
            )
            for number, one in self.polygons.items()
        }
        return self._replace(obstacles=rows, polygons=moved, paths=None)

    @property
    def shapes(self) -> tuple[Obstacle, ...]:
        """The obstacles one by one, as kernels.shapes has them."""
        rows = enumerate(shapes_of(self.obstacles))
        return tuple(self.polygons.get(number, row) for number, row in rows)

    @property
    def goals(self) -> Places:
        """All goals that boids seek, in turn."""
        return (self.goal[:2], *self.next_goals) if self.goal else ()


def world_of(job: Job) -> TrialWorld:
    """The world in which the trial of `job` runs."""
    settings, model = job.settings, job.known.models[job.model]
    known = settings_of(job.model, job.known)
    params = settings_tuple(model.params, settings, known)
    width, height, x, y, radius = (
        float(settings[name])
        for name in ("width", "height", "goal_x", "goal_y", "goal_radius")
    )
    drawn = shapes_of(obstacles(job))
    sought = model.seeks_goal(params, int(settings["n"]))
    return TrialWorld(
        width,
        height,
        boxes_of(drawn, width, height),
        (x, y, radius) if sought else None,
        model.y_down,
        kinds_of(job),
        settings_tuple(WorldSettings, settings, known).next_goals if sought else (),
        {number: one for number, one in enumerate(drawn) if isinstance(one, Polygon)},
        _paths(job, drawn),
    )


def _paths(job: Job, drawn: Obstacles) -> Paths | None:
    """How the obstacles of a trial move; None where none does."""
    speed = float(job.settings["obstacle_speed"])
    given = given_velocities(drawn, speed)
    if given is None:
        return None
    velocities = velocities_of(given, speed, keys_of(job).made)
    wraps = job.settings["borders"] == "torus"
    return Paths(velocities, float(job.settings["dt"]), wraps)
