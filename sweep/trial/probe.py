"""A few short trials, of code whose cost is not known: can it run, and how fast is it?

Nothing that is stored depends on what is measured here.
"""

import hashlib
import json
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from kernels.caching import kept
from kernels.flight import measure
from kernels.identity import Code
from sweep.design.code import is_built_in
from sweep.design.cost import KNOWN_PACE, TrialPace, job_seconds
from sweep.design.design import evenly, expand
from sweep.design.jobs import Job, Jobs
from sweep.spec.study import Study
from sweep.trial.numba_errors import of_own_code
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, say_compiling, simulate
from sweep.trial.state import State, different

MOST_TRIALS = 3
ESTIMATED_SECONDS = 0.1
"""A trial is shortened to about so much, by the estimate that is to be corrected."""
FEW_STEPS = 5
MOST_SECONDS = 0.4
"""A trial ends after so much, however slow its steps are."""


def measured_pace(study: Study) -> TrialPace:
    """The pace of the trials of a study, from a few of them that are run for a moment
    in this process. Compiling does not count.

    Raises SpecError where none of them can be run.
    """
    if is_built_in(study):
        return KNOWN_PACE
    design = expand(study)
    jobs = Jobs(study, design.only(evenly(design.n_points, MOST_TRIALS)))
    few = [jobs[place] for place in evenly(len(jobs), MOST_TRIALS)]
    compiled = list(_ran(study, map(_begun, few)))
    _check_contracts(study, compiled[0].job)
    results = list(_ran(study, map(_shortened, few)))
    estimated = sum(map(_estimated, results))
    return TrialPace(
        sum(result.seconds for result in results) / estimated,
        sum(result.step for result in results),
    )


def check_runs(study: Study, jobs: Sequence[Job]) -> None:
    """Raise SpecError where none of these jobs of a study can take a step, unless all
    code is built in.

    One that fails is no reason: its settings may be.
    """
    if not is_built_in(study):
        result = next(_ran(study, map(_begun, jobs)))
        _check_contracts(study, result.job)


def check_once(code: Code, check: Callable[[], None]) -> None:
    """Call `check`, unless it has raised nothing before for the same code, in this
    version. The answer lies with what is compiled, in a folder of this user alone.
    """
    content = json.dumps([code, sys.modules["sweep"].__version__])

    def made() -> bytes:
        check()
        return b""

    kept(f"{hashlib.sha256(content.encode()).hexdigest()[:32]}.promises", made)


def _ran(study: Study, jobs: Iterable[Job]) -> Iterator[Result]:
    """The results of the jobs that raise nothing. Raises SpecError if there is none."""
    first: Exception | None = None
    ran = 0
    for number, job in enumerate(jobs):
        if number == 0:
            say_compiling(job)
        try:
            result = simulate(job)
        except Exception as error:
            first = first or error
        else:
            ran += 1
            yield result
    if first and not ran:
        words = " ".join(f"{type(first).__name__}: {first}".split())
        said = f"no trial can be run: {of_own_code(first) or words}"
        raise study.document.error(("model",), said) from first


def _check_contracts(study: Study, job: Job) -> None:
    """Raise SpecError where two runs of the first step of a job differ, and for a
    metric that writes no value; where last states are kept, also where the first steps
    of a longer trial differ.
    """

    def refused(said: str) -> None:
        raise study.document.error(("model",), f"no trial can be run: {said}")

    names = job.record.metrics
    metrics = [job.known.metrics[name] for name in names]
    ends = []
    for blank in (math.nan, 0.0):
        simulation = Simulation(_begun(job))
        simulation.advance(1)
        ends.append((measure(simulation.flight, metrics, blank), simulation.state()))
    (nan, one), (zero, other) = ends
    for name, unwritten in zip(names, np.isnan(nan) & ~np.isnan(zero), strict=True):
        if unwritten.any():
            refused(
                f"metric {name} writes no number into values[f] of some frame; it must"
                " write one into each, and returns nothing"
            )
    if name := different(one, other):
        refused(
            f"two runs of one trial differ after a step, in {name}: draw random"
            " numbers from rng alone, and keep nothing between runs"
        )
    if not job.record.last_states:
        return
    short, long = (_state_after(FEW_STEPS, job, times * FEW_STEPS) for times in (1, 2))
    if name := different(short, long):
        refused(
            f"after {FEW_STEPS} steps a trial of so many and one of twice as many"
            f" differ, in {name}: where last_states are recorded nothing may depend on"
            " the number of steps"
        )


def _state_after(steps: int, job: Job, of: int) -> State:
    """The state after so many steps of the job, were it one `of` so many."""
    simulation = Simulation(_begun(job, of))
    simulation.advance(steps)
    simulation.take_frames()
    return simulation.state()


def _begun(job: Job, steps: int = 1) -> Job:
    """The first steps of a job, which begins as its settings say."""
    return replace(job, settings=job.settings | {"steps": steps}, parent="")


def _shortened(job: Job) -> Job:
    """So many steps of a job as take ESTIMATED_SECONDS, but at least one."""
    steps = int(job.settings["steps"])
    share = ESTIMATED_SECONDS / float(job_seconds([job])[0])
    return replace(
        job,
        settings=job.settings | {"steps": min(steps, max(1, int(share * steps)))},
        time_limit=MOST_SECONDS,
    )


def _estimated(result: Result) -> float:
    """The estimated seconds of the steps that were taken."""
    job = result.job
    taken = job.settings | {"steps": result.step}
    return float(job_seconds([replace(job, settings=taken)])[0])
