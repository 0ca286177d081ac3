"""How many trials of a study have failed, and whether its spec lets a launch go on."""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import pyarrow as pa

from sweep.errors import FailedTrialsError
from sweep.spec.study import Study
from sweep.store.store import Store
from sweep.text import so_many
from sweep.trial.result import Result

LOG = logging.getLogger("sweep")
MOST_CAUSES = 5
"""So many are said while a launch runs, and afterwards by `sweep status`."""
EACH_ONCE = (
    "; other trials go on, and each cause is said once; on_error: stop in the spec ends"
    " a launch at the first"
)


@dataclass
class Failures:
    """The failed trials of a study that a launch knows of, of `most` trials that it can
    have.

    Trials that earlier launches stored as failed, and this one does not run again,
    count from the beginning: the allowed number is for the study, not for each launch.
    """

    study: Study
    store: Store
    most: int
    trials: set[str] = field(default_factory=set)
    first: tuple[str, str] | None = None
    causes: set[str] = field(default_factory=set)

    def note_stored(self, trials: Iterable[str]) -> None:
        """Count trials that are stored as failed."""
        self.trials.update(trials)

    def note(self, results: Iterable[Result]) -> None:
        """Count the failed ones of these results, and say each cause once, unless it
        ends the launch: then `check` says it.
        """
        failed = [result for result in results if result.has_failed]
        if failed:
            self.first = self.first or (failed[0].job.trial_id, failed[0].error)
            self.trials.update(result.job.trial_id for result in failed)
        for result in () if self.too_many() else failed:
            self._say(result)

    def note_again(self, results: Sequence[Result], attempt: str) -> None:
        """Say that trials which failed so will run again, for an attempt such as `2 of
        3`.
        """
        first = in_a_line(results[0].error)
        LOG.warning(
            "%s: attempt %s will follow for %s that failed; the first error: %s",
            *(self.study.name, attempt, so_many(len(results), "trial"), first),
        )

    def _say(self, failed: Result) -> None:
        cause = in_a_line(failed.error)
        if cause in self.causes or len(self.causes) == MOST_CAUSES:
            return
        more = "" if self.causes else EACH_ONCE
        self.causes.add(cause)
        LOG.warning(
            '%s: a trial has failed: %s ("sweep replay %s %s" shows it)%s',
            *(self.study.name, cause, self.study.name, failed.job.trial_id, more),
        )

    def too_many(self) -> bool:
        """Whether more trials have failed than may."""
        allowed = self.study.policy.allowed(self.most)
        return allowed is not None and len(self.trials) > allowed

    def check(self) -> None:
        """Raise FailedTrialsError where more trials have failed than may."""
        if self.too_many():
            raise FailedTrialsError(self._sentence())

    def _sentence(self) -> str:
        study, count = self.study, len(self.trials)
        growing = study.rule or study.search
        most = "at most " if growing else ""
        budget = (
            f"more than failure_budget allows ({study.policy.allowed(self.most):,})"
        )
        why = "and on_error is stop" if study.policy.on_error == "stop" else budget
        trial, error = self.first or self._first_stored()
        return (
            f"{study.name}: {count:,} of {most}{so_many(self.most, 'trial')}"
            f" {'has' if count == 1 else 'have'} failed, {why}; the first: "
            f'{in_a_line(error)} ("sweep replay {study.name} {trial}" shows it); what'
            " is finished is stored, and the "
            "same command with --retry runs the failed ones again"
        )

    def _first_stored(self) -> tuple[str, str]:
        trial = min(self.trials)
        [error] = self.store.read(
            "trials", trial_ids=pa.array([trial]), columns=["error"]
        )["error"].to_pylist()
        return trial, error


def in_a_line(error: str) -> str:
    """The line of an error that says what it was: the one before a traceback, or else
    the last one.
    """
    sentence, traced, _ = error.strip().partition("\n\nTraceback ")
    if traced and "\n" not in sentence:
        return sentence
    return error.strip().splitlines()[-1] if error.strip() else "no word about why"
