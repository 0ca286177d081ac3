"""However a launch ends, its workers end with it, and what can be stored is."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from runner_jobs import started

from faults.campaign import SPEC, assert_no_orphans, workers
from sweep.store import Store

HERE = Path(__file__).parent.parent
DRIVEN = """
import sys
sys.path[:0] = [{tests!r}, {root!r}]
import runner_jobs
from faults import jobs
from sweep.executors import Loky
from sweep.interrupts import ended_like_ctrl_c
from sweep.runner import drive

kept = []
executor = Loky(2)
with ended_like_ctrl_c():
    try:
        for batch in drive([0.05] * 40 + [60.0] * 4, jobs.{job}, executor=executor,
                           cost=runner_jobs.shortest_first, failed=runner_jobs.failed, chunk_seconds=0.1):
            kept += batch
            print("batch", flush=True)
    except KeyboardInterrupt:
        print("kept", len(kept), flush=True)
        sys.exit(130)
"""


def driven(job: str) -> list[str]:
    """A process that drives jobs, of which the last hang."""
    return [sys.executable, "-c", DRIVEN.format(tests=str(HERE), root=str(HERE.parent), job=job)]


def await_hanging(process: "subprocess.Popen[str]") -> list[int]:
    """The workers, once all batches are there that will come."""
    assert process.stdout is not None
    for _ in range(3):
        assert process.stdout.readline() == "batch\n"
    time.sleep(1.5)
    found = workers(process.pid)
    assert len(found) == 2
    return found


def test_workers_that_hang_end_with_a_coordinator_that_is_killed() -> None:
    with started(driven("nap_or_hang"), HERE) as process:
        await_hanging(process)
        process.kill()
        process.wait()
        assert_no_orphans(process.pid, patience=5)


@pytest.mark.parametrize(("number", "whole_group"), [(signal.SIGTERM, False), (signal.SIGHUP, True)])
def test_being_told_to_end_is_like_ctrl_c(number: signal.Signals, whole_group: bool) -> None:
    """Also where everybody is told, as by a closing terminal: the coordinator alone decides."""
    with started(driven("nap_or_hang"), HERE) as process:
        await_hanging(process)
        (os.killpg if whole_group else os.kill)(process.pid, number)
        output, errors = process.communicate(timeout=20)
        assert process.returncode == 130, errors
        assert int(output.split()[-1]) >= 3
        assert errors == ""
        assert_no_orphans(process.pid, patience=5)


@pytest.mark.parametrize("pause", [0.0, pytest.param(0.1, marks=pytest.mark.slow)])
def test_two_ctrl_c_in_a_row_leave_no_orphan(pause: float) -> None:
    with started(driven("nap_or_hang"), HERE) as process:
        await_hanging(process)
        for _ in range(2):
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(pause)
        process.communicate(timeout=20)
        assert_no_orphans(process.pid, patience=5)


def test_sigterm_ends_the_command_with_all_that_is_done_stored(tmp_path: Path) -> None:
    """Exit code 130 as after Ctrl-C; the lock is given back."""
    (tmp_path / "spec.yaml").write_text(SPEC.replace("replicates: 30", "replicates: 3000"))
    folder = tmp_path / "results" / "faulty"
    launch = [sys.executable, "-c", "from sweep.cli import main; main()", "launch", "spec.yaml", "--workers", "2"]
    with started(launch, tmp_path) as process:
        deadline = time.monotonic() + 90
        while not Store(folder).all_parts():
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.05)
        assert (folder / "lock").exists()
        time.sleep(1.0)
        process.terminate()
        _, errors = process.communicate(timeout=30)
        assert process.returncode == 130
        assert errors.splitlines()[-1].startswith("interrupted; what is done is stored")
        assert_no_orphans(process.pid, patience=5)
    assert len(Store(folder).all_parts()) >= 2
    assert list((folder / "writing").iterdir()) == []
    assert not (folder / "lock").exists()
