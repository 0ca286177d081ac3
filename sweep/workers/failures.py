"""The failed trials of a study, and the number that its spec allows."""

import logging
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import pyarrow as pa

from sweep.errors import FailedTrialsError
from sweep.spec import Study
from sweep.store import Store
from sweep.text import so_many
from sweep.trial import Result

LOG = logging.getLogger("sweep")
MOST_CAUSES = 5
"""Maximum number of causes that a launch, and later `sweep status`, reports."""
EACH_ONCE = (
    "; other trials continue, and each cause is reported once; on_error: stop in the"
    " spec ends a launch at the first failed trial"
)


@dataclass
class Failures:
    """The failed trials of a study, as far as a launch knows.

    Trials that earlier launches stored as failed, and that do not run again now, count
    from the beginning: the allowed number is per study, not per launch.

    Attributes
    ----------
    study : Study
    store : Store
        Store of the study.
    most : int
        Maximum number of trials of the study.
    trials : set of str
        Ids of the failed trials.
    first : tuple of str or None
        Id and error of the trial that failed first in this launch.
    causes : set of str
        Causes that were reported.
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
        """Count the failed trials among some results, and report each cause once.

        A cause that ends the launch is reported by `check` instead.
        """
        failed = [result for result in results if result.has_failed]
        if failed:
            self.first = self.first or (failed[0].job.trial_id, failed[0].error)
            self.trials.update(result.job.trial_id for result in failed)
        for result in () if self.too_many() else failed:
            self._say(result)

    def note_again(self, results: Sequence[Result], attempt: str) -> None:
        """Report that failed trials will run again.

        Parameters
        ----------
        results : sequence of Result
            Results of the failed trials; at least one.
        attempt : str
            The next attempt, such as ``2 of 3``.
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
        """Return whether more trials have failed than are allowed."""
        allowed = self.study.policy.allowed(self.most)
        return allowed is not None and len(self.trials) > allowed

    def check(self) -> None:
        """Raise FailedTrialsError if more trials have failed than are allowed."""
        if self.too_many():
            raise FailedTrialsError(self._sentence())

    def _sentence(self) -> str:
        study = self.study
        count = len(self.trials)
        most = "at most " if study.strategy_section else ""
        budget = (
            f"more than failure_budget allows ({study.policy.allowed(self.most):,})"
        )
        why = "and on_error is stop" if study.policy.on_error == "stop" else budget
        trial, error = self.first or self._first_stored()
        return (
            f"{study.name}: {count:,} of {most}{so_many(self.most, 'trial')}"
            f" {'has' if count == 1 else 'have'} failed, {why}; the first: "
            f'{in_a_line(error)} ("sweep replay {study.name} {trial}" shows it);'
            " finished trials are stored, and the same command with --retry runs the"
            " failed trials again"
        )

    def _first_stored(self) -> tuple[str, str]:
        trial = min(self.trials)
        [error] = self.store.read(
            "trials", trial_ids=pa.array([trial]), columns=["error"]
        )["error"].to_pylist()
        return trial, error


def in_a_line(error: str) -> str:
    """Return the line of an error that names its cause.

    This is the line before a traceback, or else the last line.
    """
    sentence, traced, _ = error.strip().partition("\n\nTraceback ")
    if traced and "\n" not in sentence:
        return sentence
    return error.strip().splitlines()[-1] if error.strip() else "no error message"
