"""The scenery of a trial, drawn from its job. Trials on the same map share it."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.coverage import Coverage, build_coverage, unvisited
from kernels.flight import Scenery, build_scenery
from kernels.model import OccupancySettings
from kernels.settings import Observation, WorldSettings
from kernels.worlds import Map
from sweep.design.jobs import Job, stream
from sweep.spec.maps import Obstacles
from sweep.spec.settings import settings_of, settings_tuple


def obstacles(job: Job) -> NDArray[np.float64]:
    """The obstacles of the trial's world, shape (M, 5), see kernels.worlds."""
    settings: WorldSettings = settings_tuple(
        WorldSettings, job.settings, settings_of(job.model, job.known)
    )
    rng = np.random.default_rng(stream(job, "world"))
    return _obstacles(settings, _map(job), rng)


def _map(job: Job) -> Map | Obstacles:
    """The map of a job that has code, or the obstacles that the spec brings."""
    if job.obstacles is not None:
        return job.obstacles
    return job.known.maps[str(job.settings["map"])]


def _obstacles(
    settings: WorldSettings, drawn: Map | Obstacles, rng: np.random.Generator
) -> NDArray[np.float64]:
    if isinstance(drawn, Map):
        found = np.asarray(drawn.draw(settings, rng), np.float64)
        if found.ndim != 2 or found.shape[1] != 5 or not np.isfinite(found).all():
            raise ValueError(
                f"map {settings.map} draws an array of shape {found.shape}: it must be"
                " (M, 5), of finite numbers"
            )
        return found
    return np.array(drawn).reshape(-1, 5)


def _is_drawn_anew(drawn: Map | Obstacles) -> bool:
    return isinstance(drawn, Map) and drawn.random


def scenery_of(job: Job, params: Any, settings: WorldSettings) -> Scenery:
    """The world of `settings` and `params`, which are those of the job."""
    model, drawn = job.known.models[job.model], _map(job)
    reach = model.obstacle_reach(params)
    grid = model.occupancy(params) if model.occupancy else None
    if _is_drawn_anew(drawn):
        return build_scenery(settings, obstacles(job), reach, grid)
    return _fixed_scenery(settings, drawn, reach, grid)


@lru_cache(maxsize=16)
def _fixed_scenery(
    settings: WorldSettings,
    drawn: Map | Obstacles,
    reach: float = 0.0,
    grid: OccupancySettings | None = None,
) -> Scenery:
    obstacles = _obstacles(settings, drawn, np.random.default_rng(0))
    return build_scenery(settings, obstacles, reach, grid)


def coverage_of(
    job: Job, settings: WorldSettings, observation: Observation, scenery: Scenery
) -> Coverage:
    """The pixels of the job's scenery, with nothing visited."""
    drawn = _map(job)
    if _is_drawn_anew(drawn):
        return build_coverage(scenery.world, scenery.contact, observation)
    return unvisited(_fixed_coverage(settings, observation, drawn))


@lru_cache(maxsize=4)
def _fixed_coverage(
    settings: WorldSettings, observation: Observation, drawn: Map | Obstacles
) -> Coverage:
    scenery = _fixed_scenery(settings, drawn)
    return build_coverage(scenery.world, scenery.contact, observation)
