"""Without what one operating system lacks, studies run, are stored and read all the
same. That nobody asks for it unguarded is a rule of tests/house/systems.py.
"""

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pandas as pd
import psutil
import pytest

from sweep.errors import OutputError
from sweep.store import durable, processes
from sweep.store.bounds import _memory
from sweep.store.new_files import create, replacing
from sweep.store.regular import open_regular
from sweep.store.user_key import own_key
from sweep.tables.outputs import unfinished
from sweep.trial.interrupts import SIGNALS, deaf
from sweep.web.server import _bound
from sweep.workers.executors import core_count
from sweep.workers.watch import LimitKeeper, Limits
from tests import ROOT
from tests.commands import python
from tests.elsewhere import on_macos, on_windows
from tests.studies import SMALL, launched, relaunch


@pytest.mark.slow
def test_every_module_of_ours_is_imported_where_windows_lacks_what_it_lacks() -> None:
    """A fresh process, in which nothing was imported before. Nor is a package of others
    asked meanwhile: it would import modules of ours that are not there yet.
    """
    code = """
import os, signal, sys, pkgutil, importlib
import numba, pandas, pyarrow, scipy, psutil, typer, rich, optuna, ruamel.yaml
import matplotlib.pyplot, PIL.Image, uvicorn, starlette.applications, joblib
import multiprocessing.util, concurrent.futures.process, shutil, tempfile
from tests.elsewhere import LACKS
for module, names in LACKS.items():
    for name in names:
        if hasattr(module, name):
            delattr(module, name)
for name in ("fcntl", "pwd", "grp", "resource", "termios"):
    sys.modules[name] = None
import sweep, kernels
from kernels.registry import Registry
del Registry._installed
for package in (sweep, kernels):
    for found in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
        importlib.import_module(found.name)
print("all")
"""
    assert "all" in python(code)


def test_a_study_runs_and_is_read_with_what_windows_has(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its trials are those of here; the second launch finds them stored."""
    here = launched(SMALL, tmp_path / "here").trials
    with monkeypatch.context() as patch:
        on_windows(patch)
        there = launched(SMALL, tmp_path / "there").trials
        assert relaunch(SMALL, tmp_path / "there").statuses == {}
    pd.testing.assert_frame_equal(
        here.drop(columns="seconds"), there.drop(columns="seconds")
    )
    assert not list((tmp_path / "there" / "small" / "writing").iterdir())


def test_a_file_appears_whole_where_folders_cannot_be_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    on_windows(monkeypatch)
    path = tmp_path / "new" / "folder" / "x.txt"
    for text in (b"old", b"new"):
        with replacing(path, tmp_path) as file:
            file.write(text)
        assert path.read_bytes() == text
    with pytest.raises(KeyboardInterrupt), replacing(path, tmp_path):
        raise KeyboardInterrupt
    assert [one.name for one in path.parent.iterdir()] == ["x.txt"]
    assert path.read_bytes() == b"new"


def test_links_are_neither_written_through_nor_read_where_no_flag_forbids_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "secret").write_text("precious", encoding="utf-8")
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "study").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "results" / "plan").symlink_to(tmp_path / "elsewhere" / "secret")
    on_windows(monkeypatch)
    with (
        pytest.raises(OutputError, match="results/study is a symbolic link"),
        unfinished(tmp_path / "results" / "study" / "x", tmp_path / "results"),
    ):
        pass
    with pytest.raises(OSError, match="is a symbolic link, which is not followed"):
        open_regular(tmp_path / "results" / "plan")
    with pytest.raises(FileExistsError):
        create(tmp_path / "results" / "plan")
    assert [path.name for path in (tmp_path / "elsewhere").iterdir()] == ["secret"]


def test_a_key_is_kept_where_files_have_no_modes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    on_windows(monkeypatch)
    own_key.cache_clear()
    try:
        key = own_key()
        own_key.cache_clear()
        assert own_key() == key == next(tmp_path.rglob("*.key")).read_bytes()
    finally:
        own_key.cache_clear()


def test_a_drive_is_asked_to_flush_where_fsync_does_not_do_that(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = on_macos(monkeypatch)
    durable.flush_to_disk(tmp_path)
    assert asked == [51]


def test_where_the_drive_cannot_be_asked_fsync_is_all_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked, flushed = on_macos(monkeypatch, full_flush=None), list[int]()
    monkeypatch.setattr(os, "fsync", flushed.append)
    durable.flush_to_disk(tmp_path)
    assert (len(asked), len(flushed)) == (1, 1)


def test_processes_are_told_apart_by_their_start_on_every_system(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A process that has ended, but whose parent has not noticed, counts as none."""
    on_macos(monkeypatch)
    assert processes.machine() == processes.host()
    command = [sys.executable, "-c", "import sys; sys.stdin.read()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as process:
        assert process.stdin
        began = processes.started(process.pid)
        assert began == str(round(psutil.Process(process.pid).create_time()))
        process.stdin.close()
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert processes.started(process.pid) is None
    assert processes.started(process.pid) is None


ENDING = """
import os, sys, time
from types import SimpleNamespace
from sweep.store import processes

processes.sys = SimpleNamespace(platform="win32")
parent = os.getpid()
began = processes.started(parent)
if os.fork() == 0:
    processes.end_with(parent, began)
    print("watching", flush=True)
    time.sleep(600)
time.sleep(600)
"""


def test_a_worker_ends_with_its_parent_where_the_system_does_not_see_to_it() -> None:
    """Its output is closed when the last process that has it is gone."""
    command = [sys.executable, "-c", ENDING]
    with subprocess.Popen(command, stdout=subprocess.PIPE, cwd=ROOT) as parent:
        assert parent.stdout
        assert parent.stdout.readline() == b"watching\n"
        parent.kill()
        assert parent.stdout.read() == b""


def test_a_process_is_ended_at_once_where_there_is_no_sigkill(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = list[tuple[int, int]]()
    monkeypatch.delattr(signal, "SIGKILL")
    monkeypatch.setattr(os, "kill", lambda *given: asked.append(given))
    processes.end(7)
    assert asked == [(7, signal.SIGTERM)]


def test_a_user_without_a_name_has_a_number_or_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("LOGNAME", "USER", "LNAME", "USERNAME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("getpass.getuser", _nameless)
    assert processes.user() == str(os.getuid())
    on_windows(monkeypatch)
    assert processes.user() == "somebody"


def _nameless() -> str:
    raise ImportError("No module named 'pwd'")


def test_signals_are_held_back_where_the_system_can(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    with deaf() as so:
        inside = signal.pthread_sigmask(signal.SIG_BLOCK, [])
    assert so
    assert inside == before | set(SIGNALS)
    assert signal.pthread_sigmask(signal.SIG_BLOCK, []) == before
    on_windows(monkeypatch)
    with deaf() as so:
        assert not so


def test_limits_leave_no_file_and_are_kept_where_a_mapped_one_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with LimitKeeper(Limits(deadline=60.0), 1) as keeper:
        seat = keeper.take()
        assert seat
        assert [next(iter(seat.noting([job]))) for job in ("one",)] == ["one"]
        keeper.leave(seat)
    assert not list(tmp_path.iterdir())
    with LimitKeeper(Limits(deadline=60.0), 1):
        monkeypatch.setattr(Path, "unlink", _refused)
    assert len(list(tmp_path.iterdir())) == 1


def _refused(path: Path, **_: object) -> None:
    raise PermissionError(13, "The process cannot access the file", str(path))


def test_a_port_is_not_shared_where_the_system_would(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By the number of an option that this system has."""
    alone = socket.SO_KEEPALIVE
    monkeypatch.setattr(socket, "SO_EXCLUSIVEADDRUSE", alone, raising=False)
    with _bound(0) as bound:
        assert bound.getsockopt(socket.SOL_SOCKET, alone)
        assert not bound.getsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR)


def test_cores_and_memory_are_counted_on_every_system(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    page, pages = os.sysconf("SC_PAGE_SIZE"), os.sysconf("SC_PHYS_PAGES")
    on_windows(monkeypatch)
    assert core_count() == os.cpu_count()
    assert _memory() == page * pages
