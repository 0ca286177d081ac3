"""A few short trials of custom code, to test the code and to measure its pace.

No stored value depends on the measurements.
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
from sweep.design import (
    KNOWN_PACE,
    Job,
    Jobs,
    TrialPace,
    evenly,
    expand,
    is_built_in,
    job_seconds,
)
from sweep.spec import Study
from sweep.trial.numba_errors import of_own_code
from sweep.trial.result import Result
from sweep.trial.simulation import Simulation, say_compiling, simulate
from sweep.trial.state import State, different

MOST_TRIALS = 3
ESTIMATED_SECONDS = 0.1
"""Length of a shortened trial in seconds, by the estimate that the probe corrects."""
FEW_STEPS = 5
MOST_SECONDS = 0.4
"""Time limit of a trial in seconds, for steps that are slower than estimated."""


def measured_pace(study: Study) -> TrialPace:
    """Return the pace of the trials of a study, from a few short trials.

    The trials run in this process. The time of compiling does not count. Raises
    SpecError if no trial can run.
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
    """Raise SpecError if no job can take a step, or if custom code is wrong.

    Built-in code is not checked. A single job may fail because of its parameters.
    """
    if not is_built_in(study):
        result = next(_ran(study, map(_begun, jobs)))
        _check_contracts(study, result.job)


def check_once(code: Code, check: Callable[[], None]) -> None:
    """Call `check`, unless the code has passed the check before in this version.

    The answer is stored next to compiled code, in a private folder of the user.
    """
    content = json.dumps([code, sys.modules["sweep"].__version__])

    def checked() -> bytes:
        check()
        return b""

    kept(f"{hashlib.sha256(content.encode()).hexdigest()[:32]}.promises", checked)


def _ran(study: Study, jobs: Iterable[Job]) -> Iterator[Result]:
    """Yield the results of the jobs that run. Raises SpecError if no job runs."""
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
        reason = " ".join(f"{type(first).__name__}: {first}".split())
        message = f"no trial can be run: {of_own_code(first) or reason}"
        raise study.document.error(("model",), message) from first


def _check_contracts(study: Study, job: Job) -> None:
    """Raise SpecError if custom code breaks a requirement of models and metrics.

    Two runs of the first step must be equal, and metrics must write all values. With
    last states, the first steps must not depend on the number of steps.
    """

    def refused(reason: str) -> None:
        raise study.document.error(("model",), f"no trial can be run: {reason}")

    names = job.record.metrics
    metrics = [job.catalogue.metrics[name] for name in names]
    ends = []
    for blank in (math.nan, 0.0):
        simulation = Simulation(_begun(job))
        simulation.advance(1)
        ends.append((measure(simulation.flight, metrics, blank), simulation.state()))
    (nan, state), (zero, repeated) = ends
    for name, unwritten in zip(names, np.isnan(nan) & ~np.isnan(zero), strict=True):
        if unwritten.any():
            refused(
                f"metric {name} writes no number into values[f] of some frame; a metric"
                " must write a number for each frame, and returns no value"
            )
    if name := different(state, repeated):
        refused(
            f"two runs of one trial differ after a step, in {name}: draw random"
            " numbers only from rng, and store no value between runs"
        )
    if not job.record.last_states:
        return
    short, long = (_state_after(FEW_STEPS, job, times * FEW_STEPS) for times in (1, 2))
    if name := different(short, long):
        refused(
            f"after {FEW_STEPS} steps a trial of this length and a trial of twice this"
            f" length differ, in {name}: with last_states no value may depend on the"
            " number of steps"
        )


def _state_after(steps: int, job: Job, all_steps: int) -> State:
    """Return the state after some steps of a job that has `all_steps` steps."""
    simulation = Simulation(_begun(job, all_steps))
    simulation.advance(steps)
    simulation.take_frames()
    return simulation.state()


def _begun(job: Job, steps: int = 1) -> Job:
    """Return the first steps of a job, which begins as its parameters define."""
    return replace(job, settings=job.settings | {"steps": steps}, parent="")


def _shortened(job: Job) -> Job:
    """Return a job with steps for about ESTIMATED_SECONDS, but at least one step."""
    steps = int(job.settings["steps"])
    share = ESTIMATED_SECONDS / float(job_seconds([job])[0])
    return replace(
        job,
        settings=job.settings | {"steps": min(steps, max(1, int(share * steps)))},
        time_limit=MOST_SECONDS,
    )


def _estimated(result: Result) -> float:
    """Return the estimated seconds of the steps that a trial took."""
    job = result.job
    taken = job.settings | {"steps": result.step}
    return float(job_seconds([replace(job, settings=taken)])[0])
