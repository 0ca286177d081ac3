"""The drive loop: everything comes back once, whatever
dies, raises or is interrupted.
"""

import heapq
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sweep.errors import WorkersError
from sweep.store import processes
from sweep.workers import fingerprint
from sweep.workers.chunks import MAX_CHUNK_JOBS, Chunks
from sweep.workers.executors import Loky, Serial
from sweep.workers.runner import Failure, drive
from tests import ROOT, runner_jobs
from tests.patience import PATIENCE

SQUARES = {(job, job * job) for job in range(40)}


@pytest.fixture
def loky() -> Iterator[Loky]:
    executor = Loky(2)
    yield executor
    executor.stop()


@pytest.fixture(scope="module")
def warm() -> Iterator[Loky]:
    """One pool for all tests that leave its workers alive: to start them costs more
    than these tests.
    """
    executor = Loky(2)
    yield executor
    executor.stop()


def test_serial_and_parallel_deliver_the_same_for_any_chunk_size(warm: Loky) -> None:
    for executor in (Serial(), warm):
        for seconds in (0.001, 1.0, 1000.0):
            results = runner_jobs.run_all(
                range(40),
                runner_jobs.square,
                executor,
                deal=partial(Chunks, seconds=seconds),
            )
            assert len(results) == 40
            assert set(results) == SQUARES


def test_no_jobs_need_no_worker() -> None:
    executor = Loky(2)
    assert runner_jobs.run_all([], runner_jobs.square, executor) == []
    assert executor._pool is None


def test_longest_job_starts_first() -> None:
    results = runner_jobs.run_all(range(5), runner_jobs.square, Serial(), costs=list)
    assert [job for job, _ in results] == [4, 3, 2, 1, 0]


@pytest.mark.slow
def test_a_job_that_kills_its_worker_convicts_only_itself(loky: Loky) -> None:
    results = runner_jobs.run_all(range(40), runner_jobs.square_or_die, loky)
    failures = [(job, value) for job, value in results if isinstance(value, Failure)]
    assert len(results) == 40
    assert {pair for pair in results if pair not in failures} == SQUARES - {(7, 49)}
    [(job, failure)] = failures
    assert job == 7
    assert failure.error.startswith(
        "worker process died 3 times while running this trial alone"
    )


def test_a_worker_that_dies_once_loses_nothing(loky: Loky, tmp_path: Path) -> None:
    jobs = [(job, str(tmp_path / "died")) for job in range(40)]
    results = runner_jobs.run_all(jobs, runner_jobs.die_once, loky)
    assert (tmp_path / "died").exists()
    assert len(results) == 40
    assert set(results) == SQUARES


@pytest.mark.parametrize("parallel", [False, True])
def test_a_job_that_raises_fails_alone(warm: Loky, parallel: bool) -> None:
    executor = warm if parallel else Serial()
    results = dict(
        runner_jobs.run_all(range(40), runner_jobs.square_or_raise, executor)
    )
    assert len(results) == 40
    assert "ValueError: three is not allowed" in results[3].error
    assert "SystemExit: four leaves" in results[4].error
    assert sum(isinstance(value, Failure) for value in results.values()) == 2


def test_a_result_that_cannot_be_pickled_fails_alone(warm: Loky) -> None:
    results = dict(
        runner_jobs.run_all(
            range(6),
            runner_jobs.unpicklable_for_two,
            warm,
            deal=partial(Chunks, seconds=0.01),
        )
    )
    assert "no result came back" in results[2].error
    assert {job: value for job, value in results.items() if job != 2} == {
        0: 0,
        1: 1,
        3: 9,
        4: 16,
        5: 25,
    }


def test_workers_that_cannot_start_stop_the_study_instead_of_failing_every_job(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """Whatever has been edited meanwhile by somebody else."""
    with pytest.raises(
        WorkersError, match=r"^no worker process can be given a job: A worker process"
    ):
        runner_jobs.run_all(
            range(4),
            runner_jobs.square,
            Loky(1, initializer=runner_jobs.break_at_start),
        )
    assert "no such cache" in capfd.readouterr().err


@dataclass(frozen=True)
class NoneStarts(Serial):
    """An engine whose workers cannot start."""

    def start(self) -> Executor:
        raise OSError("no room")


def test_where_no_worker_starts_both_that_and_edited_code_are_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The one may be the cause of the other, or have nothing to do with it."""
    for edited, ending in (
        ("", "$"),
        (
            "sweep/design/cost.py",
            "; the code or .*: other code in sweep/design/cost.py; finished trials",
        ),
    ):
        monkeypatch.setattr(fingerprint, "edited", lambda edited=edited: edited)
        with pytest.raises(
            WorkersError,
            match=f"^no worker process can be given a job: no room{ending}",
        ):
            runner_jobs.run_all(range(4), runner_jobs.square, NoneStarts())


def test_a_worker_has_one_thread_for_each_library(warm: Loky) -> None:
    assert runner_jobs.run_all([0], runner_jobs.thread_counts, warm) == [("1", "1")]


def test_the_pool_stays_warm_between_drives(warm: Loky) -> None:
    runner_jobs.run_all(range(4), runner_jobs.square, warm)
    pool = warm.start()
    runner_jobs.run_all(range(4), runner_jobs.square, warm)
    assert warm.start() is pool


def test_closing_the_iterator_ends_the_workers_at_once() -> None:
    executor = Loky(2)
    before = runner_jobs.processes_below(os.getpid())
    jobs = [0.01] * 4 + [2 * PATIENCE] * 4
    batches = drive(
        jobs,
        runner_jobs.nap,
        executor=executor,
        costs=runner_jobs.shortest_first,
        failed=runner_jobs.failed,
    )
    next(batches)
    workers = set(executor.start()._processes)
    assert workers <= runner_jobs.processes_below(os.getpid()) - before
    start = time.monotonic()
    batches.close()
    assert time.monotonic() - start < PATIENCE
    assert not workers & runner_jobs.processes_below(os.getpid())
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_no_thread_is_left_where_a_pool_ends_that_does_not_read_its_jobs() -> None:
    """A thread that sends jobs would remove semaphores while the interpreter ends."""
    executor = Loky(1)
    threads = set(threading.enumerate())
    pool = executor.start()
    pool.submit(int).result()
    (worker,) = pool._processes
    os.kill(worker, signal.SIGSTOP)
    large = [pool.submit(len, bytes(1_000_000)) for _ in range(2)]
    executor.stop()
    assert all(job.done() for job in large)
    assert set(threading.enumerate()) <= threads


INTERRUPTED = """
import os, sys
from functools import partial
sys.path[:0] = [{root!r}]
from tests import runner_jobs
from sweep.workers.chunks import Chunks
from sweep.workers.executors import Loky
from sweep.workers.runner import drive

kept = []
executor = Loky(2)
try:
    for batch in drive([0.05] * 400 + [60.0] * 4, runner_jobs.nap, executor=executor,
                       costs=runner_jobs.shortest_first, failed=runner_jobs.failed,
                       deal=partial(Chunks, seconds=0.1)):
        kept += batch
        print("batch", flush=True)
except KeyboardInterrupt:
    print("kept", len(kept), set(kept), executor._pool, flush=True)
    sys.exit(130)
"""


def test_ctrl_c_keeps_what_is_done_and_leaves_promptly_without_orphans() -> None:
    script = INTERRUPTED.format(root=str(ROOT))
    with runner_jobs.started([sys.executable, "-c", script], ROOT) as process:
        assert process.stdout is not None
        for _ in range(6):
            assert process.stdout.readline() == "batch\n"
        workers = runner_jobs.processes_below(process.pid)
        os.killpg(process.pid, signal.SIGINT)
        output, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert errors == ""
    kept = output.splitlines()[-1].split()
    assert kept[0] == "kept"
    assert 6 <= int(kept[1]) < 100
    assert kept[2:] == ["{0.05}", "None"]
    assert len(workers) >= 2
    deadline = time.monotonic() + PATIENCE
    while any(processes.started(worker) for worker in workers):
        assert time.monotonic() < deadline, "orphan processes"
        time.sleep(0.05)


def squares_in_this_process() -> Iterator[list[tuple[int, int]]]:
    return drive(
        range(10),
        runner_jobs.square,
        executor=Serial(),
        costs=runner_jobs.a_millisecond,
        failed=runner_jobs.failed,
    )


def test_a_first_interrupt_is_held_back_until_the_batch_has_been_handled() -> None:
    batches = squares_in_this_process()
    handled = next(batches)
    signal.raise_signal(signal.SIGINT)
    handled += next(batches)  # the one that was already back
    with pytest.raises(KeyboardInterrupt):
        next(batches)
    assert len(handled) == 2
    assert set(handled) < SQUARES
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_second_interrupt_is_raised_on_the_spot() -> None:
    batches = squares_in_this_process()
    next(batches)
    signal.raise_signal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    batches.close()


def deal(
    costs: list[float], workers: int, seconds: float, pace: float, at_once: int = 1
) -> list[list[int]]:
    """Take every chunk, each taking `pace` times its estimate and seen before the next
    is dealt.
    """
    chunks = Chunks(costs, seconds=seconds, at_once=at_once)
    dealt = []
    while chunk := chunks.take(workers):
        dealt.append(chunk)
        chunks.observe(chunk, pace * sum(costs[index] for index in chunk))
    assert chunks.take(workers) == []
    return dealt


@given(
    costs=st.lists(
        st.floats(0, 1e12) | st.sampled_from([0.0, float("inf")]), max_size=300
    ),
    workers=st.integers(1, 64),
    seconds=st.floats(1e-3, 1e3),
    pace=st.floats(1e-3, 1e3),
    at_once=st.sampled_from([1, 8]),
)
def test_every_job_is_dealt_once_longest_first(
    costs: list[float], workers: int, seconds: float, pace: float, at_once: int
) -> None:
    dealt = deal(costs, workers, seconds, pace, at_once)
    left = len(costs)
    for chunk in dealt:
        assert len(chunk) % at_once == 0 or left <= at_once * workers
        left -= len(chunk)
    order = [index for chunk in dealt for index in chunk]
    assert sorted(order) == list(range(len(costs)))
    clipped = [min(max(costs[index], 1e-6), 1e9) for index in order]
    assert clipped == sorted(clipped, reverse=True)


def test_jobs_that_run_together_are_dealt_together() -> None:
    """Two long ones would otherwise make a chunk, and the first goes singly."""
    sizes = [len(chunk) for chunk in deal([0.5] * 803, 2, 1.0, 1.0, at_once=8)]
    assert sizes == [8] * 99 + [6, 3, 1, 1]
    assert len(deal([0.5] * 803, 2, 1.0, 1.0)[1]) == 2


@pytest.mark.parametrize(
    ("jobs", "workers", "most"), [(16, 4, 4), (8, 2, 4), (5, 8, 1)]
)
def test_few_jobs_that_run_together_keep_all_workers_busy(
    jobs: int, workers: int, most: int
) -> None:
    chunks = Chunks([1.0] * jobs, seconds=1.0, at_once=8)
    first = [len(chunks.take(workers)) for _ in range(min(jobs, workers))]
    assert first[0] == most
    assert min(first) >= 1


@pytest.mark.parametrize("pace", [0.1, 1.0, 10.0])
def test_chunks_approach_the_wanted_length_however_wrong_the_estimates(
    pace: float,
) -> None:
    sizes = [len(chunk) for chunk in deal([0.02] * 10_000, 2, 1.0, pace)]
    expected = 1.0 / (0.02 * pace)
    assert sizes[0] == 1
    assert all(0.9 * expected - 1 <= size <= 1.1 * expected for size in sizes[1:6])


@pytest.mark.parametrize(
    ("workers", "length"), [(10, 1), (50, 1), (100, 2), (1000, 20)]
)
def test_many_workers_get_longer_chunks_so_that_fifty_a_second_come_back(
    workers: int, length: int
) -> None:
    sizes = [len(chunk) for chunk in deal([1.0] * 200 * workers, workers, 1.0, 1.0)]
    assert set(sizes[1:1000]) == {length}


def test_chunks_have_at_most_a_thousand_jobs() -> None:
    assert (
        max(len(chunk) for chunk in deal([0.0] * 50_000, 2, 1.0, 1.0)) == MAX_CHUNK_JOBS
    )


def test_one_slow_first_chunk_is_soon_forgotten() -> None:
    chunks = Chunks([0.02] * 10_000, seconds=1.0)
    chunks.observe(chunks.take(2), 3.0)
    for _ in range(8):
        chunk = chunks.take(2)
        chunks.observe(chunk, 0.02 * len(chunk))
    assert 40 <= len(chunks.take(2)) <= 55


@pytest.mark.parametrize("workers", [2, 8])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_workers_finish_together(workers: int, seed: int) -> None:
    """Dealing to simulated workers wastes under 4 % of the time, with estimates wrong
    by half either way.
    """
    costs = np.random.default_rng(seed).lognormal(-4, 1, 4000).tolist()
    truth = [cost * (0.5 + (index % 5) / 4) for index, cost in enumerate(costs)]
    chunks = Chunks(costs, seconds=1.0)
    free = [0.0] * workers
    while chunk := chunks.take(workers):
        seconds = sum(truth[index] for index in chunk)
        chunks.observe(chunk, seconds)
        heapq.heapreplace(free, free[0] + seconds)
    assert max(free) < 1.04 * sum(truth) / workers


def test_a_million_jobs_are_ordered() -> None:
    """Work that grew with the square of their number would not end."""
    chunks = Chunks([index % 7 for index in range(1_000_000)], seconds=1.0)
    assert {index % 7 for index in chunks.take(2)} == {6}
