"""Trials on a dask cluster of real processes: the same bits as here, whatever becomes
of workers and scheduler.
"""

import os
import shutil
import signal
import threading
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from sweep.campaigns.launching import launch
from sweep.errors import WorkersError
from sweep.tables.stored_study import StoredStudy
from sweep.workers.chunks import Chunks
from sweep.workers.cluster import Dask
from sweep.workers.runner import Failure, drive
from sweep.workers.watch import Limits
from tests import runner_jobs
from tests.campaigns.test_chains import CHAINED, interrupt_after
from tests.cluster import jobs
from tests.cluster.started import ROOT, TESTS, Cluster, cluster, until
from tests.commands import sweep
from tests.faults import jobs as faulty
from tests.studies import SMALL, launched, read, same


@pytest.fixture
def engines() -> Iterator[list[Dask]]:
    """Engines that a test has made; all are stopped."""
    made: list[Dask] = []
    yield made
    for engine in made:
        engine.stop()


def test_the_command_gives_the_bits_of_a_launch_here_and_refuses_workers_of_other_code(
    tmp_path: Path,
) -> None:
    whole = launched(SMALL, tmp_path / "here")
    (tmp_path / "small.yaml").write_text(SMALL, encoding="utf-8")
    words = ["launch", "small.yaml", "--executor", "dask", "--address"]
    with cluster(tmp_path, 1, **TESTS) as made:
        done = sweep(tmp_path, *words, made.address, "--results", "there")
        assert (done.returncode, "6 new trials (6 done)" in done.stderr) == (
            0,
            True,
        ), done.stderr
        again = "verify", "small", *words[2:], made.address, "--fraction", "1"
        verified = sweep(tmp_path, *again, "--results", "there")
        assert "6 of 6 bitwise identical" in verified.stdout, verified.stderr
        made.start_worker(PYTHONPATH=str(edited_copy(tmp_path)))
        until(lambda: "Registered to" in log(made, 2), "another worker joins")
        refused = sweep(tmp_path, *words, made.address, "--results", "elsewhere")
    stored = StoredStudy("small", tmp_path / "there")
    pd.testing.assert_frame_equal(
        stored.trials.drop(columns="seconds"), whole.trials.drop(columns="seconds")
    )
    pd.testing.assert_frame_equal(stored.series, whole.series)
    assert refused.returncode == 2
    assert (
        "workers have another environment than this process: tcp://127.0.0.1:"
        in refused.stderr
    )
    assert refused.stderr.rstrip().endswith(": other code in sweep/trial/simulation.py")
    assert not (tmp_path / "elsewhere").exists()


@pytest.mark.slow
def test_chains_have_the_bits_of_a_launch_here_wherever_their_links_run(
    tmp_path: Path, engines: list[Dask]
) -> None:
    """Two workers share six chains; an interrupted launch goes on at the links."""
    whole = launched(CHAINED, tmp_path / "here")
    with cluster(tmp_path, 2, **TESTS) as made:
        engines.append(Dask(made.address))
        results, report = tmp_path / "there", interrupt_after(4)
        with pytest.raises(KeyboardInterrupt):
            launch(read(CHAINED), results, engines[0], report=report)
        engines.append(Dask(made.address))
        there = launched(CHAINED, results, engines[1])
    assert same(there, whole)


def edited_copy(folder: Path) -> Path:
    """A copy of the code with one line more in `sweep/trial/simulation.py`."""
    copy = folder / "copy"
    for package in ("kernels", "sweep"):
        shutil.copytree(
            ROOT / package, copy / package, ignore=shutil.ignore_patterns("__pycache__")
        )
    with (copy / "sweep" / "trial" / "simulation.py").open("a") as code:
        code.write("\n# edited\n")
    return copy


def log(made: Cluster, number: int) -> str:
    """What the command of a process of the cluster has said so far; the scheduler is
    the first.
    """
    return made.logs[number].read_text(encoding="utf-8")


@pytest.mark.slow
def test_late_joiners_get_work_and_no_kill_or_restart_loses_any(
    tmp_path: Path, engines: list[Dask], caplog: pytest.LogCaptureFixture
) -> None:
    with cluster(tmp_path, 1, **TESTS) as made:
        engines.append(Dask(made.address))
        disturbing = threading.Thread(target=disturb, args=(made, tmp_path))
        disturbing.start()
        work = [jobs.Staged(number, number // 8, str(tmp_path)) for number in range(24)]
        results = runner_jobs.run_all(
            work,
            jobs.staged,
            engines[0],
            costs=lambda jobs: [24.0 - job.number for job in jobs],
            deal=partial(Chunks, seconds=1e-6),
        )
        disturbing.join()
    assert sorted(results) == list(range(24))
    assert "waiting for it to come back" in caplog.text or "no worker at" in caplog.text


def task_names(dask_scheduler: Any) -> list[str]:
    """What a scheduler has to do, asked there."""
    return list(dask_scheduler.tasks)


def earlier_first(work: Sequence[jobs.Staged]) -> list[float]:
    """Costs by which jobs run in the order of their numbers."""
    return [24.0 - job.number for job in work]


def disturb(made: Cluster, folder: Path) -> None:
    """In the second stage a worker joins and the first is killed, in the third the
    scheduler is, and comes back.
    """
    until(
        lambda: bool(jobs.processes(folder, 1)),
        "the first worker is at the second stage",
    )
    [first] = jobs.processes(folder, 1)
    made.start_worker()
    until(lambda: len(jobs.processes(folder, 1)) > 1, "the late joiner has work")
    os.kill(first, signal.SIGKILL)
    (folder / "allowed-1").touch()
    until(lambda: bool(jobs.processes(folder, 2)), "the third stage has begun")
    made.scheduler.kill()
    made.scheduler.wait()
    made.start_scheduler()
    made.start_worker()
    (folder / "allowed-2").touch()


@pytest.mark.slow
def test_a_job_that_kills_its_workers_or_hangs_convicts_only_itself(
    tmp_path: Path, engines: list[Dask]
) -> None:
    """With one worker the next job queues behind it, again and again, and dask gives
    both up at the first death.
    """
    with cluster(
        tmp_path, 0, DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0", **TESTS
    ) as made:
        made.start_worker("--nanny")
        engines.append(Dask(made.address))
        results = dict(runner_jobs.run_all([7, 8, 9], jobs.square_or_die, engines[0]))
        died = results.pop(7)
        assert died == Failure(
            "worker process died 3 times while running this trial alone: dask gave"
            " it up"
        )
        assert results == {8: 64, 9: 81}
        limits = Limits(deadline=2.0)
        hung = runner_jobs.run_all(
            [0, 7, 8], faulty.square_or_hang, engines[0], overdue=late, limits=limits
        )
        assert sorted(hung) == [
            (0, 0),
            (7, "late: did not return within 2 s, and was ended"),
            (8, 64),
        ]
    until(lambda: not wardens(made.address), "wardens end with their workers")


def wardens(address: str) -> list[str]:
    """The processes that watch workers of a cluster."""
    commands = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            commands.append(path.read_text(encoding="utf-8"))
    return [
        command
        for command in commands
        if "sweep.workers.warden" in command and address in command
    ]


@pytest.mark.slow
def test_a_job_of_too_much_memory_is_ended_on_the_cluster_too(
    tmp_path: Path, engines: list[Dask]
) -> None:
    with cluster(tmp_path, 0, **TESTS) as made:
        made.start_worker("--nanny", "--memory-limit", "0")
        engines.append(Dask(made.address))
        limits = Limits(memory=900 * faulty.MEGABYTE)
        results = dict(
            runner_jobs.run_all(
                range(10), faulty.square_or_grow, engines[0], limits=limits
            )
        )
    assert results.pop(5).error.startswith("memory limit of 900 MiB: its worker held ")
    assert results == {job: job * job for job in range(10) if job != 5}


@pytest.mark.slow
def test_ctrl_c_keeps_what_is_back_and_cancels_the_rest_on_the_cluster(
    tmp_path: Path, engines: list[Dask]
) -> None:
    from distributed import Client

    with cluster(tmp_path, 1, **TESTS) as made:
        engines.append(Dask(made.address))
        work = [jobs.Staged(number, number // 8, str(tmp_path)) for number in range(16)]
        kept: list[int] = []
        batches = drive(
            work,
            jobs.staged,
            executor=engines[0],
            costs=earlier_first,
            failed=runner_jobs.failed,
            deal=partial(Chunks, seconds=1e-6),
        )
        while len(kept) < 5:
            kept += next(batches)
        signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            kept.extend(chain.from_iterable(batches))
        with Client(made.address, set_as_default=False) as client:
            until(
                lambda: not client.run_on_scheduler(task_names),
                "nothing of ours is left on the cluster",
            )
    assert set(range(5)) <= set(kept) < set(range(16))


@pytest.mark.slow
@pytest.mark.parametrize("several", [True, False])
def test_a_late_joiner_of_several_threads_or_of_other_code_is_refused_by_name(
    tmp_path: Path, engines: list[Dask], several: bool
) -> None:
    path = {"PYTHONPATH": f"{edited_copy(tmp_path)}{os.pathsep}{ROOT}"}
    options, environment = (["--nthreads", "2"], {}) if several else ([], path)
    with cluster(tmp_path, 1, **TESTS) as made:
        engines.append(Dask(made.address))
        # The later half is never allowed: work is left when the other worker joins.
        work = [
            jobs.Staged(number, min(number, 1 + number // 200), str(tmp_path))
            for number in range(400)
        ]
        joining = threading.Thread(
            target=join_and_allow, args=(made, tmp_path, options, environment)
        )
        joining.start()
        words = (
            r"because trials hold Python's lock: tcp://\S+ has 2"
            if several
            else r"tcp://\S+ has another .* sweep/trial/simulation.py"
        )
        with pytest.raises(WorkersError, match=words):
            runner_jobs.run_all(
                work, jobs.staged, engines[-1], deal=partial(Chunks, seconds=1e-6)
            )
        joining.join()


@pytest.mark.slow
def test_compiling_on_another_machine_takes_no_time_of_a_trial(
    tmp_path: Path, engines: list[Dask]
) -> None:
    """It takes some ten seconds; a trial takes a millisecond."""
    with cluster(tmp_path, 1, NUMBA_CACHE_DIR=str(tmp_path / "cold"), **TESTS) as made:
        engines.append(Dask(made.address))
        study = launched(SMALL + "time_limit: 2\n", tmp_path / "results", engines[0])
    assert study.statuses() == {"done": 6}


def join_and_allow(
    made: Cluster, folder: Path, options: Sequence[str], environment: dict[str, str]
) -> None:
    """Once jobs run another worker joins; they go on when it has."""
    until(lambda: bool(jobs.processes(folder, 1)), "jobs run")
    made.start_worker(*options, **environment)
    number = len(made.logs) - 1
    until(lambda: "Registered to" in log(made, number), "another worker joins")
    (folder / "allowed-1").touch()


def late(job: Any, error: str) -> tuple[Any, str]:
    return job, f"late: {error}"
