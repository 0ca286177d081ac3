"""Another operating system than this one, as far as its lacks go: what it does not have
is taken away, and what it refuses is refused.
"""

import ctypes
import fcntl
import os
import shutil
import signal
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from sweep.store import durable, processes

LACKS = {
    os: (
        *("O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_SYNC"),
        *("getuid", "geteuid", "getgid", "getegid", "getpgid", "getpgrp", "getsid"),
        *("fork", "forkpty", "killpg", "setsid", "setpgid", "register_at_fork"),
        *("sched_getaffinity", "sched_setaffinity", "sysconf", "statvfs", "mkfifo"),
        *("chown", "lchown", "fchmod", "fchown", "nice", "getloadavg", "wait", "wait4"),
    ),
    signal: (
        *("SIGKILL", "SIGHUP", "SIGSTOP", "SIGCONT", "SIGUSR1", "SIGUSR2", "SIGALRM"),
        *("SIGCHLD", "SIGPIPE", "SIGQUIT", "SIG_BLOCK", "SIG_UNBLOCK", "SIG_SETMASK"),
        *("pthread_sigmask", "pthread_kill", "sigwait", "sigpending", "setitimer"),
        *("alarm", "pause", "siginterrupt"),
    ),
}
"""What Windows does not have, by Python's documentation."""


def on_windows(monkeypatch: pytest.MonkeyPatch) -> None:
    """From now on this process has what Windows has: no more of `os` and `signal`, no
    open folders, no rename or flush of what is open otherwise there.
    """
    for module, names in LACKS.items():
        for name in names:
            monkeypatch.delattr(module, name, raising=False)
    monkeypatch.setattr(processes, "sys", SimpleNamespace(platform="win32"))
    for name in ("open", "mkdir", "unlink", "replace", "rename", "fsync"):
        monkeypatch.setattr(os, name, getattr(_Windows(), name))
    monkeypatch.setattr(shutil, "_use_fd_functions", False)
    for name in ("fcntl", "pwd", "grp", "resource", "termios"):
        monkeypatch.setitem(sys.modules, name, None)


def on_macos(monkeypatch: pytest.MonkeyPatch, full_flush: int | None = 51) -> list[int]:
    """From now on this process has what macOS has. Returns the commands that `fcntl` is
    asked for: without `full_flush` the file system knows none.
    """
    asked = list[int]()

    def ask(_descriptor: int, command: int) -> int:
        asked.append(command)
        if full_flush is None:
            raise OSError(45, "Operation not supported")
        return 0

    for module in (durable, processes):
        monkeypatch.setattr(module, "sys", SimpleNamespace(platform="darwin"))
    monkeypatch.delattr(os, "sched_getaffinity")
    monkeypatch.setattr(fcntl, "F_FULLFSYNC", 51, raising=False)
    monkeypatch.setattr(fcntl, "fcntl", ask)
    monkeypatch.setattr(ctypes, "CDLL", None)  # its library has no prctl
    return asked


class _Windows:
    """Functions of `os` that refuse what Windows refuses."""

    def __init__(self) -> None:
        self._true = {name: getattr(os, name) for name in ("open", "mkdir", "unlink")}
        self._true |= {name: getattr(os, name) for name in ("replace", "fsync")}

    def open(self, path: Any, flags: int, mode: int = 0o777, **options: Any) -> int:
        _no_descriptors(options)
        if os.path.isdir(path):  # noqa: PTH112
            raise PermissionError(13, "Permission denied", str(path))
        return int(self._true["open"](path, flags, mode))

    def mkdir(self, path: Any, mode: int = 0o777, **options: Any) -> None:
        _no_descriptors(options)
        self._true["mkdir"](path, mode)

    def unlink(self, path: Any, **options: Any) -> None:
        _no_descriptors(options)
        _not_open(path)
        self._true["unlink"](path)

    def replace(self, path: Any, new: Any, **options: Any) -> None:
        _no_descriptors(options)
        _not_open(path)
        _not_open(new)
        self._true["replace"](path, new)

    def rename(self, path: Any, new: Any, **options: Any) -> None:
        if os.path.lexists(new):
            raise FileExistsError(17, "File exists", str(new))
        self.replace(path, new, **options)

    def fsync(self, descriptor: int) -> None:
        flags = Path(f"/proc/self/fdinfo/{descriptor}").read_text("utf-8")
        written = int(flags.split("flags:")[1].split()[0], 8) & os.O_ACCMODE
        if written == os.O_RDONLY:
            raise OSError(9, "Bad file descriptor")
        self._true["fsync"](descriptor)


def _no_descriptors(options: dict[str, Any]) -> None:
    if any(value is not None for value in options.values()):
        raise NotImplementedError("dir_fd unavailable on this platform")


def _not_open(path: Any) -> None:
    """Raise PermissionError where this process has the file, or one in the folder,
    open.
    """
    whole = Path(os.path.abspath(path))  # noqa: PTH100
    for descriptor in os.listdir("/proc/self/fd"):  # noqa: PTH208
        try:
            opened = Path(os.readlink(f"/proc/self/fd/{descriptor}"))  # noqa: PTH115
        except OSError:
            continue
        if opened == whole or opened.is_relative_to(whole):
            raise PermissionError(13, "The process cannot access the file", str(path))
