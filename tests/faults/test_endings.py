"""However a launch ends, its workers end with it, and what can be stored is."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest

from sweep.store.store import Store
from sweep.workers.executors import Loky
from tests import ROOT
from tests.commands import python
from tests.faults.campaign import SPEC, assert_no_orphans, workers
from tests.patience import PATIENCE
from tests.runner_jobs import started

DRIVEN = """
import os, sys
from functools import partial
sys.path[:0] = [{root!r}]
from tests import runner_jobs
from tests.faults import jobs
from sweep.workers.chunks import Chunks
from sweep.workers.executors import Loky
from sweep.trial.interrupts import ended_like_ctrl_c
from sweep.workers.runner import drive

kept = []
executor = Loky(2)
with ended_like_ctrl_c():
    try:
        for batch in drive([0.05] * 40 + [60.0] * 4, jobs.{job}, executor=executor,
                           costs=runner_jobs.shortest_first,
                           failed=runner_jobs.failed,
                           deal=partial(Chunks, seconds=0.1)):
            kept += batch
            os.write(1, b"batch\\n")  # at once, as workers write there too
    except KeyboardInterrupt:
        print("kept", len(kept), flush=True)
        sys.exit(130)
"""


def driven(job: str) -> list[str]:
    """A process that drives jobs, of which the last are long."""
    return [
        sys.executable,
        "-c",
        DRIVEN.format(root=str(ROOT), job=job),
    ]


def await_long_jobs(process: "subprocess.Popen[str]") -> None:
    """Wait until both workers are at a long job, and three
    batches are there at least.
    """
    assert process.stdout is not None
    said = Counter[str]()
    while said["long\n"] < 2 or said["batch\n"] < 3:
        line = process.stdout.readline()
        assert line, "it has ended"
        said[line] += 1
    assert len(workers(process.pid)) == 2


@pytest.mark.slow
def test_workers_that_hang_end_with_a_coordinator_that_is_killed() -> None:
    with started(driven("nap_or_hang"), ROOT) as process:
        await_long_jobs(process)
        time.sleep(0.2)  # they say so just before
        process.kill()
        process.wait()
        assert_no_orphans(process.pid)


def semaphores(process: int) -> set[Path]:
    """The files of the semaphores that a process has made for its pools."""
    return {*Path("/dev/shm").glob(f"sem.*~{process}~boidsweep-*")}


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="semaphores are files on Linux")
def test_semaphores_of_a_group_that_was_killed_go_with_the_next_launch() -> None:
    """Whoever removes them when a coordinator ends was killed as well."""
    with started(driven("nap"), ROOT) as process:
        await_long_jobs(process)
        left = semaphores(process.pid)
        assert len(left) >= 2
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    engine = Loky(1)
    engine.start()
    try:
        assert not any(file.exists() for file in left)
        ours = semaphores(os.getpid())
        assert ours
        python("from sweep.workers.executors import Loky as L; e = L(1); e.start()")
        assert all(file.exists() for file in ours), "their process is alive"
    finally:
        engine.stop()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "whole_group"), [(signal.SIGTERM, False), (signal.SIGHUP, True)]
)
def test_being_told_to_end_is_like_ctrl_c(
    number: signal.Signals, whole_group: bool
) -> None:
    """Also where everybody is told, as by a closing terminal: the coordinator alone
    decides.
    """
    with started(driven("nap"), ROOT) as process:
        await_long_jobs(process)
        (os.killpg if whole_group else os.kill)(process.pid, number)
        output, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130, errors
        assert int(output.split()[-1]) >= 3
        assert errors == ""
        assert_no_orphans(process.pid)


@pytest.mark.slow
@pytest.mark.parametrize("pause", [0.0, 0.1])
def test_two_ctrl_c_in_a_row_leave_no_orphan(pause: float) -> None:
    with started(driven("nap"), ROOT) as process:
        await_long_jobs(process)
        for _ in range(2):
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(pause)
        process.communicate(timeout=PATIENCE)
        assert_no_orphans(process.pid)


HOLDING = """
from sweep.cli import main
from sweep.store.writer import Writer

def tell(self, results, add=Writer.add):
    add(self, results)
    print("held", flush=True)

Writer.__init__.__kwdefaults__["seconds"] = 1e9
Writer.add = tell
main()
"""
"""The command, which says when results have come back, and stores none before its end.
"""


def test_sigterm_ends_the_command_with_all_that_is_done_stored(tmp_path: Path) -> None:
    """Exit code 130 as after Ctrl-C; the lock is given back."""
    (tmp_path / "spec.yaml").write_text(
        SPEC.replace("replicates: 30", "replicates: 3000")
    )
    folder = tmp_path / "results" / "faulty"
    launch = [sys.executable, "-c", HOLDING, "launch", "spec.yaml", "--workers", "1"]
    with started(launch, tmp_path) as process:
        assert process.stdout is not None
        for _ in range(2):
            assert process.stdout.readline() == "held\n"
        assert (folder / "lock").exists()
        process.terminate()
        output, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 130
        assert errors.splitlines()[-1].startswith(
            "interrupted; finished trials are stored"
        )
        assert_no_orphans(process.pid)
    assert len(Store(folder).trial_ids()) >= 2 + output.count("held")
    assert list((folder / "writing").iterdir()) == []
    assert not (folder / "lock").exists()
