"""Runs a random sample of stored trials again and compares every bit. Trials that a
device has flown have those of a processor, and the other way round: so a sample of them
may be flown where they were not.

On one machine, with the same versions, a job always gives the same bits. Between
machines nobody can promise that: sin, cos, exp and log come from the mathematics
library of the system, and LLVM compiles for the processor of the machine.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.identity import as_now
from sweep.design.cost import job_seconds
from sweep.design.jobs import Job
from sweep.errors import ChoiceError, StoreError
from sweep.replays.bits import BitDifference, differences, values_compared
from sweep.store.origin import machine_said
from sweep.store.provenance import machine
from sweep.tables.stored_study import StoredStudy
from sweep.tables.stored_trials import (
    StoredTrial,
    by_origin,
    by_part,
    stored_trials,
)
from sweep.text import so_many
from sweep.trial.result import failed
from sweep.workers.executors import ExecutorFactory
from sweep.workers.runner import drive

REPEATABLE = ("done", "diverged", "failed")
"""A repeated trial has the same status if it is one of these. Timeouts and dead workers
depend on the machine.
"""
CONFIDENCE = 0.95
MOST_LISTED = 20
OTHER_NOW = "another file now; the trials ran by that of then"
NOT_PROMISED = (
    "The same bits are promised on one machine with the same versions. Another"
    " processor or version of LLVM,\nor another mathematics library where a model of"
    " yours calls one, may round differently, in the last place\nfirst: such a"
    " difference is no error of the store."
)


class Refused(NamedTuple):
    """Why a stored trial cannot run again."""

    why: str

    def __str__(self) -> str:
        return self.why


@dataclass
class Verification:
    """What was compared, and what differs.

    `stored` counts the trials of the spec that can be compared, `left_out` the others
    by their reason. `checked` counts compared trials by status, `values` the compared
    values by table, and `origins` the trials by the processor and versions with which
    they were computed. `other_now` are the files beside the spec that are no longer the
    code by which trials ran, then and now. `among` says what the trials of which it is
    a sample have in common, and `device` on what they are flown again, if not on a
    processor.
    """

    study: str
    stored: int
    seed: int
    left_out: Counter[str]
    checked: Counter[str] = field(default_factory=Counter)
    values: Counter[str] = field(default_factory=Counter)
    origins: Counter[str] = field(default_factory=Counter)
    differing: dict[str, Sequence[BitDifference | Refused]] = field(
        default_factory=dict
    )
    other_now: set[Path] = field(default_factory=set)
    among: str = ""
    device: dict[str, str] | None = None

    @property
    def same(self) -> bool:
        """Whether no bit differs."""
        return not self.differing

    def note(self, stored: StoredTrial, found: list[BitDifference]) -> None:
        """Count a trial that has been run again."""
        self.checked[stored.row["status"]] += 1
        self.values.update(values_compared(stored))
        self.origins[machine_said(stored.provenance)] += 1
        if found:
            self.differing[stored.row["trial_id"]] = found

    def refuse(self, stored: StoredTrial, why: StoreError) -> None:
        """Count a trial that cannot run again. It counts as one that differs from its
        row.
        """
        self.checked[str(stored.row["status"])] += 1
        self.differing[stored.row["trial_id"]] = [Refused(str(why))]

    def as_text(self) -> str:
        """The verification as text."""
        checked, differing = self.checked.total(), len(self.differing)
        compared = ", ".join(
            f"{count:,} values of {name}"
            for name, count in self.values.items()
            if count
        )
        lines = [
            f"study      {self.study}",
            (
                f"checked    {checked:,} of {so_many(self.stored, 'stored trial')}"
                f"{self.among} (seed {self.seed}): {_words(self.checked)}"
            ),
            f"compared   {compared}",
        ]
        lines += [f"left out   {_words(self.left_out)}"] if self.left_out else []
        lines += [
            f"then       {origin}: {so_many(count, 'trial')}"
            for origin, count in self.origins.most_common()
        ]
        lines += [
            f"now        {machine_said(self._now())}",
            *(f"code       {path}: {OTHER_NOW}" for path in sorted(self.other_now)),
            f"result     {checked - differing:,} of {checked:,} the same",
        ]
        lines.append(f"bound      {self._bound()}")
        every = [one for found in self.differing.values() for one in found]
        lines += [str(difference) for difference in every[:MOST_LISTED]]
        if len(every) > MOST_LISTED:
            lines.append(
                f"{len(every) - MOST_LISTED:,} more differ; trials:"
                f" {', '.join(self.differing)}"
            )
        return "\n".join([*lines, NOT_PROMISED])

    def _now(self) -> dict[str, Any]:
        return machine() | ({"device": self.device} if self.device else {})

    def _bound(self) -> str:
        checked, differing = self.checked.total(), len(self.differing)
        if checked == self.stored:
            return (
                f"{differing:,} of all {checked:,} trials differ:"
                " none was left to chance"
            )
        percent = 100 * upper_bound(checked, differing)
        sure = f"with {100 * CONFIDENCE:.0f} % confidence"
        differ = f"at most {percent:.3g} % of the trials differ"
        return f"{differ}, {sure} (Clopper and Pearson)"


def verify(
    study: StoredStudy,
    executor: ExecutorFactory,
    *,
    fraction: float = 0.01,
    most: int = 1000,
    seed: int = 0,
    elsewhere: bool = False,
    report: Callable[[int, int], None] = lambda _done, _all: None,
) -> Verification:
    """Run a random sample of the stored trials of the spec again, and compare every
    bit.

        study      the stored study
        executor   runs the trials
        fraction   how much of all trials, from 0 to 1; at least one trial is drawn
        most       the largest sample
        seed       the sample is drawn from it, without replacement
        elsewhere  whether the sample is drawn from trials that flew elsewhere than the
                   executor flies them, on a device or not, where there are such
        report     is told how many of how many trials have been compared

    A trial that no launch can have written counts as one that differs; one that cannot
    fly where the executor flies it is left out. Raises
    ChoiceError for another fraction; StoreError if the trials were computed by other
    kernels, if there are none, and for a damaged part.
    """
    if not 0 <= fraction <= 1:
        raise ChoiceError(f"fraction: {fraction:g}; allowed: from 0 to 1, as 0.01")
    device = executor.flying.device
    among = _flown_elsewhere(study, device) if elsewhere else None
    sample, verification = _drawn(study, fraction, most, seed, among)
    verification.device = device
    report(0, len(sample))
    for trial_ids in by_part(study.store, sample):
        found = stored_trials(study.store, trial_ids)
        repeatable = [trial for trial in found if not _worker_died(trial)]
        verification.left_out["worker died"] += len(found) - len(repeatable)
        _check(
            study,
            repeatable,
            executor,
            verification,
            lambda: report(verification.checked.total(), len(sample)),
        )
    verification.left_out = +verification.left_out
    verification.stored -= verification.left_out["worker died"]
    if not verification.checked:
        raise StoreError(
            f"study {study.name}: no trial can be compared; left out are"
            f" {_words(verification.left_out)}"
        )
    return verification


class Among(NamedTuple):
    """Some of the stored trials, and what they have in common, in words."""

    trial_ids: set[str]
    words: str


def _flown_elsewhere(study: StoredStudy, device: dict[str, str] | None) -> Among | None:
    """The stored trials that flew on a device if those now do not, and the other way
    round; None where there are none.
    """
    stored = by_origin(study.store, [*study.store.trial_ids()])
    found = {
        trial
        for about, trial_ids in stored
        for trial in trial_ids
        if ("device" in about) != bool(device)
    }
    words = " that a processor flew" if device else " that a device flew"
    return Among(found, words) if found else None


def _drawn(
    study: StoredStudy,
    fraction: float,
    most: int,
    seed: int,
    among: Among | None = None,
) -> tuple[list[str], Verification]:
    """The sample, and a verification with no comparison yet."""
    check_code(study)
    stored, plan = study.store.trial_ids(), study.plan["trial_id"].to_pylist()
    comparable = [trial for trial in plan if stored.get(trial) in REPEATABLE]
    if among and (some := [one for one in comparable if one in among.trial_ids]):
        comparable = some
    else:
        among = None
    left_out = Counter(
        stored[trial]
        for trial in plan
        if trial in stored and stored[trial] not in REPEATABLE
    )
    if not comparable:
        raise StoreError(
            f"study {study.name}: no trial of the spec is stored that could be compared"
        )
    size = max(1, min(most, math.ceil(fraction * len(comparable))))
    chosen = np.random.default_rng(seed).choice(len(comparable), size, replace=False)
    return [comparable[index] for index in sorted(chosen)], Verification(
        study.name,
        len(comparable),
        seed,
        left_out,
        among=among.words if among else "",
    )


def check_code(study: StoredStudy) -> None:
    """Raise StoreError if other code than this has computed the trials of a study: run
    again, they would be compared with nothing.
    """
    if changes := _code_changes(study):
        commit = study.provenance["git"].get("commit")
        where = f"check out {commit}" if commit else "install the version of then"
        raise StoreError(
            f"study {study.name} was computed by other code ({', '.join(changes)}):"
            f" there is nothing to compare; {where} to verify it"
        )


def _code_changes(study: StoredStudy) -> list[str]:
    """What is no longer the code that computed the trials, in words."""
    then = study.code
    return (
        then.changes(as_now(then, study.running(study.provenance)))
        if then
        else ["by a version before 0.7"]
    )


def _worker_died(trial: StoredTrial) -> bool:
    return trial.row["status"] == "failed" and "Traceback" not in str(
        trial.row["error"]
    )


def _check(
    study: StoredStudy,
    trials: list[StoredTrial],
    executor: ExecutorFactory,
    verification: Verification,
    checked: Callable[[], None],
) -> None:
    stored, jobs = {trial.row["trial_id"]: trial for trial in trials}, list[Job]()
    for trial in trials:
        verification.other_now.update(study.other_now(trial))
        try:
            job = study.job(trial)
        except StoreError as error:
            verification.refuse(trial, error)
            continue
        if why := executor.flying.refusal(job):
            verification.left_out[f"cannot fly on a GPU ({why})"] += 1
            verification.stored -= 1
        else:
            jobs.append(job)
    if not jobs:
        return
    executor.flying.prepare(jobs[0])
    sent = executor.flying.sent_again(jobs)
    for results in drive(
        jobs,
        sent.trial,
        executor=executor,
        costs=job_seconds,
        failed=failed,
        deal=sent.deal,
    ):
        for result in results:
            trial = stored[result.job.trial_id]
            verification.note(trial, differences(study.name, trial, result))
        checked()


def upper_bound(checked: int, differing: int, confidence: float = CONFIDENCE) -> float:
    """The one-sided upper bound of Clopper and Pearson for the share of trials that
    differ, if `differing` of `checked` do.

    The bound is exact for a sample drawn with replacement. Our sample is drawn without;
    for it the bound is somewhat too high, which is the safe side.
    """
    from scipy.stats import beta

    return (
        float(beta.ppf(confidence, differing + 1, checked - differing))
        if differing < checked
        else 1.0
    )


def _words(counts: Counter[str]) -> str:
    return ", ".join(f"{count:,} {name}" for name, count in sorted(counts.items()))
