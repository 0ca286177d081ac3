"""Jobs that hang or take too much memory are ended from outside, and no other job is
lost, doubled or blamed.
"""

import re
import signal
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from psutil import Process

import sweep.workers.flying as flying_module
from sweep.campaigns.launching import launch
from sweep.spec.study import parse_spec
from sweep.tables.stored_study import StoredStudy
from sweep.workers.chunks import Chunks
from sweep.workers.executors import Loky, Serial
from sweep.workers.runner import Failure
from sweep.workers.watch import Limits, beyond
from tests import runner_jobs
from tests.faults import jobs, troubled
from tests.patience import PATIENCE
from tests.studies import SMALL

SQUARES = {(job, job * job) for job in range(40)}


@pytest.fixture
def loky() -> Iterator[Loky]:
    executor = Loky(2)
    yield executor
    executor.stop()


@pytest.fixture
def one_worker() -> Iterator[Loky]:
    """For trials, whose workers take a second to start: what becomes of the jobs of
    others is shown with squares.
    """
    executor = Loky(1)
    yield executor
    executor.stop()


def test_what_lies_beyond_a_limit_is_said() -> None:
    """Of this process, which has a second behind it and some megabytes."""
    me = Process()
    within = [Limits(), Limits(deadline=1.5), Limits(memory=2**60), Limits(1.5, 2**60)]
    assert [beyond(limits, 1.0, me) for limits in within] == [(False, "")] * 4
    error = "did not return within 0.5 s, and was ended"
    assert beyond(Limits(deadline=0.5, memory=1), 1.0, me) == (True, error)
    late, error = beyond(Limits(deadline=1.5, memory=3 * 2**20), 1.0, me)
    found = re.fullmatch(r"memory limit of 3 MiB: its worker held (\d+) MiB", error)
    assert found is not None
    assert not late
    assert 3 < int(found[1]) <= me.memory_info().rss / 2**20 + 100


def late(job: Any, error: str) -> tuple[Any, str]:
    return job, f"late: {error}"


@pytest.mark.slow
def test_jobs_that_hang_are_ended_and_no_other_is_touched(loky: Loky) -> None:
    results = runner_jobs.run_all(
        range(40),
        jobs.square_or_hang,
        loky,
        overdue=late,
        limits=Limits(deadline=3.0),
        deal=partial(Chunks, seconds=0.5),
    )
    assert len(results) == 40
    ended = {job: value for job, value in results if job in (7, 11)}
    assert ended == dict.fromkeys(
        (7, 11), "late: did not return within 3 s, and was ended"
    )
    assert {pair for pair in results if pair[0] not in ended} == {
        pair for pair in SQUARES if pair[0] not in ended
    }


@pytest.mark.slow
def test_without_a_word_for_lateness_a_job_that_hangs_has_failed(loky: Loky) -> None:
    [(job, failure)] = runner_jobs.run_all(
        [7], jobs.square_or_hang, loky, limits=Limits(deadline=0.5)
    )
    assert (job, failure) == (7, Failure("did not return within 0.5 s, and was ended"))


@pytest.mark.slow
def test_a_job_that_takes_more_and_more_memory_is_ended_near_its_limit(
    loky: Loky,
) -> None:
    """It takes 1 GB a second; the bound leaves a busy machine two seconds to look."""
    limit = 300 * jobs.MEGABYTE
    results = dict(
        runner_jobs.run_all(
            range(20), jobs.square_or_grow, loky, limits=Limits(memory=limit)
        )
    )
    assert len(results) == 20
    failure = results.pop(5)
    assert results == {job: job * job for job in range(20) if job != 5}
    found = re.fullmatch(
        r"memory limit of 300 MiB: its worker held (\d+) MiB", failure.error
    )
    assert found is not None
    assert 300 <= int(found[1]) < 2300  # as rounded


@pytest.mark.slow
@pytest.mark.filterwarnings(
    "ignore:A worker stopped while some jobs were given:UserWarning"
)
def test_a_job_is_not_blamed_for_the_memory_that_others_left(loky: Loky) -> None:
    limits = Limits(memory=600 * jobs.MEGABYTE)
    results = runner_jobs.run_all(
        range(8),
        jobs.square_and_leave,
        loky,
        limits=limits,
        deal=partial(Chunks, seconds=10.0),
    )
    assert sorted(results) == [(job, job * job) for job in range(8)]


def test_jobs_within_their_limits_come_back_as_without(loky: Loky) -> None:
    limits = Limits(deadline=60.0, memory=2**40)
    results = runner_jobs.run_all(
        range(40), jobs.square, loky, limits=limits, deal=partial(Chunks, seconds=0.001)
    )
    assert len(results) == 40
    assert set(results) == SQUARES


def test_this_process_is_not_ended_for_its_own_jobs() -> None:
    results = runner_jobs.run_all(
        [0.3], runner_jobs.nap, Serial(), limits=Limits(deadline=0.01, memory=1)
    )
    assert results == [0.3]


def test_a_trial_that_hangs_is_a_row_with_status_timeout(
    tmp_path: Path, one_worker: Loky, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flying_module, "run", jobs.trial_or_hang)
    monkeypatch.setattr(flying_module, "GRACE_SECONDS", 2.5)
    launch(parse_spec(SMALL + "time_limit: 0.5\n"), tmp_path, one_worker)
    trials = StoredStudy("small", tmp_path).trials
    assert list(trials["status"]) == ["timeout"] + ["diverged"] * 5
    assert trials["error"][0] == "did not return within 3 s, and was ended"


@pytest.mark.slow
def test_a_trial_beyond_its_memory_is_tried_again_and_no_other_is_touched(
    tmp_path: Path,
    one_worker: Loky,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    """It succeeds then, and leaves no trace; the one that always raises says how often
    it was tried.
    """
    counts = tmp_path / "runs"
    counts.mkdir()
    monkeypatch.setattr(
        flying_module, "run", partial(troubled.fails_at_first, str(counts))
    )
    launch(
        parse_spec(SMALL + "on_error: retry\nretries: 1\nmemory_limit: 600 MiB\n"),
        tmp_path,
        one_worker,
    )
    trials = StoredStudy("small", tmp_path).trials
    assert list(trials["status"]) == ["diverged"] * 4 + ["failed", "diverged"]
    assert trials["error"][4].startswith("after 2 attempts: Traceback")
    assert trials["error"][4].endswith("ValueError: no luck\n")
    assert set(trials["error"].drop(4)) == {""}
    assert (counts / trials["trial_id"][0]).read_text() == "xxx"
    again, failed = caplog.messages
    assert again.startswith("small: attempt 2 of 2 will follow for 2 trials that")
    assert "ValueError: no luck" in failed


@pytest.mark.slow
def test_trials_that_hang_or_kill_their_worker_are_tried_again(
    tmp_path: Path, loky: Loky, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flying_module, "run", troubled.hangs_or_dies)
    monkeypatch.setattr(flying_module, "GRACE_SECONDS", 2.5)
    launch(
        parse_spec(SMALL + "on_error: retry\nretries: 1\ntime_limit: 0.5\n"),
        tmp_path,
        loky,
    )
    study = StoredStudy("small", tmp_path)
    assert list(study.trials["status"]) == ["timeout", "failed"] + ["diverged"] * 4
    late, dead = study.trials["error"][:2]
    assert late == "after 2 attempts: did not return within 3 s, and was ended"
    assert dead.startswith(
        "after 2 attempts: worker process died 3 times while running this trial alone"
    )


def test_a_worker_killed_in_the_middle_of_a_result_does_not_hang_the_launch(
    loky: Loky, tmp_path: Path
) -> None:
    """Without a check the pool waits for the rest for ever."""
    marker = tmp_path / "sender"
    signal.signal(signal.SIGALRM, lambda *_: pytest.fail("the pool waits for ever"))
    signal.alarm(int(PATIENCE))
    results = runner_jobs.run_all(
        [(job, str(marker)) for job in range(8)], jobs.die_while_sending, loky
    )
    signal.alarm(0)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    assert marker.exists()
    assert sorted(results) == list(range(8))
