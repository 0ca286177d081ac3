"""The world of a trial, drawn from its job, for whoever shows it."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.settings import Places, WorldSettings
from sweep.design.jobs import Job
from sweep.spec.settings import settings_of, settings_tuple
from sweep.trial.kinds import kinds_of
from sweep.trial.scenery import obstacles


class TrialWorld(NamedTuple):
    """The size of a trial's world, and its obstacles (M, 5) as kernels.worlds has them.

    A row is x and y of a centre, half width, half height, and 1 for a disc or 0 for a
    rectangle. `goal` is x and y of the goal and the radius about it, None where no boid
    seeks it, and `next_goals` where boids go from there on, one after the other.
    Lengths are in the model's unit; `y_down` says that y points down. `kinds` are those
    of its boids, as `kinds_of` has them.
    """

    width: float
    height: float
    obstacles: NDArray[np.float64]
    goal: tuple[float, float, float] | None = None
    y_down: bool = True
    kinds: Mapping[str, int] = MappingProxyType({})
    next_goals: Places = ()

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
    sought = model.seeks_goal(params, int(settings["n"]))
    return TrialWorld(
        width,
        height,
        obstacles(job),
        (x, y, radius) if sought else None,
        model.y_down,
        kinds_of(job),
        settings_tuple(WorldSettings, settings, known).next_goals if sought else (),
    )
