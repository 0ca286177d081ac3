"""Identity of this machine and of processes, and the end of a process.

Only this module contains the system calls for these tasks.
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

    The name does not contain "~", the separator in names of folders.
    """
    return socket.gethostname().replace("~", "-")


def cpu_name() -> str:
    """Return the name that the system gives to the processor."""
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
    """Return the scope in which a process id identifies a process.

    On Linux the scope is the boot and the id namespace.
    """
    if sys.platform != "linux":
        return host()
    boot = Path("/proc/sys/kernel/random/boot_id").read_text("utf-8").strip()
    return f"{host()} {boot} {Path('/proc/self/ns/pid').readlink()}"


@cache
def here() -> str:
    """Return the name of this machine and eight characters of the hash of `machine()`.

    Names of folders contain this string. Two containers may have equal host names,
    although their process ids are unrelated.
    """
    return f"{host()}-{sha256(machine().encode()).hexdigest()[:8]}"


def started(process: int) -> str | None:
    """Return the start time of a process as a string; None if no such process exists.

    On Linux a jump of the clock does not change the string. The string and the process
    id together identify a process for ever. A process that has ended, but whose parent
    has not noticed, does not exist in this sense.
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
    """End a child process at once, in any state.

    Windows has no SIGKILL. There SIGTERM has this effect.
    """
    with suppress(ProcessLookupError):
        os.kill(process, getattr(signal, "SIGKILL", signal.SIGTERM))


def end_with(parent: int, began: str | None) -> None:
    """Make sure that this process ends with its parent, for any cause.

    `began` is the result of `started` for the parent. On Linux the kernel ends this
    process, even during a call that never returns. On further systems a thread checks
    the parent twice a second.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # the parent ended before the call of prctl
            os._exit(1)
    else:
        threading.Thread(target=_await_end, args=(parent, began), daemon=True).start()


def _await_end(process: int, began: str | None) -> None:
    while started(process) == began:
        time.sleep(LOOK_SECONDS)
    os._exit(1)
