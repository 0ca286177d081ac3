"""One launch of a study at a time, and a dead one's lock is taken over by exactly one
other.
"""

import json
import logging
import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from sweep.errors import StoreError
from sweep.store import lock as lock_module
from sweep.store.lock import Lock
from sweep.store.lock_files import LockFiles
from sweep.store.processes import machine, started
from sweep.store.store import Store
from tests import ROOT
from tests.patience import PATIENCE
from tests.studies import SMALL, relaunch

TAKERS = """
import sys, time
sys.path[:0] = [{root!r}]
from pathlib import Path
from sweep.errors import StoreError
from sweep.store.lock import Lock
from sweep.store.store import Store

folder = Path(sys.argv[1])
store = Store(folder)
print("ready", flush=True)
for _ in range(int(sys.stdin.readline())):
    try:
        with Lock(store.place):
            with (folder / "log").open("a") as log:
                log.write("in\\n")
                log.flush()
                time.sleep(0.002)
                log.write("out\\n")
    except StoreError as error:
        assert "is being launched by" in str(error), error
"""


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "study")


def lock(store: Store) -> Lock:
    return Lock(store.place)


def foreign(store: Store, age: float, **about: object) -> Path:
    """A lock of another machine, last touched `age` seconds ago."""
    folder = store.folder / "lock"
    folder.mkdir(parents=True)
    owner = {
        "who": "ada on elsewhere (process 12) since 1843",
        "machine": "elsewhere",
        "process": 12,
        "started": "1",
    }
    file = folder / "token.json"
    file.write_text(json.dumps(owner | about))
    then = time.time() - age
    os.utime(file, (then, then))
    return file


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lock_module, "WATCH_SECONDS", 0.5)
    monkeypatch.setattr(lock_module, "BEAT_SECONDS", 0.05)


def test_a_second_launch_is_told_who_is_launching_since_when(tmp_path: Path) -> None:
    with lock(Store(tmp_path / "small")):
        held = (
            r"small/lock: this study is being launched by \S+ on \S+ \(process"
            rf" {os.getpid()}\) since 2"
        )
        with pytest.raises(StoreError, match=held):
            relaunch(SMALL, tmp_path)
        assert not (tmp_path / "small" / "plan.parquet").exists()
    assert relaunch(SMALL, tmp_path).statuses["done"] == 6


@pytest.mark.parametrize("error", [None, ValueError, KeyboardInterrupt, SystemExit])
def test_it_is_released_on_every_way_out(
    store: Store, error: type[BaseException] | None
) -> None:
    def held() -> None:
        with lock(store):
            assert list((store.folder / "lock").iterdir())
            if error:
                raise error

    for _ in range(2):
        if error:
            with pytest.raises(error):
                held()
        else:
            held()
        assert not (store.folder / "lock").exists()
    assert list((store.folder / "writing").iterdir()) == []


@pytest.mark.parametrize("start", ["other", "same"])
def test_on_one_machine_the_process_decides(
    store: Store, caplog: pytest.LogCaptureFixture, start: str
) -> None:
    """Whatever the time of the file: this very process holds a lock, another of the
    same id does not.
    """
    began = started(os.getpid()) if start == "same" else "0"
    foreign(
        store,
        0 if start == "other" else 1e6,
        machine=machine(),
        process=os.getpid(),
        started=began,
    )
    if start == "same":
        with (
            pytest.raises(
                StoreError, match=r"launched by ada.*; wait, or end that launch$"
            ),
            lock(store),
        ):
            pass
    else:
        with caplog.at_level(logging.WARNING), lock(store):
            assert (
                "taken over from ada on elsewhere (process 12) since 1843: that process"
                " is gone" in caplog.text
            )


@pytest.mark.parametrize("age", [0.0, 50.0, -50.0])
def test_another_machine_that_was_heard_of_lately_holds_it(
    store: Store, monkeypatch: pytest.MonkeyPatch, age: float
) -> None:
    """Without being watched for a while."""
    monkeypatch.setattr(lock_module, "_is_touched", lambda *_: pytest.fail("watched"))
    foreign(store, age)
    how_long = "or before a restart, counts as ended after 60 s of silence"
    with (
        pytest.raises(
            StoreError, match=f"ada on elsewhere.*; .*another machine, {how_long}$"
        ),
        lock(store),
    ):
        pass


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize(
    ("age", "words"),
    [(70.0, "without a sign of life for 7"), (-7200.0, "without a sign of life")],
)
def test_one_that_is_silent_while_watched_is_taken_over(
    store: Store, caplog: pytest.LogCaptureFixture, age: float, words: str
) -> None:
    """Also where its file comes from the future, because a clock was set back."""
    foreign(store, age)
    with caplog.at_level(logging.WARNING), lock(store):
        assert words in caplog.text


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("jump", [7200.0, -7200.0])
def test_a_clock_that_jumps_is_no_death(
    store: Store, monkeypatch: pytest.MonkeyPatch, jump: float
) -> None:
    """The other machine lives and touches its file, but by a clock two hours away."""
    file, touched, looks = foreign(store, jump), LockFiles.touched, iter(range(1000))

    def living(claims: LockFiles, token: str) -> int | None:
        if token == file.stem and next(looks) == 3:
            os.utime(file, (time.time() - jump + 5, time.time() - jump + 5))
        return touched(claims, token)

    monkeypatch.setattr(LockFiles, "touched", living)
    with pytest.raises(StoreError, match="ada on elsewhere"), lock(store):
        pass


@pytest.mark.usefixtures("quick")
def test_who_has_slept_through_a_takeover_learns_of_it(store: Store) -> None:
    with lock(store) as held:
        held.check()
        file = store.folder / "lock" / f"{held.token}.json"
        before = file.stat().st_mtime_ns
        deadline = time.monotonic() + PATIENCE
        while file.stat().st_mtime_ns == before:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        shutil.rmtree(store.folder / "lock")
        foreign(store, 0)
        while not held.lost:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        with pytest.raises(
            StoreError, match="another launch has taken this study over"
        ):
            held.check()
    assert (store.folder / "lock" / "token.json").exists()


@pytest.mark.usefixtures("quick")
def test_a_lock_whose_content_was_lost_is_taken_over_when_it_is_old(
    store: Store,
) -> None:
    foreign(store, 70).write_text("")
    os.utime(store.folder / "lock" / "token.json", (1, 1))
    with lock(store):
        pass


def gone() -> int:
    """The id of a process that has ended."""
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def one_at_a_time(store: Store) -> int:
    """How many have had the lock, each of which has noted its beginning and end."""
    log = (store.folder / "log").read_text().splitlines()
    assert log == ["in", "out"] * (len(log) // 2)
    assert not (store.folder / "lock").exists()
    return len(log) // 2


def test_of_many_threads_one_has_it_at_a_time(
    store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    """They race for a dead owner's lock first, and then for each other's."""
    foreign(store, 0, machine=machine(), process=gone())
    refused, ready = list[str](), threading.Barrier(4)

    def take() -> None:
        own = Store(store.folder)
        ready.wait(PATIENCE)
        for _ in range(15):
            try:
                with Lock(own.place), (store.folder / "log").open("a") as log:
                    log.write("in\n")
                    log.flush()
                    time.sleep(0.002)
                    log.write("out\n")
            except StoreError as error:
                refused.append(str(error))

    threads = [threading.Thread(target=take) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [one for one in refused if "is being launched by" not in one] == []
    had = one_at_a_time(store)
    assert had + len(refused) == 60
    assert had >= 8
    assert "taken over" in caplog.text


@pytest.mark.slow
def test_of_many_takers_one_has_it_at_a_time(store: Store) -> None:
    """Real processes, which race for a dead owner's lock first, and then for each
    other's.
    """
    foreign(store, 0, machine=machine(), process=gone())
    command = [
        sys.executable,
        "-c",
        TAKERS.format(root=str(ROOT)),
        str(store.folder),
    ]
    takers = [
        subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        for _ in range(4)
    ]
    assert [taker.stdout.readline() for taker in takers if taker.stdout] == [
        "ready\n"
    ] * 4
    ended = [
        taker.communicate("60\n", timeout=PATIENCE) for taker in takers if taker.stdin
    ]
    assert [taker.returncode for taker in takers] == [0] * 4, ended
    assert sum("taken over" in errors for _, errors in ended) >= 1
    assert one_at_a_time(store) >= 30
