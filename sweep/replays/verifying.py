"""A random sample of stored trials, run again and compared bit for bit.

Results of a GPU and of a processor are bitwise identical. So the sample may run on a
device of the other kind.

On one machine, with unchanged versions, results of a job are bitwise identical. Between
machines results may differ: sin, cos, exp and log come from the mathematics library of
the system, and LLVM compiles for the processor of the machine.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from kernels.identity import as_now
from sweep.design import Job, job_seconds
from sweep.errors import ChoiceError, StoreError
from sweep.replays.bits import BitDifference, differences, values_compared
from sweep.store import machine, machine_said
from sweep.tables import (
    StoredStudy,
    StoredTrial,
    by_origin,
    by_part,
    stored_trials,
)
from sweep.text import so_many
from sweep.trial import failed
from sweep.workers import ExecutorFactory, drive

REPEATABLE = ("done", "diverged", "failed")
"""Statuses that are reproducible.

Timeouts and dead workers depend on the machine.
"""
CONFIDENCE = 0.95
MOST_LISTED = 20
OTHER_NOW = "another file now; the trials ran with the stored code"
NOT_PROMISED = (
    "Results are bitwise identical on one machine with the same package versions."
    " Another processor or LLVM\nversion may round differently. So may another"
    " mathematics library, if a custom model calls the library.\nA difference in"
    " rounding is no error of the store."
)


class Refused(NamedTuple):
    """The reason why a stored trial cannot run again."""

    why: str

    def __str__(self) -> str:
        return self.why


@dataclass
class Verification:
    """The result of a comparison of stored trials with repeated trials.

    Attributes
    ----------
    study : str
        The name of the study.
    stored : int
        The number of trials of the spec that can be compared.
    seed : int
        The seed of the sample.
    left_out : Counter
        Numbers of trials that cannot be compared, by reason.
    checked : Counter
        Numbers of compared trials, by status.
    values : Counter
        Numbers of compared values, by table.
    origins : Counter
        Numbers of trials, by the processor and versions of the stored run.
    differing : dict
        The differences of trials that differ, by trial id.
    other_now : set of Path
        Files next to the spec that have changed. Trials ran, and run again, with the
        stored code.
    among : str
        The common property of the sampled trials, in words, or "".
    device : dict, optional
        The device that runs the trials again; None for a processor.
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
        """True if all compared values are bitwise identical."""
        return not self.differing

    def count(self, stored: StoredTrial, differing: list[BitDifference]) -> None:
        """Count a trial that ran again.

        Parameters
        ----------
        stored : StoredTrial
            The stored trial.
        differing : list of BitDifference
            The differences of its values; empty if all are bitwise identical.
        """
        self.checked[stored.row["status"]] += 1
        self.values.update(values_compared(stored))
        self.origins[machine_said(stored.provenance)] += 1
        if differing:
            self.differing[stored.row["trial_id"]] = differing

    def count_refused(self, stored: StoredTrial, reason: StoreError) -> None:
        """Count a trial that cannot run again as one that differs.

        Parameters
        ----------
        stored : StoredTrial
            The stored trial.
        reason : StoreError
            The reason why it cannot run again.
        """
        self.checked[str(stored.row["status"])] += 1
        self.differing[stored.row["trial_id"]] = [Refused(str(reason))]

    def as_text(self) -> str:
        """Return the verification as text."""
        checked = self.checked.total()
        differing = len(self.differing)
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
            f"result     {checked - differing:,} of {checked:,} bitwise identical",
        ]
        lines.append(f"bound      {self._bound()}")
        differences = [*chain.from_iterable(self.differing.values())]
        lines += [str(difference) for difference in differences[:MOST_LISTED]]
        if len(differences) > MOST_LISTED:
            lines.append(
                f"{len(differences) - MOST_LISTED:,} more differ; trials:"
                f" {', '.join(self.differing)}"
            )
        return "\n".join([*lines, NOT_PROMISED])

    def _now(self) -> dict[str, Any]:
        return machine() | ({"device": self.device} if self.device else {})

    def _bound(self) -> str:
        checked = self.checked.total()
        differing = len(self.differing)
        if checked == self.stored:
            return (
                f"{differing:,} of all {checked:,} trials differ;"
                " every trial was checked"
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
    """Run a random sample of the stored trials again and compare it, bit for bit.

    A trial that no launch can have written counts as a difference. A trial that the
    executor cannot run is left out.

    Parameters
    ----------
    study : StoredStudy
        The stored study.
    executor : ExecutorFactory
        The engine that runs the trials.
    fraction : float, default 0.01
        The fraction of all trials, from 0 to 1; at least one trial is drawn.
    most : int, default 1000
        The largest sample.
    seed : int, default 0
        The seed of the sample, which is drawn without replacement.
    elsewhere : bool, default False
        Prefer trials that ran on the other kind of device: on a GPU if the executor
        uses processors, and the other way round.
    report : callable, optional
        The callback with the numbers of compared trials and of all sampled trials.

    Returns
    -------
    Verification
        The result.

    Raises
    ------
    ChoiceError
        `fraction` is not from 0 to 1.
    StoreError
        Other code computed the trials, no trial can be compared, or a part is damaged.
    """
    if not 0 <= fraction <= 1:
        raise ChoiceError(f"fraction: {fraction:g}; allowed: 0 to 1, such as 0.01")
    device = executor.flying.device
    among = _ran_elsewhere(study, device) if elsewhere else None
    sample, verification = _drawn(study, fraction, most, seed, among=among)
    verification.device = device
    report(0, len(sample))
    for trial_ids in by_part(study.store, sample):
        stored = stored_trials(study.store, trial_ids)
        repeatable = [trial for trial in stored if not _worker_died(trial)]
        verification.left_out["worker died"] += len(stored) - len(repeatable)
        _check(
            study,
            repeatable,
            executor,
            verification,
            checked=lambda: report(verification.checked.total(), len(sample)),
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
    """A group of stored trials, and the common property of the trials in words."""

    trial_ids: set[str]
    description: str


def _ran_elsewhere(study: StoredStudy, device: dict[str, str] | None) -> Among | None:
    """Return the stored trials that ran on the other kind of device, or None.

    With a `device`, the trials ran on a processor; without, on a device.
    """
    by_provenance = by_origin(study.store, [*study.store.trial_ids()])
    elsewhere = {
        trial
        for provenance, trial_ids in by_provenance
        for trial in trial_ids
        if ("device" in provenance) != bool(device)
    }
    description = " that a processor computed" if device else " that a device computed"
    return Among(elsewhere, description) if elsewhere else None


def _drawn(
    study: StoredStudy,
    fraction: float,
    most: int,
    seed: int,
    *,
    among: Among | None = None,
) -> tuple[list[str], Verification]:
    """Draw the sample, and return it with a verification without comparisons."""
    check_code(study)
    stored = study.store.trial_ids()
    plan = study.plan["trial_id"].to_pylist()
    comparable = [trial for trial in plan if stored.get(trial) in REPEATABLE]
    if among and (some := [trial for trial in comparable if trial in among.trial_ids]):
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
            f"study {study.name}: the store has no trial of the spec to compare"
        )
    size = max(1, min(most, math.ceil(fraction * len(comparable))))
    chosen = np.random.default_rng(seed).choice(len(comparable), size, replace=False)
    return [comparable[index] for index in sorted(chosen)], Verification(
        study.name,
        len(comparable),
        seed,
        left_out,
        among=among.description if among else "",
    )


def check_code(study: StoredStudy) -> None:
    """Raise StoreError if other code computed the trials of a study.

    Such a comparison would have no meaning.
    """
    if changes := _code_changes(study):
        commit = study.provenance["git"].get("commit")
        where = f"check out {commit}" if commit else "install the earlier version"
        raise StoreError(
            f"study {study.name} was computed by other code ({', '.join(changes)}):"
            f" {where} to verify the study"
        )


def _code_changes(study: StoredStudy) -> list[str]:
    """Return the changes of the code since the trials ran, in words."""
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
    *,
    checked: Callable[[], None],
) -> None:
    """Run stored trials again and count the trials; call `checked` after each batch."""
    stored = {trial.row["trial_id"]: trial for trial in trials}
    jobs = list[Job]()
    for trial in trials:
        verification.other_now.update(study.other_now(trial))
        try:
            job = study.job(trial)
        except StoreError as error:
            verification.count_refused(trial, error)
            continue
        if why := executor.flying.refusal(job):
            where = executor.flying.called
            verification.left_out[f"cannot run on {where} ({why})"] += 1
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
            verification.count(trial, differences(study.name, trial, result))
        checked()


def upper_bound(checked: int, differing: int, confidence: float = CONFIDENCE) -> float:
    """Return an upper bound for the fraction of trials that differ.

    The bound is the one-sided bound of Clopper and Pearson, which is exact for a sample
    with replacement. The sample here is drawn without replacement, so that the bound is
    slightly too high, and conservative.

    Parameters
    ----------
    checked : int
        The size of the sample.
    differing : int
        The number of differing trials in the sample.
    confidence : float, default 0.95
        The confidence level.

    Returns
    -------
    float
        The bound, from 0 to 1.
    """
    from scipy.stats import beta

    return (
        float(beta.ppf(confidence, differing + 1, checked - differing))
        if differing < checked
        else 1.0
    )


def _words(counts: Counter[str]) -> str:
    return ", ".join(f"{count:,} {name}" for name, count in sorted(counts.items()))
