"""The scenery of a trial, drawn from its job. Trials on the same map share it."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.coverage import Coverage, build_coverage, unvisited
from kernels.flight import Scenery, build_scenery
from kernels.model import OccupancySettings
from kernels.models import MODELS
from kernels.settings import Observation, WorldSettings
from kernels.worlds import MAPS
from sweep.design.jobs import Job, stream
from sweep.spec.maps import Obstacles
from sweep.spec.settings import settings_of, settings_tuple


def obstacles(job: Job) -> NDArray[np.float64]:
    """The obstacles of the trial's world, shape (M, 5), see kernels.worlds."""
    settings: WorldSettings = settings_tuple(
        WorldSettings, job.settings, settings_of(job.model)
    )
    return _obstacles(
        settings, job.obstacles, np.random.default_rng(stream(job, "world"))
    )


def _obstacles(
    settings: WorldSettings, own: Obstacles | None, rng: np.random.Generator
) -> NDArray[np.float64]:
    return (
        MAPS[settings.map].draw(settings, rng)
        if own is None
        else np.array(own).reshape(-1, 5)
    )


def _is_drawn_anew(job: Job) -> bool:
    return job.obstacles is None and MAPS[str(job.settings["map"])].random


def scenery_of(job: Job, params: Any, settings: WorldSettings) -> Scenery:
    """The world of `settings` and `params`, which are those of the job."""
    model = MODELS[job.model]
    reach = model.obstacle_reach(params)
    grid = model.occupancy(params) if model.occupancy else None
    if _is_drawn_anew(job):
        return build_scenery(settings, obstacles(job), reach, grid)
    return _fixed_scenery(settings, job.obstacles, reach, grid)


@lru_cache(maxsize=16)
def _fixed_scenery(
    settings: WorldSettings,
    own: Obstacles | None,
    reach: float = 0.0,
    grid: OccupancySettings | None = None,
) -> Scenery:
    drawn = _obstacles(settings, own, np.random.default_rng(0))
    return build_scenery(settings, drawn, reach, grid)


def coverage_of(
    job: Job, settings: WorldSettings, observation: Observation, scenery: Scenery
) -> Coverage:
    """The pixels of the job's scenery, with nothing visited."""
    if _is_drawn_anew(job):
        return build_coverage(scenery.world, scenery.contact, observation)
    return unvisited(_fixed_coverage(settings, observation, job.obstacles))


@lru_cache(maxsize=4)
def _fixed_coverage(
    settings: WorldSettings, observation: Observation, own: Obstacles | None
) -> Coverage:
    scenery = _fixed_scenery(settings, own)
    return build_coverage(scenery.world, scenery.contact, observation)
