"""Which machine this is, and whether a process id still means the same process."""

import socket
import sys
from functools import cache
from hashlib import sha256
from pathlib import Path


def host() -> str:
    """The name of this machine, without the sign that parts names of folders."""
    return socket.gethostname().replace("~", "-")


def machine() -> str:
    """The scope in which a process id means one process: on Linux the boot and the id
    namespace.
    """
    if sys.platform != "linux":
        return host()
    boot = Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    return f"{host()} {boot} {Path('/proc/self/ns/pid').readlink()}"


@cache
def here() -> str:
    """The name of this machine and eight signs that stand for `machine()`, for names of
    folders.

    Two containers may share a host name; a process id of one means nothing in the
    other.
    """
    return f"{host()}-{sha256(machine().encode()).hexdigest()[:8]}"


def started(process: int) -> str | None:
    """When a process here began, as text that no jump of the clock changes on Linux;
    None where there is none.

    Together with its id this names a process for ever. A process that has ended, but
    whose parent has not noticed, counts as none.
    """
    if sys.platform == "linux":
        try:
            state, *numbers = (
                Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()
            )
        except (FileNotFoundError, ProcessLookupError):
            return None
        return None if state in "ZX" else numbers[18]
    import psutil

    try:
        return str(round(psutil.Process(process).create_time()))
    except psutil.NoSuchProcess:
        return None
