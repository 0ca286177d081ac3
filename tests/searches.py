"""Small searches, and trials whose results are known, for the tests."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweep.workers.flying as flying_module
from sweep.campaigns.progress import Progress
from sweep.design.jobs import Job
from sweep.methods.search.asked_trials import AskedTrials, read_asked
from sweep.methods.search.known_values import KnownValues
from sweep.methods.search.run import Run, RunSetup
from sweep.methods.search.strategy import search
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.trial.result import Result
from sweep.workers.executors import ExecutorFactory, Serial

TINY = """
study: tiny
model: nguyen2024
preset: as_run
fixed: {n: 12, steps: 9}
search:
  parameters:
    separation_weight: {uniform: [0, 3]}
    cohesion_weight: {loguniform: [0.01, 1]}
  objectives:
    flock_radius: {minimize: mean}
  budget: 30
  batch: 4
  held_out: {candidates: 2, replicates: 3}
  references: {usual: {separation_weight: 1, cohesion_weight: 0.1}}
replicates: 4
seed: 5
record: {metrics: [flock_radius], every: 9}
"""

ANALYTIC = """
study: analytic
model: aziel_chen2025
preset: as_run
fixed: {n: 3, steps: 1}
search:
  parameters:
    cohesion_weight: {uniform: [0, 1]}
    alignment_weight: {uniform: [0, 1]}
    separation_weight: {uniform: [0, 1]}
  objectives:
    coverage: {maximize: mean}
  budget: 200
  held_out: {candidates: 3, replicates: 10}
replicates: 8
seed: 1
record: {metrics: [coverage], every: 1}
"""

BEST = {"cohesion_weight": 0.3, "alignment_weight": 0.6, "separation_weight": 0.15}
"""Where the analytic coverage is largest, 0."""


def asked_by(
    spec: str,
    results: Path,
    executor: ExecutorFactory | None = None,
    repetitions: int | None = 0,
) -> AskedTrials:
    """What a search has asked for, after it has run."""
    study = parse_spec(spec)
    search(study, results, executor or Serial(), repetitions=repetitions)
    return read_asked(StoredStudy(study.name, results))


def searched(spec: str, results: Path) -> Progress:
    """The progress of a search that has run."""
    return search(parse_spec(spec), results, Serial())


def phase(
    asked: AskedTrials, run: str = "search", name: str = "search"
) -> pd.DataFrame:
    """The rows of a run and phase."""
    return asked.table[(asked.table["run"] == run) & (asked.table["phase"] == name)]


def true_coverage(settings: Mapping[str, Any]) -> float:
    """What the mean coverage of an analytic trial is, apart from what a block adds for
    all.
    """
    return float(-20 * sum((settings[name] - best) ** 2 for name, best in BEST.items()))


def analytic(noise: float = 1.0, block: float = 1.0) -> Callable[[Job], Result]:
    """A trial with the true coverage, what its block adds, and normal noise with these
    standard deviations.
    """

    def run(job: Job) -> Result:
        common = np.random.default_rng([job.seed, job.replicate]).normal(0.0, block)
        mine = [int(job.point, 16), job.seed, job.replicate]
        own = np.random.default_rng(mine).normal(0.0, noise)
        return done(job, {"coverage": true_coverage(job.settings) + common + own})

    return run


def done(job: Job, values: dict[str, float]) -> Result:
    """The result of a trial with these metrics."""
    last = dict.fromkeys(job.record.metrics, 0.0) | values
    return Result(job, "done", 0.0, job.settings["steps"], "", last, last)


def run_without_store(setup: RunSetup, trial: Callable[[Job], Result]) -> Run:
    """A run of a search for coverage at its end; `trial` gives each result, and nothing
    is stored.
    """
    known = KnownValues(["coverage"])
    run = Run(setup, known)
    for jobs in run.rounds():
        known.trials |= {job.trial_id: (trial(job).last["coverage"],) for job in jobs}
    return run


def replace_trials(
    monkeypatch: pytest.MonkeyPatch, run: Callable[[Job], Result]
) -> list[Job]:
    """Have `run` in place of trials; the jobs that it is given, as they come."""
    given: list[Job] = []

    def noting(job: Job) -> Result:
        given.append(job)
        return run(job)

    monkeypatch.setattr(flying_module, "run", noting)
    # Eight that fly together would be real ones.
    monkeypatch.setattr(
        flying_module, "worth_flying_together", lambda _jobs, _seconds: False
    )
    monkeypatch.setattr(flying_module, "warm", lambda _job: None)
    return given


def equal(one: AskedTrials, other: AskedTrials) -> None:
    """Assert that two searches have asked for the same and found the same, to the last
    bit.
    """
    pd.testing.assert_frame_equal(one.table, other.table, check_exact=True)
    assert one.description == other.description


def edited(spec: str, *changes: Sequence[str]) -> str:
    """The spec with each of some texts, which must be there, in place of another."""
    for old, new in changes:
        assert old in spec
        spec = spec.replace(old, new)
    return spec
