"""Vectorised batches of trials, one in each lane of the processor's vectors.

The results are bitwise identical to results of single trials. Trials of a batch differ
only in seed, replicate and the weights of rules. The model must have a form for lanes,
see kernels.lanes. All remaining trials run one after the other.
"""

import os
import time
import traceback
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

from kernels.lanes.kernel import weights_of
from kernels.lanes.together import (
    REFUSALS,
    Formation,
    can_fly_together,
    is_kept_for_lanes,
)
from kernels.lanes.vectors import WIDTH
from kernels.settings import ALL_IN_SIGHT
from sweep.design import Job, evenly, searched_share
from sweep.trial.generators import lent_to_all
from sweep.trial.result import Result
from sweep.trial.robots import flies_alone
from sweep.trial.simulation import (
    COMPILING_SECONDS,
    LOG,
    Simulation,
    one_step,
    run,
    say_not_kept,
)

AT_ONCE = WIDTH
"""Largest number of trials in a batch."""
LEAST = 8
"""Smallest number of trials in a batch; the results of unused lanes are discarded.

Single trials were faster with fewer: four trials of a built-in model took 0.7 to 1.0
times as long in sequence.
"""
COMPILING_TIMES = 8.0
"""Least time of all trials, as a multiple of the compile time of a kernel for lanes.

A batch that saves an eighth of this time then pays for compiling.
"""
STRETCHES = 10
"""Number of positions where `first_group` looks for a batch."""
STRETCH = 100
"""Number of consecutive jobs that `first_group` looks at in each position."""

Between = Callable[[float, Callable[[], None]], None]
"""Function that is called between two kernel calls.

The function gets the seconds of each trial so far, and a function that updates all
simulations from the batch, so that their states can be stored.
"""


@dataclass(frozen=True)
class Trials:
    """Function that runs trials, in batches if `together` is true."""

    together: bool = False

    def __call__(self, job: Job) -> Result:
        """Return the result of a job."""
        return run(job)

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """Return the results of jobs, in their order."""
        return in_groups(jobs, run, _together if self.together else None)


def _together(jobs: Sequence[Job]) -> list[Result]:
    began = time.perf_counter()
    return fly([Simulation(job, together=True) for job in jobs], began)


def worth_flying_together(jobs: Sequence[Job], seconds: float) -> bool:
    """Return whether trials are to run in batches, and compile the kernel for batches.

    Compiling here saves the workers from compiling. The workers need `seconds` to run
    the trials in sequence.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return False
    group = first_group(jobs)
    if not group:
        return False
    model = group[0].catalogue.models[group[0].model]
    if seconds < COMPILING_TIMES * COMPILING_SECONDS and not is_kept_for_lanes(model):
        return False
    return warm_together(group)


def warm_together(jobs: Sequence[Job]) -> bool:
    """Compile the kernel for a batch of jobs, or load the kernel from the cache.

    The batch takes a single step. Returns False if the kernel cannot be compiled.
    """
    model = jobs[0].catalogue.models[jobs[0].model]
    if not is_kept_for_lanes(model):
        LOG.warning(
            "compiling %s for %d trials at once, about %.0f s on an idle core, once",
            *(model.name, AT_ONCE, COMPILING_SECONDS),
        )
    steps = [one_step(job) for job in jobs]
    outcome = _attempt(_together, steps)
    say_not_kept()
    if isinstance(outcome, Exception):
        _tell(outcome, [run(step) for step in steps])
        return False
    return True


def first_group(jobs: Sequence[Job]) -> list[Job]:
    """Return the first batch of the jobs, or [].

    Only a few stretches are searched, because there may be millions of jobs.
    """
    for start in evenly(max(len(jobs) - STRETCH, 0) + 1, STRETCHES):
        looked = jobs[start : start + STRETCH]
        for group in groups(looked):
            if len(group) > 1:
                return [looked[place] for place in group]
    return []


def in_groups(
    jobs: Sequence[Job],
    alone: Callable[[Job], Result],
    together: Callable[[Sequence[Job]], list[Result]] | None,
) -> list[Result]:
    """Return the results of jobs, in their order, with batches where possible.

    If a batch fails, each job runs alone and reports its error. If no job fails alone,
    a warning reports the error of the batch.

    Parameters
    ----------
    jobs : sequence of Job
    alone : callable
        Returns the result of one job.
    together : callable or None
        Returns the results of a batch; None to run each job alone.

    Returns
    -------
    list of Result
    """
    if together is None:
        return [alone(job) for job in jobs]
    results: dict[int, Result] = {}
    for group in groups(jobs):
        members = [jobs[place] for place in group]
        outcome = (
            _attempt(together, members)
            if len(members) > 1
            else list(map(alone, members))
        )
        if isinstance(outcome, Exception):
            error = outcome
            outcome = [alone(job) for job in members]
            _tell(error, outcome)
        results |= zip(group, outcome, strict=True)
    return [results[place] for place in range(len(jobs))]


def _attempt(
    together: Callable[[Sequence[Job]], list[Result]], jobs: Sequence[Job]
) -> list[Result] | Exception:
    try:
        return together(jobs)
    except Exception as error:
        return error


def _tell(error: Exception, alone: Sequence[Result]) -> None:
    """Warn that a batch failed, if every trial of the batch succeeds alone.

    A model that has no form for lanes gets no warning.
    """
    failed = any(result.has_failed for result in alone)
    if not failed and not isinstance(error, REFUSALS):
        _say_once(alone[0].job.model, "".join(traceback.format_exception(error)))


@cache
def _say_once(model: str, error: str) -> None:
    LOG.warning(
        "trials of %s that fail together run one after the other, with identical"
        " results; please report this defect:\n%s",
        model,
        error,
    )


def groups(jobs: Sequence[Job]) -> Iterator[list[int]]:
    """Yield the indices of the jobs of each batch, and of each single job."""
    alike = defaultdict[Any, list[int]](list)
    for place, job in enumerate(jobs):
        alike[_kind(job) or place].append(place)
    for kind, places in alike.items():
        for first in range(0, len(places), AT_ONCE):
            group = places[first : first + AT_ONCE]
            if isinstance(kind, int) or len(group) < LEAST:
                yield from ([place] for place in group)
            else:
                yield group


def _kind(job: Job) -> Any:
    """Return a key that the trials of a batch share; None for a trial that runs alone.

    A trial runs alone in any of these cases:

    - The trial has a time limit, or stores its final state.
    - The trial finds neighbours without a grid, or plays a recording.
    - Boids do not interact with all perceived neighbours, or are not ideal.
    """
    model = job.catalogue.models[job.model]
    n = int(job.settings["n"])
    steps = int(job.settings["steps"])
    if job.time_limit is not None or job.record.last_states or steps == 0:
        return None
    if job.all_pairs or model.events:
        return None
    if job.settings["neighbours"] != ALL_IN_SIGHT or flies_alone(job):
        return None
    share = searched_share(job.model, job.catalogue, job.settings)
    if not can_fly_together(model, n, share):
        return None
    free = weights_of(model)
    fixed = tuple(
        (name, value) for name, value in job.settings.items() if name not in free
    )
    return id(job.catalogue), job.model, job.record, job.obstacles, fixed


def fly(
    simulations: Sequence[Simulation],
    began: float,
    between: Between = lambda _seconds, _settle: None,
) -> list[Result]:
    """Run a batch of simulations to the end and return the results.

    Parameters
    ----------
    simulations : sequence of Simulation
        At their start, with `together=True`.
    began : float
        `time.perf_counter()` when the batch began. The seconds of each result are its
        fraction of the time since then.
    between : Between
        Called between two kernel calls; by default without effect.

    Returns
    -------
    list of Result
    """
    flights = Formation([simulation.flight for simulation in simulations])
    left = simulations[0].steps_left

    def settle() -> None:
        flights.land()
        _take(simulations)

    _take(simulations)
    while left > 0 and any(flights.going):
        steps = min(left, flights.steps_at_once)
        if steps == 0:
            _take(simulations)
            continue
        streams = [simulation.noise for simulation in simulations]
        with lent_to_all(streams, AT_ONCE) as generators:
            flights.advance(generators, steps)
        left -= steps
        if left > 0:
            between(_share(simulations, began), settle)
    _take(simulations)
    if simulations[0].job.record.heatmaps:
        flights.land()
    seconds = _share(simulations, began)
    return [
        simulation.summary("done" if going else "diverged", seconds)
        for simulation, going in zip(simulations, flights.going, strict=True)
    ]


def _take(simulations: Sequence[Simulation]) -> None:
    for simulation in simulations:
        simulation.taken.append(simulation.take_frames())


def _share(simulations: Sequence[Simulation], began: float) -> float:
    return (time.perf_counter() - began) / len(simulations)
