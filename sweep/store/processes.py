"""Identity of this machine and of processes, and how a process ends.

This is the one place that knows the calls of each system for that.
"""

import ctypes
import getpass
import os
import platform
import signal
import socket
import sys
import threading
import time
from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

PR_SET_PDEATHSIG = 1
LOOK_SECONDS = 0.5


def host() -> str:
    """Return the name of this machine.

    It is without the character that parts names of folders.
    """
    return socket.gethostname().replace("~", "-")


def cpu_name() -> str:
    """Return the processor's name as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [
        line.partition(":")[2].strip()
        for line in lines
        if line.startswith("model name")
    ]
    return names[0] if names else platform.processor()


def machine() -> str:
    """Return the scope in which a process id means one process.

    On Linux that is the boot and the id namespace.
    """
    if sys.platform != "linux":
        return host()
    boot = Path("/proc/sys/kernel/random/boot_id").read_text("utf-8").strip()
    return f"{host()} {boot} {Path('/proc/self/ns/pid').readlink()}"


@cache
def here() -> str:
    """Return the name of this machine and eight characters of the hash of `machine()`.

    It is for names of folders. Two containers may have one host name; a process id of
    one means nothing in the other.
    """
    return f"{host()}-{sha256(machine().encode()).hexdigest()[:8]}"


def started(process: int) -> str | None:
    """Return when a process here began, as text; None if there is no such process.

    On Linux no jump of the clock changes the text. Together with its id this names a
    process for ever. A process that has ended, but whose parent has not noticed, counts
    as none.
    """
    if sys.platform == "linux":
        try:
            status = Path(f"/proc/{process}/stat").read_text("utf-8", "replace")
            state, *numbers = status.rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            return None
        return None if state in "ZX" else numbers[18]
    import psutil

    try:
        running = psutil.Process(process)
        ended = running.status() == psutil.STATUS_ZOMBIE
        return None if ended else str(round(running.create_time()))
    except psutil.NoSuchProcess:
        return None


def user() -> str:
    """Return the name of the user, or a number if there is no name."""
    try:
        return getpass.getuser()
    except (ImportError, KeyError, OSError):
        return str(os.getuid()) if hasattr(os, "getuid") else "somebody"


def end(process: int) -> None:
    """End a child process at once, whatever it does.

    On Windows, which has no SIGKILL, SIGTERM does that.
    """
    with suppress(ProcessLookupError):
        os.kill(process, getattr(signal, "SIGKILL", signal.SIGTERM))


def end_with(parent: int, began: str | None) -> None:
    """Make sure that this process ends with its parent, whatever ends that one.

    `began` is what `started` returns for the parent. Linux sees to it, even where a
    call of this process never returns. Elsewhere a thread looks twice a second.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it ended before we had asked
            os._exit(1)
    else:
        threading.Thread(target=_await_end, args=(parent, began), daemon=True).start()


def _await_end(process: int, began: str | None) -> None:
    while started(process) == began:
        time.sleep(LOOK_SECONDS)
    os._exit(1)
