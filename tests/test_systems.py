"""What one operating system lacks: nobody asks for it unguarded, and without it studies
run, are stored and read all the same.
"""

import ast
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
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
from tests.elsewhere import LACKS, on_macos, on_windows
from tests.studies import SMALL, launched, relaunch

NAMES = {name for names in LACKS.values() for name in names} - {"wait", "pause"} | {
    *("fsync", "fdatasync", "getppid", "kill", "umask", "link", "symlink", "readlink"),
    *("dir_fd", "src_dir_fd", "dst_dir_fd", "pass_fds", "preexec_fn", "tzset"),
    *("start_new_session", "resource_tracker", "SO_REUSEADDR", "AF_UNIX"),
}
"""What some system lacks, or does in a way of its own: of the standard library."""
LIBRARY = {"os", "signal", "socket", "multiprocessing"}
MEMBERS = {
    *("rename", "chmod", "symlink_to", "hardlink_to", "readlink", "mkfifo"),
    *("st_uid", "st_gid", "st_ino", "prctl", "CDLL", "F_FULLFSYNC"),
    *("NamedTemporaryFile", "add_signal_handler", "send_signal"),
}
"""The same, of whatever object."""
MODULES = {"fcntl", "pwd", "grp", "resource", "select", "termios", "pty", "syslog"}
PLACES = ("/proc", "/dev", "/tmp", "/etc", "/sys")
"""Names of files that only some systems have."""

GUARDED = {
    "sweep/store/durable.py O_DIRECTORY": "asked for before it is used",
    "sweep/store/durable.py F_FULLFSYNC": "of macOS alone",
    "sweep/store/durable.py fcntl": "of macOS alone",
    "sweep/store/durable.py fsync": "this is the one place",
    "sweep/store/new_files.py O_DIRECTORY": "asked for before it is used",
    "sweep/store/new_files.py O_NOFOLLOW": "where O_DIRECTORY is",
    "sweep/store/new_files.py dir_fd": "where O_DIRECTORY is; None elsewhere",
    "sweep/store/new_files.py src_dir_fd": "where O_DIRECTORY is",
    "sweep/store/new_files.py dst_dir_fd": "where O_DIRECTORY is",
    "sweep/store/new_files.py rename": "our own, which replaces what is there",
    "sweep/store/regular.py O_NOFOLLOW": "asked for; a link is looked for without",
    "sweep/store/regular.py O_NONBLOCK": "asked for; Windows has no pipes in folders",
    "sweep/store/user_key.py geteuid": "asked for before it is used",
    "sweep/store/user_key.py st_uid": "where geteuid is",
    "sweep/store/user_key.py hardlink_to": "NTFS has it; without it no key is kept",
    "sweep/store/lock_files.py rename": "to a name that is not there",
    "sweep/store/folders.py rename": "to a name that is not there",
    "sweep/store/processes.py getuid": "asked for before it is used",
    "sweep/store/processes.py SIGKILL": "asked for; on Linux after prctl",
    "sweep/store/processes.py kill": "this is the one place",
    "sweep/store/processes.py getppid": "on Linux alone",
    "sweep/store/processes.py prctl": "on Linux alone",
    "sweep/store/processes.py CDLL": "on Linux alone",
    "sweep/store/processes.py readlink": "of /proc, on Linux alone",
    "sweep/store/processes.py /proc": "on Linux alone",
    "sweep/store/memory.py CDLL": "on Linux alone",
    "sweep/store/repository.py /dev": "git knows it on every system",
    "sweep/analysis/intervals.py rename": "of pandas",
    "sweep/analysis/pooling.py rename": "of pandas",
    "sweep/store/whole_studies.py rename": "to a name that is not there",
    "sweep/tables/power.py rename": "of pandas",
    "sweep/tables/safe_csv.py rename": "of pandas",
    "sweep/tables/outputs.py /proc": "on Linux alone",
    "sweep/trial/interrupts.py SIGHUP": "asked for",
    "sweep/trial/interrupts.py pthread_sigmask": "asked for before it is used",
    "sweep/trial/interrupts.py SIG_BLOCK": "where pthread_sigmask is",
    "sweep/trial/interrupts.py SIG_SETMASK": "where pthread_sigmask is",
    "sweep/trial/compiled.py geteuid": "asked for before it is used",
    "sweep/trial/compiled.py st_uid": "where geteuid is",
    "sweep/trial/compiled.py st_gid": "where geteuid is",
    "sweep/trial/compiled.py chmod": "where geteuid is",
    "sweep/trial/compiled.py readlink": "where geteuid is",
    "sweep/trial/compiled.py grp": "where geteuid is",
    "sweep/trial/compiled.py pwd": "where geteuid is",
    "sweep/workers/executors.py resource_tracker": "where pthread_sigmask is",
    "sweep/workers/executors.py /dev": "elsewhere that folder is missing",
    "sweep/workers/executors.py sched_getaffinity": "asked for before it is used",
    "sweep/workers/remote.py start_new_session": "Windows takes and ignores it",
    "sweep/web/launching.py start_new_session": "Windows takes and ignores it",
    "sweep/cli/page_beside.py start_new_session": "Windows takes and ignores it",
    "sweep/web/server.py SO_REUSEADDR": "where SO_EXCLUSIVEADDRUSE is not",
}
"""Every use of such a name, and why it is no error elsewhere."""


def used(path: Path) -> Iterator[str]:
    """What a module uses that some system lacks: names, modules and places."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Attribute):
            library = ast.unparse(node.value) in LIBRARY
            yield from {node.attr} & (MEMBERS | NAMES if library else MEMBERS)
        elif isinstance(node, ast.keyword):
            yield from {node.arg} & NAMES
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names = {alias.name for alias in node.names}
            origin = {node.module or ""} if isinstance(node, ast.ImportFrom) else names
            yield from origin & MODULES
            yield from names & (NAMES if origin <= LIBRARY else MEMBERS)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield from {node.value} & NAMES  # as in getattr(os, NAME)
            yield from (
                place
                for place in PLACES
                if node.value.startswith(place) or f"={place}" in node.value
            )


def as_text(path: Path) -> Iterator[int]:
    """The lines of a module that read or write text in the encoding of the system."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call):
            continue
        name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
        words = {word.arg for word in node.keywords}
        given = {"read_text": 1, "write_text": 2}.get(name, 99) <= len(node.args)
        whole = name in ("read_text", "write_text") and not given
        piped = ast.unparse(node.func).startswith("subprocess.") and "text" in words
        if (whole or piped) and "encoding" not in words:
            yield node.lineno


def sources() -> Iterator[Path]:
    for part in ("kernels", "sweep"):
        yield from ROOT.glob(f"{part}/**/*.py")


def test_what_a_system_lacks_is_asked_for_nowhere_else() -> None:
    found = {
        f"{path.relative_to(ROOT).as_posix()} {name}"
        for path in sources()
        for name in used(path)
    }
    assert found == GUARDED.keys()


@pytest.mark.parametrize(
    "line",
    [
        "os.getuid()",
        "signal.signal(signal.SIGHUP, f)",
        "getattr(os, 'O_NOFOLLOW')",
        "import fcntl",
        "from resource import getrusage",
        "from signal import pthread_sigmask",
        "os.mkdir(name, dir_fd=3)",
        "Path('/proc/self').exists()",
        "path.rename(other)",
        "subprocess.Popen([], preexec_fn=f)",
    ],
)
def test_another_use_would_be_found(line: str, tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(line, encoding="utf-8")
    assert list(used(tmp_path / "module.py"))


def test_text_has_the_same_encoding_on_every_system() -> None:
    found = [
        f"{path.relative_to(ROOT).as_posix()}:{line}"
        for path in sources()
        for line in as_text(path)
    ]
    assert found == []


@pytest.mark.parametrize(
    "line",
    [
        "path.read_text()",
        "path.write_text('x')",
        "subprocess.run([], text=True)",
    ],
)
def test_text_of_another_encoding_would_be_found(line: str, tmp_path: Path) -> None:
    (tmp_path / "module.py").write_text(line, encoding="utf-8")
    assert list(as_text(tmp_path / "module.py")) == [1]


def test_every_module_of_ours_is_imported_where_windows_lacks_what_it_lacks() -> None:
    """A fresh process, in which nothing was imported before."""
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
