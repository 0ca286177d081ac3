"""One trial, from a job to its result, kernel call by kernel call.

A trial is pure: the result depends only on the job, without files as input or output. A
trial runs in a single process and thread.
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
from kernels.layers import LAYERS
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
from sweep.design import Job, stream
from sweep.spec import RecordSpec, lacks_boids, settings_of, settings_tuple
from sweep.trial.compiled import NOTHING_IS_KEPT
from sweep.trial.derived import measured, summaries
from sweep.trial.generators import Randomness
from sweep.trial.last_flocks import last_flock, place, starting
from sweep.trial.numba_errors import explained
from sweep.trial.playing import playback_of
from sweep.trial.profiles import profiles_of
from sweep.trial.result import ENDINGS, Result
from sweep.trial.robots import keys_of, robot_layers_of, robots_of
from sweep.trial.scenery import Landscape, coverage_of, landscape_of, start_of
from sweep.trial.state import State, Taken, changing, check, digest, joined

LOG = logging.getLogger("sweep")
COMPILING_SECONDS = 15.0
"""Time to compile a model with its metrics, in s, for the built-in models."""
BOID_STEPS_A_CALL = 200_000
"""Boid-steps per kernel call, which take about 30 ms.

A kernel call cannot be interrupted, so the clock is read between calls.
"""


def run(job: Job) -> Result:
    """Run a job and return the result.

    An exception becomes a result with the status failed and the traceback as error. If
    a kernel cannot be compiled, a sentence about the reason comes first.
    """
    return attempt(simulate, job)


def attempt(simulate: Callable[[Job], Result], job: Job) -> Result:
    """Return the result of `simulate(job)`; an exception becomes a failed result."""
    began = time.perf_counter()
    try:
        return simulate(job)
    except Exception as error:
        seconds = time.perf_counter() - began
        sentence = explained(error)
        traced = traceback.format_exc()
        message = f"{sentence}\n\n{traced}" if sentence else traced
        return Result(job, "failed", seconds, error=message)


def simulate(job: Job) -> Result:
    """Run a job and return the result; an exception is raised."""
    began = time.perf_counter()
    return Simulation(job).result(began)


def is_brief(job: Job) -> bool:
    """Return whether a trial takes at most about one kernel call."""
    return int(job.settings["n"]) * int(job.settings["steps"]) <= BOID_STEPS_A_CALL


class Simulation:
    """Trial of a job that advances kernel call by kernel call.

    Parameters
    ----------
    job : Job
    together : bool, default False
        Whether the trial is part of a batch, which advances the trial.
    frames : int, default MOST_FRAMES
        Largest number of frames between two calls of `take_frames`.
    """

    def __init__(
        self, job: Job, together: bool = False, frames: int = MOST_FRAMES
    ) -> None:
        self.job = job
        self.noise = Randomness(stream(job, "noise"))
        self.playback = playback_of(job)
        begun = job
        if self.playback is not None:
            begun = replace(job, begins=self.playback.beginning())
        self.flight = _flight(begun, together, frames)
        self._find_among_all()
        self.taken: list[Taken] = []

    @property
    def flock(self) -> Flock:
        """Current flock, without copies of its arrays."""
        return self.flight.flock

    @property
    def world(self) -> World:
        """World of the trial."""
        return self.flight.world

    @property
    def schedule(self) -> Schedule:
        """Number of boids and of steps of the trial."""
        return self.flight.schedule

    @property
    def step(self) -> int:
        """Number of steps done."""
        return self.flight.step

    @property
    def watched(self) -> str:
        """Names of the values that must be finite after each step, in words."""
        more = ", velocity or state" if self.flight.model.state else " or velocity"
        return f"a position{more}"

    @property
    def visits(self) -> NDArray[np.int32]:
        """Visits of pixels so far, shape (rows, columns), -1 in obstacles."""
        return heatmap(self.flight.record.coverage)

    @property
    def steps_left(self) -> int:
        """Number of steps until the end of the trial."""
        return self.schedule.steps - self.step

    def advance(self, steps: int) -> bool:
        """Take up to `steps` steps, as far as there is room for frames.

        Recorded frames remain until `take_frames` is called. Returns False if the state
        is not finite.
        """
        if self.playback is not None:
            steps = self.playback.load(self.flight, min(steps, self.steps_left))
        with self.noise.lent() as rng:
            return advance(self.flight, rng, steps)

    def take_frames(self, record: RecordSpec | None = None) -> Taken:
        """Return the frames since the last call, and remove them.

        The frames have the metrics and the trajectories of `record`, by default the
        record of the job. The job must record all values in `record`.
        """
        record = record or self.job.record
        flight = self.flight
        metrics = metrics_of(self.job, record.metrics)
        play = self.playback
        values = play.measure(flight, metrics) if play else measure(flight, metrics)
        frames = flight.record.frames
        bodies = self.schedule.n if record.looks else 0
        taken = Taken(
            frames.step[: flight.filled].copy(),
            values,
            frames.bodies[: flight.filled, :4, :bodies].copy(),
            frames.bodies[: flight.filled, FIRST_STATE:, :bodies].copy(),
        )
        if play and bodies:
            absent = ~play.present(taken.steps)
            taken.bodies[np.broadcast_to(absent[:, None], taken.bodies.shape)] = np.nan
        forget_frames(flight)
        return taken

    def go_on_from(self, earlier: "Simulation") -> None:
        """Continue from another simulation with an equal number of boids.

        The flock, random numbers, steps and counts are taken over.
        """
        self.noise.state = earlier.noise.state
        go_on_from(self.flight, earlier.flight)
        self._find_among_all()

    def state(self) -> State:
        """Return the state between two kernel calls, without copies of the arrays.

        All frames must be taken before.
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
        """Return a hash of the initial flock, scenery, pixels and random numbers.

        Call this method before the first step. If trials differ only in `steps`, equal
        hashes mean that the frames are equal.
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
        """Resume from the state of an earlier simulation of this job.

        Parameters
        ----------
        state : State
            The values are copied into the arrays in use.
        room : int, default 0
            Room in a block of the grid, see kernels.neighbours.build_grid.

        Raises
        ------
        ValueError
            If the state is not that of a trial between its first and its last step.
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
        """Remove the grid if the job finds neighbours among all boids."""
        if self.job.all_pairs:
            grid = all_pairs(self.schedule.n)
            self.flight.work = self.flight.work._replace(grid=grid)

    def result(
        self, began: float, between: Callable[[float], None] | None = None
    ) -> Result:
        """Run to the end, or to the time limit, and return the result.

        Parameters
        ----------
        began : float
            `time.perf_counter()` when the trial began.
        between : callable, optional
            Is called after each kernel call except the last, with the seconds so far.
            Then `taken` has the frames so far.

        Returns
        -------
        Result
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
        """Return the result of a trial from the frames.

        Parameters
        ----------
        status : str
            "done", "diverged" or "timeout".
        seconds : float
            Duration of the trial.

        Returns
        -------
        Result
        """
        taken = joined(self.taken)
        record = self.job.record
        done = status == "done"
        values = measured(record, taken, self.job.settings)
        last, mean = (
            summaries(
                values,
                taken.steps,
                self.schedule.steps,
                recorded=self.playback is not None,
            )
            if done
            else ({}, {})
        )
        job = self.job
        if job.begins is not None:  # nobody needs it any more
            job = replace(job, begins=None)
        return Result(
            job,
            status,
            seconds,
            step=self.step,
            error=ENDINGS.get(status, "").format(
                what=self.watched, step=self.step, limit=self.job.time_limit
            ),
            last=last,
            mean=mean,
            frames=taken.steps if record.series or record.trajectories else None,
            series={name: values[name] for name in record.series},
            heatmap=self.visits if record.heatmaps and done else None,
            profiles=profiles_of(job, self.flight, taken.steps, taken.bodies)
            if record.profiles and done
            else {},
            trajectory=taken.bodies if record.trajectories else None,
            states=taken.state if record.trajectories else None,
            last_flock=last_flock(self.flight) if record.last_flocks and done else None,
        )


def _flight(job: Job, together: bool, frames: int) -> Flight:
    """Return the `Flight` of a job at step 0; see Simulation for the parameters.

    Only trials of a batch (`together`) share pixels.
    """
    described = settings_of(job.model, job.catalogue)

    def group(kind: type[Any]) -> Any:
        return settings_tuple(kind, job.settings, described)

    model = job.catalogue.models[job.model]
    record = job.record
    observation = group(Observation)
    landscape = _landscape(job)
    memory = Memory(
        metrics_of(job, record.metrics),
        record.every,
        visits=record.heatmaps,
        bodies=record.looks,
        frames=frames,
    )
    coverage = (
        coverage_of(landscape, observation, shared=together)
        if memory.covering
        else no_coverage()
    )
    flock, random = start_of(job, landscape, group(StartSettings))
    with random.lent() as rng:
        flight = begin(
            starting(model, job.begins),
            group(model.params),
            group(Schedule),
            robots_of(job),
            observation=observation,
            scenery=landscape.scenery,
            flock=flock,
            memory=memory,
            coverage=coverage,
            rng=rng,
            keys=keys_of(job),
        )
    place(flight, job.begins)
    return flight


def _landscape(job: Job) -> Landscape:
    """Return the world of a trial."""
    described = settings_of(job.model, job.catalogue)
    params, settings = (
        settings_tuple(kind, job.settings, described)
        for kind in (job.catalogue.models[job.model].params, WorldSettings)
    )
    return landscape_of(job, params, settings)


def metrics_of(job: Job, names: tuple[str, ...]) -> tuple[Metric, ...]:
    """Return the metrics with some names.

    Raises RuntimeError for a metric that reads state values or types of boids which the
    job's model does not have: the kernel would read beyond the frames.
    """
    metrics = tuple(job.catalogue.metrics[name] for name in names)
    for name, metric in zip(names, metrics, strict=True):
        if lacking := lacks_boids(job.catalogue.models[job.model], metric):
            raise RuntimeError(f'metric "{name}" is for models with {lacking}')
    return metrics


def compiling_seconds(job: Job) -> float:
    """Return the estimated seconds to compile the model of a trial on an idle core.

    The estimate is 0 if the model is compiled already for the layers of the trial. The
    estimate is also 0 if no world can be drawn: then the trial reports the error.
    """
    model = job.catalogue.models[job.model]
    layers = layers_of(job)
    if layers is None or is_compiled_for(model, layers):
        return 0.0
    return COMPILING_SECONDS


def compiled_for(job: Job) -> str:
    """Return the model of a trial, and the layers for which the model is compiled."""
    layers = layers_of(job) or frozenset()
    names = [name for layer, name in LAYERS.items() if layer in layers]
    return " with ".join(filter(None, (job.model, ", ".join(names))))


def layers_of(job: Job) -> frozenset[type] | None:
    """Return which of the LAYERS of kernels.layers a trial has.

    Returns None if no world can be drawn, for example if a custom map fails.
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
    layers = {layer for layer, value in present.items() if value is not None}
    return robot_layers_of(job) | layers


def is_compiled(metric: Metric) -> bool:
    """Return whether a metric is compiled already."""
    return is_kept(metric.measure)


def warm(job: Job) -> Result:
    """Compile the kernels of trials like `job`, or load the kernels from the cache.

    The function runs a single step, and returns the result.
    """
    say_compiling(job)
    result = run(one_step(job))
    say_not_kept()
    return result


def say_not_kept() -> None:
    """Warn once if compiled kernels could not be stored."""
    if NOT_KEPT and NOTHING_IS_KEPT not in os.environ:
        os.environ[NOTHING_IS_KEPT] = "1"
        folder, why = next(iter(NOT_KEPT.items()))
        LOG.warning(
            "%s: compiled kernels cannot be stored (%s), so each process compiles its"
            " kernels: make room there, or set NUMBA_CACHE_DIR to another folder",
            *(folder, why),
        )


def one_step(job: Job) -> Job:
    """Return a copy of the job with a single step."""
    return replace(job, settings=job.settings | {"steps": 1})


def say_compiling(job: Job) -> None:
    """Warn that the model of a job will be compiled, if compiling is necessary.

    Without the warning a user would see no output during the compilation. There is no
    warning after a warning of `say_not_kept`, because then each process compiles.
    """
    if NOTHING_IS_KEPT in os.environ:
        return
    if seconds := compiling_seconds(job):
        duration = f"about {seconds:.0f} s on an idle core, once"
        LOG.warning("compiling %s, %s", compiled_for(job), duration)
