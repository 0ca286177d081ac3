"""The scenery of a trial, its map of visits and its flock at the start, drawn from its
job. Trials share what they have in common.

What is drawn depends on few settings and on the random numbers of its stream: 48,000
trials of a sweep may have 24 starts, each of which takes Python 0.3 ms. So a process
keeps what it has drawn last, by all that it depends on. What is kept nobody may
change: a trial has copies of the flock and of the visits, and no flight changes its
scenery. Only trials that fly together share the pixels, which have maps of their own
for visits (kernels.lanes.marks); a copy for each would take 5 % of a short trial.
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
from sweep.design.jobs import Job, literal_seed, stream
from sweep.spec.settings import settings_of, settings_tuple
from sweep.trial.generators import Randomness
from sweep.trial.last_flocks import flock_of

KEPT_BOIDS = 1000
"""The flocks of more boids are drawn anew for every trial: each would be large, and few
fit into the memory of a processor.
"""
KEPT_PIXELS = 2_000_000
"""The maps of more pixels are made anew for every trial."""


class Address(NamedTuple):
    """Where a stream of random numbers begins: the content of its SeedSequence."""

    entropy: int
    key: tuple[int, ...]

    @classmethod
    def of(cls, seed: SeedSequence) -> "Address":
        """The address of a seed sequence that has spawned nothing."""
        assert isinstance(seed.entropy, int)
        return cls(seed.entropy, tuple(seed.spawn_key))

    @property
    def seed(self) -> SeedSequence:
        """The seed sequence at the address."""
        return SeedSequence(self.entropy, spawn_key=self.key)


NOTHING_RANDOM = Address(0, ())


@dataclass(frozen=True, eq=False)
class Site:
    """All that a world depends on: its settings, its map, and the random numbers that
    draw it.

    Two are the same if they are one object, so that nobody compares maps of thousands
    of obstacles again and again.
    """

    settings: WorldSettings
    drawn: Map | tuple[Obstacle, ...]
    random: Address

    def obstacles(self) -> Obstacles:
        """The obstacles, see kernels.shapes."""
        if not isinstance(self.drawn, Map):
            return self.drawn
        rng = np.random.default_rng(self.random.seed)
        return checked(self.drawn.draw(self.settings, rng), self.settings.map)


@dataclass(frozen=True)
class Landscape:
    """A site with its scenery as one model meets it. All of one site are equal: they
    have the same world.
    """

    site: Site
    scenery: Scenery = field(compare=False)


def obstacles(job: Job) -> Obstacles:
    """The obstacles of the trial's world, see kernels.shapes, drawn now. A map gets the
    random numbers of the job, even if it says that it needs none.
    """
    settings: WorldSettings = settings_tuple(
        WorldSettings, job.settings, settings_of(job.model, job.known)
    )
    return Site(settings, _map(job), Address.of(stream(job, "world"))).obstacles()


def _map(job: Job) -> Map | tuple[Obstacle, ...]:
    """The map of a job that has code, or the obstacles that the spec brings."""
    if job.obstacles is not None:
        return job.obstacles
    return job.known.maps[str(job.settings["map"])]


def is_drawn(job: Job) -> bool:
    """Whether random numbers draw the obstacles of a job."""
    drawn = _map(job)
    return isinstance(drawn, Map) and drawn.random


def landscape_of(job: Job, params: Any, settings: WorldSettings) -> Landscape:
    """The world of `settings` and `params`, which are those of the job."""
    model, drawn, random = job.known.models[job.model], _map(job), NOTHING_RANDOM
    if is_drawn(job):
        random = Address.of(stream(job, "world"))
    site = _site(settings, drawn, random)
    grid = model.occupancy(params) if model.occupancy else None
    return Landscape(site, _scenery(site, model.obstacle_reach(params), grid))


_site = lru_cache(maxsize=16)(Site)


@lru_cache(maxsize=16)
def _scenery(site: Site, reach: float, grid: OccupancySettings | None) -> Scenery:
    return build_scenery(site.settings, site.obstacles(), reach, grid)


def coverage_of(
    landscape: Landscape, observation: Observation, shared: bool = False
) -> Coverage:
    """The pixels of a world, with nothing visited. The sums are the caller's own, and
    the pixels too, unless they may be `shared`: then nobody can write them.
    """
    settings = landscape.site.settings
    if settings.width * settings.height > KEPT_PIXELS * observation.pixel**2:
        return _pixels(landscape, observation)
    kept = _kept_pixels(landscape, observation)
    return kept._replace(sums=kept.sums.copy()) if shared else unvisited(kept)


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
    """The flock with which a trial begins, and the random numbers that go on after it
    was drawn; they are the caller's own.

    Raises what the start raises, as RuntimeError where there is no free place.
    """
    if job.begins is not None:
        return flock_of(job, job.begins), Randomness(stream(job, "start"))
    if job.parent:
        raise RuntimeError(f"the last flock of trial {job.parent} is not at hand")
    given = _given(job, landscape, settings)
    if int(job.settings["n"]) > KEPT_BOIDS:
        return _start(*given)
    flock, random = _kept_start(*given)
    return Flock(*(array.copy() for array in flock)), copy(random)


def flock_drawn_now(job: Job) -> Flock:
    """The flock with which a trial begins, whatever has been drawn before."""
    if job.begins is not None:
        return flock_of(job, job.begins)
    known = settings_of(job.model, job.known)
    params, world, settings = (
        settings_tuple(group, job.settings, known)
        for group in (job.known.models[job.model].params, WorldSettings, StartSettings)
    )
    flock, _ = _start(*_given(job, landscape_of(job, params, world), settings))
    return flock


Given = tuple[Draw, int, StartSettings, Landscape, Address, int]


def _given(job: Job, landscape: Landscape, settings: StartSettings) -> Given:
    """All that the flock of a job at its start depends on."""
    return (
        job.known.starts[str(job.settings["start_draws"])].of_replicate(job.replicate),
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
    scenery, random = landscape.scenery, Randomness(address.seed)
    with random.lent() as rng:
        flock = draw(n, settings, scenery.world, scenery.contact, rng, literal)
    return flock, random


_kept_start = lru_cache(maxsize=64)(_start)
