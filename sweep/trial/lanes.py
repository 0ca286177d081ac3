"""Trials that fly together, one in each lane of the processor's vectors. Each has the
bits that it has alone.

Trials may fly together if they differ in their seed, their replicate and the weights of
rules at most, and if their model can be written for lanes, see kernels.lanes. Others,
and those that are left over, are run one after the other.
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
from sweep.design.cost import searched_share
from sweep.design.design import evenly
from sweep.design.jobs import Job
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
"""So many trials fly together at most."""
LEAST = 8
"""So many trials are faster together than one after the other: with fewer the lanes of
the others compute what nobody needs. Of the built-in models four took 0.7 to 1.0 times
as long alone.
"""
COMPILING_TIMES = 8.0
"""A kernel for lanes is compiled where the workers need so many times as long for all
trials: so it saves an eighth of that time at least about as long as it takes.
"""
STRETCHES, STRETCH = 10, 100
"""Of how many jobs in a row, so many times, is asked whether any fly together."""

Between = Callable[[float, Callable[[], None]], None]
"""Gets the seconds of each trial so far, and a function that brings all simulations to
where their flights are, so that their states can be kept.
"""


@dataclass(frozen=True)
class Trials:
    """Runs trials; `together` says that they may fly together."""

    together: bool = False

    def __call__(self, job: Job) -> Result:
        return run(job)

    def several(self, jobs: Sequence[Job]) -> list[Result]:
        """The results of `jobs`, in their order."""
        return in_groups(jobs, run, _together if self.together else None)


def _together(jobs: Sequence[Job]) -> list[Result]:
    began = time.perf_counter()
    return fly([Simulation(job, together=True) for job in jobs], began)


def worth_flying_together(jobs: Sequence[Job], seconds: float) -> bool:
    """Whether trials are to fly together, for which the workers need so many seconds
    one after the other. It compiles what they need, so that not every worker does that.
    """
    if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0":
        return False
    group = first_group(jobs)
    if not group:
        return False
    model = group[0].known.models[group[0].model]
    if seconds < COMPILING_TIMES * COMPILING_SECONDS and not is_kept_for_lanes(model):
        return False
    return warm_together(group)


def warm_together(jobs: Sequence[Job]) -> bool:
    """Compile what jobs of one kind need together, or load it from the cache: they take
    one step. False where it cannot be compiled.
    """
    model = jobs[0].known.models[jobs[0].model]
    if not is_kept_for_lanes(model):
        LOG.warning(
            "compiling %s for %d trials at once, about %.0f s on an idle core, once",
            *(model.name, AT_ONCE, COMPILING_SECONDS),
        )
    steps = [one_step(job) for job in jobs]
    found = _attempt(_together, steps)
    say_not_kept()
    if isinstance(found, Exception):
        _tell(found, [run(one) for one in steps])
        return False
    return True


def first_group(jobs: Sequence[Job]) -> list[Job]:
    """The first jobs that fly together, among some: there may be millions."""
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
    """The results of `jobs`, in their order: those of groups by `together`, others by
    `alone`. A group that fails is run `alone`, which says why; where it does not fail
    then, a warning does.
    """
    if together is None:
        return [alone(job) for job in jobs]
    results: dict[int, Result] = {}
    for group in groups(jobs):
        members = [jobs[place] for place in group]
        made = (
            _attempt(together, members)
            if len(members) > 1
            else list(map(alone, members))
        )
        if isinstance(made, Exception):
            error, made = made, [alone(job) for job in members]
            _tell(error, made)
        results |= zip(group, made, strict=True)
    return [results[place] for place in range(len(jobs))]


def _attempt(
    together: Callable[[Sequence[Job]], list[Result]], jobs: Sequence[Job]
) -> list[Result] | Exception:
    try:
        return together(jobs)
    except Exception as error:
        return error


def _tell(error: Exception, alone: Sequence[Result]) -> None:
    """Say that trials failed together by an error which none of them has `alone`.
    Nothing is said of a model that cannot be written for lanes.
    """
    if not isinstance(error, REFUSALS) and not any(one.has_failed for one in alone):
        _say_once(alone[0].job.model, "".join(traceback.format_exception(error)))


@cache
def _say_once(model: str, error: str) -> None:
    LOG.warning(
        "trials of %s that fail together fly one after the other, with the same"
        " results; please report this defect:\n%s",
        model,
        error,
    )


def groups(jobs: Sequence[Job]) -> Iterator[list[int]]:
    """The places of jobs that are run together, and of single ones."""
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
    """What trials have in common that fly together; None for one that flies alone, as
    one does that may be ended by the clock, that keeps its last state, that finds
    neighbours without a grid, or whose boids do not interact with all in sight or do
    not know all that they see.
    """
    model = job.known.models[job.model]
    n, steps = int(job.settings["n"]), int(job.settings["steps"])
    if job.time_limit is not None or job.record.last_states or steps == 0:
        return None
    if job.all_pairs:
        return None
    if job.settings["neighbours"] != ALL_IN_SIGHT or flies_alone(job):
        return None
    share = searched_share(job.model, job.known, job.settings)
    if not can_fly_together(model, n, share):
        return None
    free = weights_of(model)
    fixed = tuple(
        (name, value) for name, value in job.settings.items() if name not in free
    )
    return id(job.known), job.model, job.record, job.obstacles, fixed


def fly(
    simulations: Sequence[Simulation],
    began: float,
    between: Between = lambda _seconds, _settle: None,
) -> list[Result]:
    """The results of simulations at their start. The seconds of each are its share of
    those since `began`.

    `between` is called between two calls of the kernels.
    """
    flights = Formation([one.flight for one in simulations])
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
        with lent_to_all([one.noise for one in simulations], AT_ONCE) as generators:
            flights.advance(generators, steps)
        left -= steps
        if left > 0:
            between(_share(simulations, began), settle)
    _take(simulations)
    if simulations[0].job.record.heatmaps:
        flights.land()
    seconds = _share(simulations, began)
    return [
        one.summary("done" if going else "diverged", seconds)
        for one, going in zip(simulations, flights.going, strict=True)
    ]


def _take(simulations: Sequence[Simulation]) -> None:
    for one in simulations:
        one.taken.append(one.take_frames())


def _share(simulations: Sequence[Simulation], began: float) -> float:
    return (time.perf_counter() - began) / len(simulations)
