"""What is known of trials: those in the store, and those that therefore run now."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field

import numpy as np

from sweep.design.jobs import Job
from sweep.spec.objectives import Floats
from sweep.spec.study import Study
from sweep.store.rows import Tables, trial_metrics
from sweep.store.store import Store
from sweep.tables.stored_tables import checked_numbers
from sweep.trial.result import FAILED, Result
from sweep.workers.attempts import run_jobs
from sweep.workers.executors import ExecutorFactory
from sweep.workers.failures import Failures

Known = dict[str, tuple[float, ...] | None]
"""By trial the columns that decide, in their order; None where it is not done or one of
them is not finite.
"""


@dataclass
class Ledger:
    """Trials by id: asked for what it lacks, it runs that and stores it; `noted` is
    told of results as they come.

    `failed` are the trials stored as failed that it does not run again, `reused` those
    that were asked for and known from before.
    """

    study: Study
    store: Store
    tables: Tables
    executor: ExecutorFactory
    columns: Sequence[str]
    known: Known
    noted: Callable[[list[Result]], None]
    failures: Failures
    failed: Set[str] = frozenset()
    reused: set[str] = field(default_factory=set)
    ran: set[str] = field(default_factory=set)

    def run(self, jobs: Iterable[Job]) -> bool:
        """Have the results of these jobs; whether any of them ran now.

        Raises FailedTrialsError where more trials have failed than the spec allows, and
        KeyboardInterrupt after Ctrl-C, both with all finished trials stored.
        """
        wanted = {job.trial_id: job for job in jobs}
        missing = {
            trial: job for trial, job in wanted.items() if trial not in self.known
        }
        self.reused |= wanted.keys() - missing.keys() - self.ran
        self.failures.note_stored(self.failed & wanted.keys())
        if missing:
            jobs = list(missing.values())
            tables, failures, note = self.tables, self.failures, self._note
            run_jobs(
                self.study, jobs, self.store, tables, self.executor, failures, note
            )
        return bool(missing)

    def values(self, trials: Sequence[Sequence[str]]) -> dict[str, Floats] | None:
        """By column the values of trials by block and scenario, shape (blocks,
        scenarios); None if one is lacking.
        """
        rows = [[self.known[trial] for trial in block] for block in trials]
        if any(row is None for block in rows for row in block):
            return None
        values = np.array(rows, np.float64).reshape(len(trials), -1, len(self.columns))
        return {
            column: values[:, :, place] for place, column in enumerate(self.columns)
        }

    def _note(self, results: list[Result]) -> None:
        self.ran |= {result.job.trial_id for result in results}
        for result in results:
            self.known[result.job.trial_id] = _row(
                result.status, trial_metrics(result), self.columns
            )
        self.noted(results)


def known_trials(store: Store, columns: Sequence[str], *, retry: bool) -> Known:
    """What is stored, with `retry` only what is done. Raises StoreError."""
    table = checked_numbers(store.folder, store.read("trials"), columns)
    present = [
        name for name in ("trial_id", "status", *columns) if name in table.column_names
    ]
    rows = table.select(present).to_pylist() if table.num_rows else []
    return {
        row["trial_id"]: _row(row["status"], row, columns)
        for row in rows
        if row["status"] == "done" or not retry
    }


def failed_trials(store: Store) -> set[str]:
    """The trials stored as failed. Raises StoreError where they cannot be read."""
    return {trial for trial, status in store.trial_ids().items() if status in FAILED}


def _row(
    status: str, values: Mapping[str, float | None], columns: Sequence[str]
) -> tuple[float, ...] | None:
    if status != "done":
        return None
    row = [values.get(column) for column in columns]
    numbers = tuple(
        value for value in row if value is not None and math.isfinite(value)
    )
    return numbers if len(numbers) == len(columns) else None
