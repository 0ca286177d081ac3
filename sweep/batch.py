"""Run a batch of trials in workers and store what comes back."""

from collections.abc import Callable, Sequence

from sweep.cost import job_seconds
from sweep.executors import ExecutorFactory
from sweep.jobs import Job
from sweep.result import Result, failed, overdue, result_bytes
from sweep.rows import Tables
from sweep.runner import drive
from sweep.store import Store
from sweep.trial import run, warm
from sweep.watch import Limits
from sweep.writer import Writer

GRACE_SECONDS = 10.0
"""How much longer than its time limit a trial may take before it is ended from outside: it looks at the clock itself,
between kernel calls, unless it hangs in one."""


def run_jobs(
    jobs: Sequence[Job],
    store: Store,
    tables: Tables,
    executor: ExecutorFactory,
    noted: Callable[[list[Result]], None] = lambda _results: None,
) -> None:
    """Run `jobs` and store their results; `noted` is told of each batch as it is stored.

    Raises KeyboardInterrupt after Ctrl-C with all finished trials stored.
    """
    # Compiled here once, or four cold workers would each compile the same.
    warm(jobs[0])
    limit = jobs[0].time_limit
    limits = Limits(deadline=None if limit is None else limit + GRACE_SECONDS)
    batches = drive(jobs, run, executor=executor, cost=job_seconds, failed=failed, overdue=overdue, limits=limits)
    with Writer[Result](store, tables, size=result_bytes) as writer:
        for results in batches:
            writer.add(results)
            noted(results)
