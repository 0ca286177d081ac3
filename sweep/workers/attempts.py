"""Attempts at trials in workers, and the storing of results.

A failed trial runs again if the spec asks for retries. A long trial resumes from its
checkpoint, if there is one. This module deletes the checkpoint of a trial when the
trial is stored, and when a trial that took too long runs again.
"""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from functools import partial

from sweep.design import Job, LinkedJobs, job_seconds
from sweep.spec import Study
from sweep.store import Store, Tables, Writer
from sweep.trial import Result, after, failed, is_brief, overdue, result_bytes
from sweep.workers.checkpoint_folder import Checkpoints
from sweep.workers.executors import ExecutorFactory
from sweep.workers.failures import Failures
from sweep.workers.flying import NewTrials
from sweep.workers.runner import drive


def run_jobs(
    study: Study,
    jobs: Sequence[Job],
    store: Store,
    tables: Tables,
    executor: ExecutorFactory,
    failures: Failures,
    noted: Callable[[list[Result]], None] = lambda _results: None,
) -> None:
    """Run trials and store their results.

    Chains of linked jobs run whole, link after link. If the spec asks for retries,
    failed trials run again at the end, and only the last outcome is stored. All
    finished trials are stored, even if an error is raised.

    Parameters
    ----------
    study : Study
        Study of the jobs, with its time limit, retries and checkpoints.
    jobs : sequence of Job
        Trials to run; at least one.
    store : Store
        Store of the study.
    tables : Tables
        Maker of the tables of a part from results.
    executor : ExecutorFactory
        Engine that runs the jobs.
    failures : Failures
        Failed trials that the launch knows already; new failures are added.
    noted : callable, optional
        Called with results after the store has received the results.

    Raises
    ------
    FailedTrialsError
        As soon as more trials of the study have failed than are allowed.
    KeyboardInterrupt
        After Ctrl-C.
    """
    failures.check()
    executor.flying.prepare(jobs[0])
    checkpoints = Checkpoints.of(store.folder)

    def stored(results: list[Result]) -> None:
        _discard(checkpoints, results)

    outcomes = closing(_outcomes(study, jobs, executor, checkpoints, failures=failures))
    with (
        Writer[Result](store, tables, size=result_bytes, stored=stored) as writer,
        outcomes as arriving,
    ):
        for results in arriving:
            writer.add(results)
            noted(results)
            failures.note(results)
    failures.check()


def _outcomes(
    study: Study,
    jobs: Sequence[Job],
    executor: ExecutorFactory,
    checkpoints: Checkpoints,
    failures: Failures,
) -> Generator[list[Result], None, None]:
    """Yield the last outcome of every job, in the order of arrival.

    In each further round the failed jobs run again.
    """
    rounds = 1 + study.policy.retries
    for attempt in range(1, rounds):
        again: list[Result] = []
        for results in _driven(study, jobs, executor, checkpoints):
            again += [result for result in results if result.has_failed]
            late = [result for result in results if result.status == "timeout"]
            _discard(checkpoints, late)
            yield [result for result in results if not result.has_failed]
        if not again:
            return
        failures.note_again(again, f"{attempt + 1} of {rounds}")
        failed_jobs = [result.job for result in again]
        if isinstance(jobs, LinkedJobs):
            jobs = jobs.from_links(failed_jobs)
        else:
            jobs = failed_jobs
    driven = _driven(study, jobs, executor, checkpoints, ended=failures.too_many)
    for results in driven:
        yield [after(rounds, result) for result in results]


def _discard(checkpoints: Checkpoints, results: list[Result]) -> None:
    """Delete the checkpoints of some results. A brief trial never wrote one."""
    jobs = [result.job for result in results]
    if long := [job.trial_id for job in jobs if not is_brief(job)]:
        checkpoints.discard(long)


def _driven(
    study: Study,
    jobs: Sequence[Job],
    executor: ExecutorFactory,
    checkpoints: Checkpoints,
    ended: Callable[[], bool] = lambda: False,
) -> Iterator[list[Result]]:
    """Yield the outcomes of one attempt at each job.

    A job resumes from its checkpoint, if there is one.
    """
    seconds = job_seconds(jobs)
    new = NewTrials(study, jobs, seconds, executor.workers, folder=checkpoints.folder)
    sent = executor.flying.sent(new)
    return drive(
        jobs,
        sent.trial,
        executor=executor,
        costs=lambda _jobs: seconds,
        failed=failed,
        overdue=overdue,
        limits=sent.limits,
        deal=partial(sent.deal, in_order=study.order == "coarse"),
        ended=ended,
        goes_on=partial(_goes_on, jobs),
    )


def _goes_on(jobs: Sequence[Job], index: int, result: Result) -> bool:
    """Return whether another link of a chain runs after this result."""
    return isinstance(jobs, LinkedJobs) and jobs.go_on(index, result.last_flock)
