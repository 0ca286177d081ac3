"""One trial, from a job to its numbers. Kernels are called only here.

A trial is pure: its result depends only on the job, it reads and writes nothing, and it
takes one process and one thread.
"""

import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from kernels.coverage import Coverage, build_coverage, heatmap, no_coverage
from kernels.events import (
    BOID_COLLISIONS,
    COLLISIONS,
    ESCAPES,
    SETTLED,
    Watch,
    build_watch,
    count,
)
from kernels.metrics import METRICS, Ground
from kernels.models import MODELS
from kernels.neighbours import build_grid
from kernels.occupancy import Occupancy, build_occupancy, no_occupancy
from kernels.recording import FILLED, Frames, Record, build_frames, keep_frame
from kernels.settings import (
    NO_POTENTIAL,
    PYTHON_RANDOM,
    Model,
    Observation,
    OccupancySettings,
    Schedule,
    StartSettings,
    WorldSettings,
)
from kernels.starts import start_numpy, start_python_random
from kernels.state import Flock, World
from kernels.workspace import build_workspace
from kernels.worlds import MAPS, Reach, build_reach, build_world
from sweep.design.jobs import Job, literal_seed, stream
from sweep.spec.maps import Obstacles
from sweep.spec.settings import fields, settings_tuple
from sweep.trial.generators import Randomness
from sweep.trial.result import ENDINGS, Result
from sweep.trial.state import State, Taken, changing, check, joined

BOID_STEPS_A_CALL = 200_000
"""So many boid-steps a call take about 30 ms. A kernel call cannot be interrupted, so
we look at the clock, and at the room in the grid, between calls.
"""
MOST_FRAMES, FRAME_BYTES = 4096, 4 * 2**20


def run(job: Job) -> Result:
    """The result of `job`. An exception becomes a result with status failed and the
    traceback as its error.
    """
    return attempt(simulate, job)


def attempt(simulate: Callable[[Job], Result], job: Job) -> Result:
    """The result of `simulate(job)`; an exception becomes a failed result."""
    began = time.perf_counter()
    try:
        return simulate(job)
    except Exception:
        return Result(
            job, "failed", time.perf_counter() - began, error=traceback.format_exc()
        )


def simulate(job: Job) -> Result:
    """The result of `job`; an exception is raised."""
    began = time.perf_counter()
    return Simulation(job).result(began)


def is_brief(job: Job) -> bool:
    """Whether a trial is about one kernel call."""
    return int(job.settings["n"]) * int(job.settings["steps"]) <= BOID_STEPS_A_CALL


class Simulation:
    """A flock in its world, advanced call by call: `flock`, `world`, `params` and
    `record` are the kernels' own.
    """

    def __init__(self, job: Job) -> None:
        known = fields(job.model)
        self.job = job
        self.model = MODELS[job.model]
        self.params = settings_tuple(self.model.params, job.settings, known)
        self.schedule: Schedule = settings_tuple(Schedule, job.settings, known)
        self.observation: Observation = settings_tuple(Observation, job.settings, known)
        world_settings = settings_tuple(WorldSettings, job.settings, known)
        start_settings = settings_tuple(StartSettings, job.settings, known)
        margin = float(job.settings.get("obstacle_range", 0.0))
        grid = self.model.occupancy(self.params) if self.model.occupancy else None
        self.place = _place(job, world_settings, margin, grid)
        self.world = self.place.world
        self.flock = _start(
            job, self.schedule.n, start_settings, self.world, self.place.contact
        )
        self.noise = Randomness(stream(job, "noise"))
        reach = self.model.interaction_range(self.params)
        self.work = build_workspace(
            self.flock, self.world, reach, self.place.reach, self.place.occupancy
        )
        self.record = _record(
            job, self.schedule, self.place, world_settings, self.observation
        )
        self.ground = _ground(
            self.model, self.params, self.world, self.record.coverage, self.schedule.n
        )
        note_start(self.flock, self.world, self.record.watch)
        keep_frame(self.flock, self.record)
        self.step = 0
        self.taken: list[Taken] = []

    @property
    def steps_left(self) -> int:
        return self.schedule.steps - self.step

    def advance(self, steps: int) -> bool:
        """Take up to `steps` steps, but no more than frames have room for. False if the
        state is not finite.

        Frames stay recorded until `take_frames`.
        """
        steps = min(steps, self.steps_left, self._room())
        with self.noise.lent() as rng:
            going = self.model.advance(
                self.flock, self.world, self.params, self.work, self.record, rng, steps
            )
        self.step = int(self.record.progress[0])
        grid = self.work.grid
        room = grid.members.shape[1]
        if going and grid.full[0] and room > 0:
            self.rebuild_grid(2 * room)
        return going

    def rebuild_grid(self, room: int) -> None:
        """Enter the whole flock into a new grid with this `room`, see
        kernels.neighbours.build_grid.
        """
        reach = self.model.interaction_range(self.params)
        self.work = self.work._replace(
            grid=build_grid(self.flock, self.world, reach, room)
        )

    def _room(self) -> int:
        """The steps for which frames have room, that of the last step included."""
        free = len(self.record.frames.step) - int(self.record.progress[FILLED]) - 1
        return max(0, free * self.record.every)

    def take_frames(self) -> Taken:
        """What was recorded since the last call."""
        filled = int(self.record.progress[FILLED])
        self.record.progress[FILLED] = 0
        values = np.empty((len(self.job.record.metrics), filled))
        for row, name in zip(values, self.job.record.metrics, strict=True):
            METRICS[name].measure(
                self.record.frames, filled, self.ground, self.observation, row
            )
        wanted = self.schedule.n if self.job.record.trajectories else 0
        bodies = self.record.frames.bodies[:filled, :4, :wanted]
        return Taken(self.record.frames.step[:filled].copy(), values, bodies.copy())

    def state(self) -> State:
        """The state between two calls, after all frames were taken. Its arrays are not
        copies.
        """
        parts = {"flock": self.flock, "work": self.work, "record": self.record}
        fixed = (
            self.place,
            self.work.grid,
            self.record.frames,
            self.record.coverage.stamp,
        )
        return State(
            changing(parts, fixed),
            dict(self.noise.state),
            self.work.grid.members.shape[1],
        )

    def restore(self, state: State) -> None:
        """Go on from the `state` of a simulation of the same job, with its arrays.
        Raises ValueError if it is none.
        """
        check(state, self.schedule.n, self.schedule.steps)
        self.noise.state = state.generator
        for name, array in self.state().arrays.items():
            array[...] = state.arrays[name]
        self.rebuild_grid(state.room)
        self.step = int(self.record.progress[0])

    def result(
        self, began: float, between: Callable[[float], None] | None = None
    ) -> Result:
        """Run to the end, or to the time limit; `began` is the `time.perf_counter()` at
        which the trial began.

        `between` is called after each kernel call but the last, with the seconds so
        far; `taken` has the frames so far.
        """
        limit = self.job.time_limit
        status = "done"
        self.taken.append(self.take_frames())
        while self.steps_left > 0 and status == "done":
            if not self.advance(max(1, BOID_STEPS_A_CALL // self.schedule.n)):
                status = "diverged"
            self.taken.append(self.take_frames())
            if status == "done" and self.steps_left > 0:
                seconds = time.perf_counter() - began
                if limit is not None and seconds > limit:
                    status = "timeout"
                elif between is not None:
                    between(seconds)
        return self._summary(status, joined(self.taken), began)

    def _summary(self, status: str, taken: Taken, began: float) -> Result:
        wanted, done = self.job.record, status == "done"
        values = dict(zip(wanted.metrics, taken.values, strict=True))
        late = 2 * taken.steps > self.schedule.steps
        return Result(
            self.job,
            status,
            time.perf_counter() - began,
            self.step,
            ENDINGS.get(status, "").format(step=self.step, limit=self.job.time_limit),
            {name: float(value[-1]) for name, value in values.items()} if done else {},
            {name: float(value[late].mean()) for name, value in values.items()}
            if done
            else {},
            taken.steps if wanted.series or wanted.trajectories else None,
            {name: values[name] for name in wanted.series},
            heatmap(self.record.coverage) if wanted.heatmaps and done else None,
            taken.bodies if wanted.trajectories else None,
        )


class Place(NamedTuple):
    """The world, the reach of its obstacles' surfaces, that of their forces, and the
    model's occupancy grid.
    """

    world: World
    contact: Reach
    reach: Reach
    occupancy: Occupancy


def _place(
    job: Job, settings: WorldSettings, margin: float, grid: OccupancySettings | None
) -> Place:
    if _is_drawn_anew(job):
        return _build_place(settings, margin, grid, obstacles(job))
    return _fixed_place(settings, margin, grid, job.obstacles)


def _is_drawn_anew(job: Job) -> bool:
    return job.obstacles is None and MAPS[str(job.settings["map"])].random


def obstacles(job: Job) -> NDArray[np.float64]:
    """The obstacles of the trial's world, shape (M, 5), see kernels.worlds."""
    settings: WorldSettings = settings_tuple(
        WorldSettings, job.settings, fields(job.model)
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


@lru_cache(maxsize=16)
def _fixed_place(
    settings: WorldSettings,
    margin: float,
    grid: OccupancySettings | None,
    own: Obstacles | None,
) -> Place:
    return _build_place(
        settings, margin, grid, _obstacles(settings, own, np.random.default_rng(0))
    )


def _build_place(
    settings: WorldSettings,
    margin: float,
    grid: OccupancySettings | None,
    drawn: NDArray[np.float64],
) -> Place:
    world = build_world(settings, drawn)
    occupancy = build_occupancy(world, grid) if grid else no_occupancy()
    return Place(world, build_reach(world, 0.0), build_reach(world, margin), occupancy)


def _start(
    job: Job, n: int, settings: StartSettings, world: World, contact: Reach
) -> Flock:
    if settings.start_draws == PYTHON_RANDOM:
        return start_python_random(
            n, settings, world, contact, literal_seed(job, "start")
        )
    with Randomness(stream(job, "start")).lent() as rng:
        return start_numpy(n, settings, world, contact, rng)


@lru_cache(maxsize=4)
def _unvisited(
    settings: WorldSettings, observation: Observation, own: Obstacles | None
) -> Coverage:
    place = _fixed_place(settings, 0.0, None, own)
    return build_coverage(place.world, place.contact, observation)


def _coverage(
    job: Job, settings: WorldSettings, place: Place, observation: Observation
) -> Coverage:
    if _is_drawn_anew(job):
        return build_coverage(place.world, place.contact, observation)
    fresh = _unvisited(settings, observation, job.obstacles)
    return fresh._replace(visits=fresh.visits.copy(), sums=fresh.sums.copy())


def _record(
    job: Job,
    schedule: Schedule,
    place: Place,
    settings: WorldSettings,
    observation: Observation,
) -> Record:
    metrics = [METRICS[name] for name in job.record.metrics]
    covers = job.record.heatmaps or any(metric.covers for metric in metrics)
    counts, pairs = (
        any(metric.counts for metric in metrics),
        any(metric.pairs for metric in metrics),
    )
    looks = job.record.trajectories or any(metric.looks for metric in metrics)
    return Record(
        frames=_frames(schedule.n if looks else 0),
        progress=np.zeros(2, np.int64),
        every=job.record.every,
        last=schedule.steps,
        covering=covers,
        coverage=_coverage(job, settings, place, observation)
        if covers
        else no_coverage(),
        watch=build_watch(schedule.n, counts, pairs, place.contact, observation),
    )


def note_start(flock: Flock, world: World, watch: Watch) -> None:
    """Note where boids start. Being outside, in an obstacle or in contact at the start
    is not counted; being at the goal counts as an arrival.
    """
    count(flock, world, watch, 0)
    watch.events[[ESCAPES, COLLISIONS, BOID_COLLISIONS, SETTLED]] = 0
    watch.in_step[:] = 0


def _ground(
    model: Model, params: Any, world: World, coverage: Coverage, n: int
) -> Ground:
    """What the metrics need to know of the trial."""
    potential = model.pair_potential(params) if model.pair_potential else NO_POTENTIAL
    return Ground(
        world, n, coverage.traversable, coverage.visits.size, params.dt, potential
    )


def _frames(bodies: int) -> Frames:
    """Room for FRAME_BYTES of frames, and for two at least: one on time, the last."""
    return build_frames(
        max(2, min(MOST_FRAMES, FRAME_BYTES // (48 * bodies + 48))), bodies
    )


def warm(job: Job) -> None:
    """Compile what trials like `job` need, or load it from the cache: take one step."""
    run(replace(job, settings=job.settings | {"steps": 1}))
