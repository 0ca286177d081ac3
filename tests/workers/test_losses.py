"""What the drive loop makes of lost chunks: nobody is blamed who is not known to be at
fault.
"""

from collections import Counter
from collections.abc import Callable
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from typing import Any

import pytest

from sweep.errors import WorkersError
from sweep.workers import fingerprint
from sweep.workers.chunks import Chunks
from sweep.workers.executors import (
    ConnectionLostError,
    JobEndedError,
    NotYetError,
    WorkerDiedError,
)
from sweep.workers.runner import Failure, drive
from sweep.workers.watch import LimitKeeper, Limits, Overrun
from tests import runner_jobs

SQUARES = [(job, job * job) for job in range(40)]

Trouble = Callable[[list[int]], Exception | None]


@dataclass
class Fickle:
    """An engine in this process that loses the chunks for
    which `trouble` has an error.
    """

    workers: int = 2
    trouble: Trouble | None = None
    away: int = 0
    """How often there is no executor yet when it is asked for."""
    starts: int = 0
    sent: list[list[int]] = field(default_factory=list)

    def start(self) -> Executor:
        if self.away:
            self.away -= 1
            raise NotYetError("not yet")
        self.starts += 1
        return _Fickle(self)

    def stop(self) -> None:
        """Nothing is running between two calls."""

    def check(self) -> None:
        """Every loss is known at once."""

    def watch(self, _limits: Limits) -> LimitKeeper:
        """Nobody keeps limits; `trouble` decides."""
        return LimitKeeper()


class _Fickle(Executor):
    def __init__(self, engine: Fickle) -> None:
        self.engine = engine

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        _run, jobs, *_others = args
        self.engine.sent.append(list(jobs))
        future: Future[Any] = Future()
        if jobs and self.engine.trouble and (error := self.engine.trouble(list(jobs))):
            future.set_exception(error)
        else:
            future.set_result(fn(*args, **kwargs))
        return future


def squares(engine: Fickle, **options: Any) -> list[tuple[int, Any]]:
    """The results of all jobs in order, each once."""
    results = runner_jobs.run_all(range(40), runner_jobs.square, engine, **options)
    assert sorted(job for job, _ in results) == list(range(40))
    return sorted(results, key=lambda pair: pair[0])


def first(times: int, error: Callable[[], Exception], job: int = 7) -> Trouble:
    """The chunks with `job` are lost, so many times."""
    lost: Counter[int] = Counter()

    def trouble(jobs: list[int]) -> Exception | None:
        if job not in jobs or lost[job] == times:
            return None
        lost[job] += 1
        return error()

    return trouble


def test_a_chunk_that_is_lost_alone_is_split_and_runs_among_all_others() -> None:
    engine = Fickle(trouble=first(1, lambda: WorkerDiedError(1, "gone")))
    assert squares(engine) == SQUARES
    assert engine.starts == 1
    [lost, again] = [position for position, jobs in enumerate(engine.sent) if 7 in jobs]
    assert len(engine.sent[lost]) > 1
    assert engine.sent[again] == [7]


def test_a_job_is_blamed_for_workers_that_died_when_it_had_begun_and_no_other() -> None:
    queued, guilty = (
        first(9, lambda: WorkerDiedError(0, "gone"), 8),
        first(9, lambda: WorkerDiedError(2, "gone"), 7),
    )
    engine = Fickle(trouble=lambda jobs: queued(jobs) or guilty(jobs))
    results = dict(squares(engine))
    words = "worker process died 4 times while running this trial alone: gone"
    assert results.pop(7) == Failure(words)
    assert results == {job: value for job, value in SQUARES if job != 7}


def test_a_lost_connection_is_nobodys_fault_and_the_engine_is_started_again() -> None:
    engine = Fickle(trouble=first(9, lambda: ConnectionLostError("cut")))
    assert squares(engine) == SQUARES
    assert engine.starts == 10
    assert all(jobs != [7] for jobs in engine.sent)


def test_an_engine_that_is_not_there_yet_is_waited_for() -> None:
    engine = Fickle(away=2)
    assert squares(engine) == SQUARES
    assert engine.away == 0


def test_a_late_job_is_a_row_at_once_one_of_too_much_memory_after_another_try() -> None:
    ended: list[list[int]] = []

    def trouble(jobs: list[int]) -> Exception | None:
        for job, late in ((7, True), (20, False)):
            if job in jobs:
                ended.append(jobs)
                return JobEndedError(
                    Overrun(jobs.index(job), late, "too late" if late else "too much")
                )
        return None

    results = dict(
        squares(Fickle(trouble=trouble), overdue=lambda job, error: (job, error))
    )
    assert (results.pop(7), results.pop(20)) == ("too late", Failure("too much"))
    assert results == {job: value for job, value in SQUARES if job not in (7, 20)}
    assert sum(7 in jobs for jobs in ended) == 1
    assert [jobs for jobs in ended if 20 in jobs][1:] == [[20]]


def test_workers_that_come_get_work_and_smaller_chunks() -> None:
    engine = Fickle(workers=1)
    sizes = []
    batches = drive(
        range(1000),
        runner_jobs.square,
        executor=engine,
        costs=runner_jobs.a_millisecond,
        failed=runner_jobs.failed,
        deal=partial(Chunks, seconds=1e9),
    )
    for batch in batches:
        sizes.append(len(batch))
        engine.workers = 20
    assert sizes[:2] == [1, 1]
    assert max(sizes[3:]) <= 1000 / 60


def test_a_worker_of_other_code_ends_the_loop_with_what_is_done(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    engine, kept = Fickle(), []
    batches = drive(
        range(40),
        runner_jobs.square,
        executor=engine,
        costs=runner_jobs.a_millisecond,
        failed=runner_jobs.failed,
        deal=partial(Chunks, seconds=1e-6),
    )
    kept += next(batches)
    monkeypatch.setattr(
        fingerprint,
        "refusal",
        lambda _expected: "other code in sweep/trial/simulation.py",
    )
    message = (
        "have changed since this launch began: other code in"
        " sweep/trial/simulation.py; finished trials are stored"
    )
    with pytest.raises(WorkersError, match=message):
        kept.extend(chain.from_iterable(batches))
    assert set(kept) == set(SQUARES[:4])  # those that were in flight
