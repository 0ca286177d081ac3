"""The scenery of a trial, the map of visits and the initial flock, drawn from its job.

Scenery, map and flock depend on few parameters and on random numbers: 48,000 trials of
a sweep may have 24 starts, each of which takes Python 0.3 ms. So a process caches
recent objects, by all values on which the objects depend. Cached objects must not
change. A trial has copies of the flock and of the visits, and no run changes the
scenery. Only trials of a batch share the pixels, because a batch has separate maps of
visits (kernels.lanes.marks). A copy for each trial would take 5 % of a short trial.
"""

from copy import copy
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.random import SeedSequence

from kernels.coverage import Coverage, build_coverage, unvisited
from kernels.flight import Scenery, build_scenery
from kernels.model import OccupancySettings
from kernels.settings import Observation, StartSettings, WorldSettings
from kernels.shapes import Obstacle, Obstacles, checked
from kernels.starts import Draw
from kernels.state import Flock
from kernels.worlds import Map
from sweep.design import Job, literal_seed, stream
from sweep.spec import settings_of, settings_tuple
from sweep.trial.generators import Randomness
from sweep.trial.last_flocks import flock_of

KEPT_BOIDS = 1000
"""Largest flock that is cached; larger flocks would need too much memory."""
KEPT_PIXELS = 2_000_000
"""Largest map of visits that is cached, in pixels."""


class Address(NamedTuple):
    """Beginning of a stream of random numbers, as the content of a SeedSequence."""

    entropy: int
    key: tuple[int, ...]

    @classmethod
    def of(cls, seed: SeedSequence) -> "Address":
        """Return the address of a seed sequence without spawned children."""
        assert isinstance(seed.entropy, int)
        return cls(seed.entropy, tuple(seed.spawn_key))

    @property
    def seed(self) -> SeedSequence:
        """Seed sequence at the address."""
        return SeedSequence(self.entropy, spawn_key=self.key)


NOTHING_RANDOM = Address(0, ())


@dataclass(frozen=True, eq=False)
class Site:
    """Inputs of a world: parameters, map, and the random numbers that draw the world.

    Two sites are equal only if they are one object. So maps with thousands of obstacles
    are not compared repeatedly.
    """

    settings: WorldSettings
    drawn: Map | tuple[Obstacle, ...]
    random: Address

    def obstacles(self) -> Obstacles:
        """Return the obstacles, see kernels.shapes."""
        if not isinstance(self.drawn, Map):
            return self.drawn
        rng = np.random.default_rng(self.random.seed)
        return checked(self.drawn.draw(self.settings, rng), self.settings.map)


@dataclass(frozen=True)
class Landscape:
    """Site with its scenery for one model.

    All landscapes of one site are equal, because they share the world.
    """

    site: Site
    scenery: Scenery = field(compare=False)


def obstacles(job: Job) -> Obstacles:
    """Draw and return the obstacles of a trial's world, see kernels.shapes.

    A map gets the random numbers of the job, even if the map declares that it is not
    random.
    """
    settings: WorldSettings = settings_tuple(
        WorldSettings, job.settings, settings_of(job.model, job.catalogue)
    )
    return Site(settings, _map(job), Address.of(stream(job, "world"))).obstacles()


def _map(job: Job) -> Map | tuple[Obstacle, ...]:
    """Return the map of a job that has code, or the obstacles in the spec."""
    if job.obstacles is not None:
        return job.obstacles
    return job.catalogue.maps[str(job.settings["map"])]


def is_drawn(job: Job) -> bool:
    """Return whether random numbers draw the obstacles of a job."""
    drawn = _map(job)
    return isinstance(drawn, Map) and drawn.random


def landscape_of(job: Job, params: Any, settings: WorldSettings) -> Landscape:
    """Return the world of a job.

    Parameters
    ----------
    job : Job
    params : NamedTuple
        Parameters of the model of the job.
    settings : WorldSettings
        Parameters of the world of the job.

    Returns
    -------
    Landscape
    """
    model = job.catalogue.models[job.model]
    random = Address.of(stream(job, "world")) if is_drawn(job) else NOTHING_RANDOM
    site = _site(settings, _map(job), random)
    grid = model.occupancy(params) if model.occupancy else None
    return Landscape(site, _scenery(site, model.obstacle_reach(params), grid))


_site = lru_cache(maxsize=16)(Site)


@lru_cache(maxsize=16)
def _scenery(site: Site, reach: float, grid: OccupancySettings | None) -> Scenery:
    return build_scenery(site.settings, site.obstacles(), reach, grid)


def coverage_of(
    landscape: Landscape, observation: Observation, shared: bool = False
) -> Coverage:
    """Return the pixels of a world, without visits.

    Parameters
    ----------
    landscape : Landscape
    observation : Observation
        Parameters of the visits.
    shared : bool, default False
        Whether the pixels may be shared; then they may be read-only. The sums are
        always a copy.

    Returns
    -------
    Coverage
    """
    settings = landscape.site.settings
    if settings.width * settings.height > KEPT_PIXELS * observation.pixel**2:
        return _pixels(landscape, observation)
    pixels = _kept_pixels(landscape, observation)
    return pixels._replace(sums=pixels.sums.copy()) if shared else unvisited(pixels)


def _pixels(landscape: Landscape, observation: Observation) -> Coverage:
    scenery = landscape.scenery
    return build_coverage(scenery.world, scenery.contact, observation)


@lru_cache(maxsize=4)
def _kept_pixels(landscape: Landscape, observation: Observation) -> Coverage:
    pixels = _pixels(landscape, observation)
    pixels.visits.flags.writeable = False
    return pixels


def start_of(
    job: Job, landscape: Landscape, settings: StartSettings
) -> tuple[Flock, Randomness]:
    """Return a copy of the initial flock of a trial, and the stream of random numbers.

    Parameters
    ----------
    job : Job
    landscape : Landscape
        World of the job.
    settings : StartSettings
        Parameters of the start of the job.

    Returns
    -------
    flock : Flock
    random : Randomness
        The stream, after the flock was drawn.

    Raises
    ------
    RuntimeError
        If the flock of `job.parent` is missing, or has another number of boids or of
        state values. A start may raise further errors, such as RuntimeError if there is
        no free position.
    """
    if job.begins is not None:
        return flock_of(job, job.begins), Randomness(stream(job, "start"))
    if job.parent:
        raise RuntimeError(f"the final flock of trial {job.parent} is missing")
    inputs = _start_inputs(job, landscape, settings)
    if int(job.settings["n"]) > KEPT_BOIDS:
        return _start(*inputs)
    flock, random = _kept_start(*inputs)
    return Flock(*(array.copy() for array in flock)), copy(random)


def flock_drawn_now(job: Job) -> Flock:
    """Return the initial flock of a trial, without the cache."""
    if job.begins is not None:
        return flock_of(job, job.begins)
    described = settings_of(job.model, job.catalogue)
    params, world, settings = (
        settings_tuple(group, job.settings, described)
        for group in (
            job.catalogue.models[job.model].params,
            WorldSettings,
            StartSettings,
        )
    )
    landscape = landscape_of(job, params, world)
    flock, _ = _start(*_start_inputs(job, landscape, settings))
    return flock


StartInputs = tuple[Draw, int, StartSettings, Landscape, Address, int]


def _start_inputs(
    job: Job, landscape: Landscape, settings: StartSettings
) -> StartInputs:
    """Return the arguments of `_start`, on which the initial flock of a job depends."""
    return (
        job.catalogue.starts[str(job.settings["start_draws"])].of_replicate(
            job.replicate
        ),
        int(job.settings["n"]),
        settings,
        landscape,
        Address.of(stream(job, "start")),
        literal_seed(job, "start"),
    )


def _start(
    draw: Draw,
    n: int,
    settings: StartSettings,
    landscape: Landscape,
    address: Address,
    literal: int,
) -> tuple[Flock, Randomness]:
    random = Randomness(address.seed)
    world = (landscape.scenery.world, landscape.scenery.contact)
    with random.lent() as rng:
        # Authors of starts choose the names of parameters, so the call has none.
        flock = draw(n, settings, *world, *(rng, literal))
    return flock, random


_kept_start = lru_cache(maxsize=64)(_start)
