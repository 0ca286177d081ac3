"""One trial, from a job to its numbers: a flight of the kernels, call by call.

A trial is pure: its result depends only on the job, it reads and writes nothing, and it
takes one process. It takes one thread, or as many as its job says, with the same bits.
"""

import logging
import os
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from kernels.caching import NOT_KEPT, is_kept
from kernels.coverage import heatmap, no_coverage
from kernels.flight import (
    MOST_FRAMES,
    Flight,
    Memory,
    advance,
    begin,
    forget_frames,
    go_on_from,
    measure,
    rebuild_grid,
)
from kernels.goals import Goals
from kernels.layers import is_compiled as is_compiled_for
from kernels.metrics import Metric
from kernels.moving import Motion, move_obstacles
from kernels.neighbours import all_pairs
from kernels.recording import FIRST_STATE
from kernels.settings import (
    Observation,
    Schedule,
    StartSettings,
    WorldSettings,
)
from kernels.state import Corners, Flock, World
from sweep.design.jobs import Job, stream
from sweep.spec.recorded import lacks_boids
from sweep.spec.settings import settings_of, settings_tuple
from sweep.spec.study import RecordSpec
from sweep.trial.compiled import NOTHING_IS_KEPT
from sweep.trial.derived import measured, summaries
from sweep.trial.generators import Randomness
from sweep.trial.last_flocks import last_flock, place, starting
from sweep.trial.numba_errors import explained
from sweep.trial.result import ENDINGS, Result
from sweep.trial.robots import keys_of, robot_layers_of, robots_of
from sweep.trial.scenery import Landscape, coverage_of, landscape_of, start_of
from sweep.trial.state import State, Taken, changing, check, digest, joined

LOG = logging.getLogger("sweep")
COMPILING_SECONDS = 15.0
"""Measured for the built-in models, with their metrics."""
BOID_STEPS_A_CALL = 200_000
"""So many boid-steps a call take about 30 ms. A kernel call cannot be interrupted, so
we look at the clock, between calls.
"""


def run(job: Job) -> Result:
    """The result of `job`. An exception becomes a result with status failed and the
    traceback as its error; before it stands the sentence about a kernel that cannot be
    compiled.
    """
    return attempt(simulate, job)


def attempt(simulate: Callable[[Job], Result], job: Job) -> Result:
    """The result of `simulate(job)`; an exception becomes a failed result."""
    began = time.perf_counter()
    try:
        return simulate(job)
    except Exception as error:
        seconds, sentence = time.perf_counter() - began, explained(error)
        traced = traceback.format_exc()
        said = f"{sentence}\n\n{traced}" if sentence else traced
        return Result(job, "failed", seconds, error=said)


def simulate(job: Job) -> Result:
    """The result of `job`; an exception is raised."""
    began = time.perf_counter()
    return Simulation(job).result(began)


def is_brief(job: Job) -> bool:
    """Whether a trial is about one kernel call."""
    return int(job.settings["n"]) * int(job.settings["steps"]) <= BOID_STEPS_A_CALL


class Simulation:
    """The flight of a job, advanced call by call; if it is `together` with others, by
    what flies them all. It has room for so many `frames` at most.
    """

    def __init__(
        self, job: Job, together: bool = False, frames: int = MOST_FRAMES
    ) -> None:
        self.job = job
        self.noise = Randomness(stream(job, "noise"))
        self.flight = _flight(job, together, frames)
        self._find_among_all()
        self.taken: list[Taken] = []

    @property
    def flock(self) -> Flock:
        """The flock as it is; its arrays are those in use."""
        return self.flight.flock

    @property
    def world(self) -> World:
        return self.flight.world

    @property
    def schedule(self) -> Schedule:
        return self.flight.schedule

    @property
    def step(self) -> int:
        """The steps done."""
        return self.flight.step

    @property
    def watched(self) -> str:
        """What must be a finite number after each step, in words."""
        more = ", velocity or state" if self.flight.model.state else " or velocity"
        return f"a position{more}"

    @property
    def visits(self) -> NDArray[np.int32]:
        """The visits of pixels (rows, columns) so far, -1 in obstacles."""
        return heatmap(self.flight.record.coverage)

    @property
    def steps_left(self) -> int:
        return self.schedule.steps - self.step

    def advance(self, steps: int) -> bool:
        """Take up to `steps` steps, but no more than frames have room for. False if the
        state is not finite.

        Frames stay recorded until they are taken.
        """
        with self.noise.lent() as rng:
            return advance(self.flight, rng, steps)

    def take_frames(self, wanted: RecordSpec | None = None) -> Taken:
        """What was recorded since the last call.

        It has the metrics and the trajectories that the job records, or those `wanted`,
        as far as what the job records is enough for them.
        """
        record, flight = wanted or self.job.record, self.flight
        values = measure(flight, metrics_of(self.job, record.metrics))
        frames = flight.record.frames
        bodies = self.schedule.n if record.trajectories else 0
        taken = Taken(
            frames.step[: flight.filled].copy(),
            values,
            frames.bodies[: flight.filled, :4, :bodies].copy(),
            frames.bodies[: flight.filled, FIRST_STATE:, :bodies].copy(),
        )
        forget_frames(flight)
        return taken

    def go_on_from(self, earlier: "Simulation") -> None:
        """Take the place of a simulation of as many boids: with its flock, random
        numbers, steps and counts.
        """
        self.noise.state = earlier.noise.state
        go_on_from(self.flight, earlier.flight)
        self._find_among_all()

    def state(self) -> State:
        """The state between two calls, after all frames were taken. Its arrays are not
        copies.
        """
        flight = self.flight
        parts = {"flock": flight.flock, "work": flight.work, "record": flight.record}
        fixed = (
            flight.scenery,
            flight.work.grid,
            flight.work.kind,
            flight.work.robots.failing,
            flight.work.robots.motors,
            flight.work.robots.rows,
            flight.work.motion,
            flight.record.frames,
            flight.record.coverage.stamp,
        )
        return State(changing(parts, fixed), dict(self.noise.state))

    def beginning(self) -> str:
        """A hash of all with which the flight begins, before its first step: flock,
        scenery, pixels and random numbers. Of the trials of the same settings, but for
        `steps`, those that begin alike have the same frames.
        """
        flight = self.flight
        parts = {
            "flock": flight.flock,
            "state": (flight.work.state, flight.work.kind),
            "scenery": flight.scenery,
            "motion": flight.work.motion,
            "visits": flight.record.coverage.visits,
        }
        return digest(parts, self.noise.state)

    def restore(self, state: State, room: int = 0) -> None:
        """Go on from the `state` of a simulation of the same job, with its arrays, and
        with so much room in a block of the grid, see kernels.neighbours.build_grid.
        Raises ValueError if it is none.
        """
        check(state, self.schedule.n, self.schedule.steps)
        self.noise.state = state.generator
        for name, array in self.state().arrays.items():
            array[...] = state.arrays[name]
        rebuild_grid(self.flight, room)
        work = self.flight.work
        move_obstacles(work.motion, work.reach, self.flight.step)
        self._find_among_all()

    def _find_among_all(self) -> None:
        """Take the grid away, if the job wants neighbours found among all boids."""
        if self.job.all_pairs:
            grid = all_pairs(self.schedule.n)
            self.flight.work = self.flight.work._replace(grid=grid)

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
        return self.summary(status, time.perf_counter() - began)

    def summary(self, status: str, seconds: float) -> Result:
        """The result of a trial that took so many seconds, from the frames taken."""
        taken = joined(self.taken)
        wanted, done = self.job.record, status == "done"
        values = measured(wanted, taken, self.job.settings)
        last, mean = (
            summaries(values, taken.steps, self.schedule.steps) if done else ({}, {})
        )
        job = self.job
        if job.begins is not None:  # nobody needs it any more
            job = replace(job, begins=None)
        return Result(
            job,
            status,
            seconds,
            self.step,
            ENDINGS.get(status, "").format(
                what=self.watched, step=self.step, limit=self.job.time_limit
            ),
            last,
            mean,
            taken.steps if wanted.series or wanted.trajectories else None,
            {name: values[name] for name in wanted.series},
            self.visits if wanted.heatmaps and done else None,
            taken.bodies if wanted.trajectories else None,
            taken.state if wanted.trajectories else None,
            last_flock=last_flock(self.flight) if wanted.last_flocks and done else None,
        )


def _flight(job: Job, together: bool, frames: int) -> Flight:
    """The flight of a job at its start, with pixels of its own unless it flies
    `together` with others, and with room for so many `frames` at most.
    """
    known, settings_known = job.known, settings_of(job.model, job.known)

    def group(kind: type[Any]) -> Any:
        return settings_tuple(kind, job.settings, settings_known)

    model, record = known.models[job.model], job.record
    params = group(model.params)
    schedule, observation = group(Schedule), group(Observation)
    landscape = _landscape(job)
    metrics = metrics_of(job, record.metrics)
    memory = Memory(metrics, record.every, record.heatmaps, record.trajectories, frames)
    coverage = (
        coverage_of(landscape, observation, shared=together)
        if memory.covering
        else no_coverage()
    )
    flock, random = start_of(job, landscape, group(StartSettings))
    with random.lent() as rng:
        flight = begin(
            starting(model, job.begins),
            params,
            schedule,
            robots_of(job),
            observation,
            landscape.scenery,
            flock,
            memory,
            coverage,
            rng,
            keys_of(job),
        )
    place(flight, job.begins)
    return flight


def _landscape(job: Job) -> Landscape:
    """Where a trial flies."""
    known = settings_of(job.model, job.known)
    params, settings = (
        settings_tuple(kind, job.settings, known)
        for kind in (job.known.models[job.model].params, WorldSettings)
    )
    return landscape_of(job, params, settings)


def metrics_of(job: Job, names: tuple[str, ...]) -> tuple[Metric, ...]:
    """The metrics of these names. Raises RuntimeError for one that reads what boids of
    the job's model have not: its kernel would read beyond the frames.
    """
    found = tuple(job.known.metrics[name] for name in names)
    for name, metric in zip(names, found, strict=True):
        if lacking := lacks_boids(job.known.models[job.model], metric):
            raise RuntimeError(f'metric "{name}" is for models with {lacking}')
    return found


def compiling_seconds(job: Job) -> float:
    """How long it takes, about, to compile the model of a trial on an idle core, as it
    is for its robots; 0 where it is compiled already, or where nothing can be drawn to
    fly in: the trial itself says why.
    """
    model, layers = job.known.models[job.model], layers_of(job)
    if layers is None or is_compiled_for(model, layers):
        return 0.0
    return COMPILING_SECONDS


def layers_of(job: Job) -> frozenset[type] | None:
    """Which of the LAYERS of kernels.layers a trial has; None where nothing can be
    drawn to fly in, as by a map of one's own that fails.
    """
    try:
        scenery = _landscape(job).scenery
    except Exception:
        return None
    present = {
        Motion: scenery.velocities,
        Goals: scenery.route,
        Corners: scenery.world.corners,
    }
    found = {layer for layer, value in present.items() if value is not None}
    return robot_layers_of(job) | found


def is_compiled(metric: Metric) -> bool:
    """Whether a metric need not be compiled any more."""
    return is_kept(metric.measure)


def warm(job: Job) -> Result:
    """Compile what trials like `job` need, or load it from the cache: take one step,
    whose result it is.
    """
    say_compiling(job)
    result = run(one_step(job))
    say_not_kept()
    return result


def say_not_kept() -> None:
    """Say where compiled kernels could not be kept, once."""
    if NOT_KEPT and NOTHING_IS_KEPT not in os.environ:
        os.environ[NOTHING_IS_KEPT] = "1"
        folder, why = next(iter(NOT_KEPT.items()))
        LOG.warning(
            "%s: compiled kernels cannot be kept (%s), so each process compiles what"
            " it needs: make room there, or set NUMBA_CACHE_DIR to another folder",
            *(folder, why),
        )


def one_step(job: Job) -> Job:
    """The same job with one step."""
    return replace(job, settings=job.settings | {"steps": 1})


def say_compiling(job: Job) -> None:
    """Say that the model of a job will be compiled, where it is not yet: nothing else
    is seen of it. Where each process compiles, that was said.
    """
    if NOTHING_IS_KEPT in os.environ:
        return
    if seconds := compiling_seconds(job):
        about = f"about {seconds:.0f} s on an idle core, once"
        LOG.warning("compiling %s, %s", job.model, about)
