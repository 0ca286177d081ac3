"""Launches on a cluster while its network, its workers, its scheduler and the launches
are disturbed.
"""

import os
import random
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from functools import partial
from pathlib import Path

import pytest

from sweep.workers import cluster as engine
from sweep.workers.cluster import Dask
from tests.cluster.started import TESTS, Cluster, cluster, until
from tests.faults import campaign
from tests.faults.campaign import tables
from tests.lines import HERE, Line
from tests.studies import launched

REDUCED = campaign.SPEC.replace("replicates: 30", "replicates: 6")
LAUNCH_SECONDS = 500.0
STALL_SECONDS = 15.0


@contextmanager
def meanwhile(*acts: Callable[[], None]) -> Iterator[None]:
    """Do these again and again, each in a thread of its own."""
    over = threading.Event()

    def repeat(act: Callable[[], None]) -> None:
        while not over.wait(0.2):
            act()

    threads = [threading.Thread(target=repeat, args=(act,)) for act in acts]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        over.set()
        for thread in threads:
            thread.join()


class Keeper:
    """Starts workers again that have ended, as the system of a cluster does."""

    def __init__(self, made: Cluster, number: int) -> None:
        self.made = made
        self.workers = [made.start_worker() for _ in range(number)]

    def keep(self) -> None:
        for place, worker in enumerate(self.workers):
            if worker.poll() is not None and self.made.scheduler.poll() is None:
                self.workers[place] = self.made.start_worker()


def disturbed(
    line: Line, seed: int, *, most: int, resets: int, seconds: float, stalls: int = 0
) -> None:
    """Close the first connection; delay each packet, stall some, and reset after
    packets that are drawn.
    """
    drawn = random.Random(seed)
    cuts = [drawn.randint(1, most)]
    stalled = {drawn.randint(1, resets * most) for _ in range(stalls)}

    def passes(number: int) -> None:
        time.sleep(STALL_SECONDS if number in stalled else seconds)
        if number >= cuts[-1] and len(cuts) <= resets:
            cuts.append(number + drawn.randint(1, most))
            line.reset()

    line.greets = lambda number: number > 1
    line.passes = passes


@pytest.mark.slow
def test_a_launch_over_a_line_that_is_cut_has_the_tables_of_an_undisturbed_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine, "CONNECT_SECONDS", 300.0)
    launched(REDUCED, tmp_path / "whole")
    with cluster(tmp_path, 1, **TESTS) as made, closing(Line(made.line.target)) as line:
        disturbed(line.mend(), seed=4, most=60, resets=5, seconds=0.001)
        launch = Dask(f"tcp://{HERE}:{line.port}")
        try:
            launched(REDUCED, tmp_path / "cut", launch)
        finally:
            launch.stop()
        assert line.greeted > 3
    assert tables(tmp_path / "cut" / "faulty") == tables(tmp_path / "whole" / "faulty")


LAUNCH = [
    *campaign.LAUNCH[:3],
    "launch",
    "spec.yaml",
    "--executor",
    "dask",
    "--address",
]


@pytest.mark.slow
@pytest.mark.parametrize(
    "what", ["workers", "a frozen worker", "scheduler", "line", "launches", "all"]
)
def test_whatever_is_disturbed_the_tables_are_those_of_an_undisturbed_launch(
    tmp_path: Path, what: str
) -> None:
    spec, drawn = (
        campaign.SPEC.replace("replicates: 30", "replicates: 300"),
        random.Random(what),
    )
    launched(
        campaign.SPEC.replace("replicates: 30", "replicates: 300"), tmp_path / "whole"
    )
    (tmp_path / "spec.yaml").write_text(spec)
    done = {"kills": 0, "froze": 0, "restarts": 0, "launches": 0}
    with cluster(tmp_path, 0, **TESTS) as made, closing(Line(made.line.target)) as line:
        keeper = Keeper(made, 2)
        line.mend()
        if what in ("line", "all"):
            disturbed(line, seed=7, most=400, resets=7, seconds=0.02, stalls=2)

        def kill() -> None:
            time.sleep(drawn.uniform(2, 4))
            drawn.choice(keeper.workers).kill()
            done["kills"] += 1

        def freeze() -> None:
            time.sleep(drawn.uniform(2, 4))
            frozen = keeper.workers[0]
            with suppress(ProcessLookupError):
                os.kill(frozen.pid, signal.SIGSTOP)
                time.sleep(20)
                os.kill(frozen.pid, signal.SIGCONT)
            done["froze"] += 1

        def restart() -> None:
            if done["restarts"] < 1 and stored(tmp_path):
                made.scheduler.kill()
                made.scheduler.wait()
                time.sleep(2)
                made.start_scheduler()
                line.target = made.line.target
                done["restarts"] += 1

        acts = {
            "workers": [kill],
            "a frozen worker": [freeze],
            "scheduler": [restart],
            "line": [],
            "launches": [],
        }
        chosen = acts.get(what, [kill, freeze, restart])
        with meanwhile(keeper.keep, *chosen):
            for _ in range(4 if what in ("launches", "all") else 0):
                launch = started(tmp_path, line)
                before = stored(tmp_path)
                stirred = partial(has_stored_or_ended, launch, tmp_path, before)
                until(stirred, "a part is stored")
                launch.kill()
                launch.wait()
                done["launches"] += 1
            code = started(tmp_path, line).wait(LAUNCH_SECONDS)
    assert code == 0, (tmp_path / "errors.txt").read_text()
    assert tables(tmp_path / "results" / "faulty") == tables(
        tmp_path / "whole" / "faulty"
    )
    print(what, done)


def started(folder: Path, line: Line) -> "subprocess.Popen[bytes]":
    with (folder / "errors.txt").open("w") as errors:
        return subprocess.Popen(
            [*LAUNCH, f"tcp://{HERE}:{line.port}"],
            cwd=folder,
            stderr=errors,
            start_new_session=True,
        )


def stored(folder: Path) -> int:
    return len(list((folder / "results" / "faulty" / "parts").glob("*")))


def has_stored_or_ended(
    launch: "subprocess.Popen[bytes]", folder: Path, before: int
) -> bool:
    """Whether a launch has stored another part than `before`, or is over."""
    return launch.poll() is not None or stored(folder) > before
