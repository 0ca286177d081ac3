"""One launch of a study at a time: a lock that says who holds it, and that is not trusted for ever.

    <study>/lock/<token>.json     the owner; touched every few seconds as a sign of life

To take it, a folder with such a file is renamed to `lock`, which fails where that exists and is not empty. To take it
over from a dead owner, that owner's file is deleted by its own name, and so never the one of somebody who was quicker;
then all who want it race for the rename. On one machine the process decides whether an owner lives. Elsewhere it
does while its file's time moves on, or is at most STALE_SECONDS old by the clock of the file system. A clock that
jumps is no death: a file that looks too old, or comes from the future, is watched for a while before it is believed.
"""

import errno
import getpass
import json
import logging
import os
import secrets
import threading
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from types import TracebackType

from sweep.parquet import StoreError
from sweep.processes import host, machine, started

BEAT_SECONDS = 5.0
STALE_SECONDS = 60.0
WATCH_SECONDS = 15.0
LOG = logging.getLogger("sweep")


class Lock:
    """Holds the lock of the study in `folder` while the context lasts; `staging` is its store's.

    Entering raises StoreError where somebody else holds it. That a lock was taken over is said on the log.
    """

    def __init__(self, folder: Path, staging: Callable[[str], AbstractContextManager[Path]]) -> None:
        self.path = folder / "lock"
        self.lost = False
        token = secrets.token_hex(8)
        self.file = self.path / f"{token}.json"
        self._staging = staging(f"lock-{token}")
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._beat, name="lock", daemon=True)

    def __enter__(self) -> "Lock":
        with self._staging as folder:
            own = folder / self.file.name
            own.write_text(json.dumps(_owner()), encoding="utf-8")
            while not self._moved(folder):
                self._evict(own)
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        self._thread.join()
        with suppress(OSError):
            self.file.unlink()
            self.path.rmdir()

    def check(self) -> None:
        """Raise StoreError where somebody has taken the lock over, as after this machine has slept."""
        if self.lost:
            raise StoreError(f"{self.path}: another launch has taken this study over; what is done is stored")

    def _moved(self, folder: Path) -> bool:
        try:
            folder.rename(self.path)
        except OSError as error:
            if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                raise
            return False
        return True

    def _evict(self, own: Path) -> None:
        """Make way where the owner is dead. Raises StoreError where it is not."""
        for file in _files(self.path):
            with suppress(FileNotFoundError):  # it has just been given back
                owner = _read(file)
                death = _death(file, owner, own)
                if not death:
                    who = owner["who"]
                    raise StoreError(f"{self.path}: this study is being launched by {who}; wait for it, or end it")
                file.unlink()
                LOG.warning("%s: taken over from %s: %s", self.path, owner["who"], death)

    def _beat(self) -> None:
        while not self.lost and not self._over.wait(BEAT_SECONDS):
            try:
                os.utime(self.file)
            except FileNotFoundError:
                self.lost = True
            except OSError:  # a server that does not answer now may do so at the next beat
                continue


def _owner() -> dict[str, object]:
    name, process = host(), os.getpid()
    try:
        user = getpass.getuser()
    except (KeyError, OSError):  # a user without a name
        user = str(os.getuid())
    since = time.strftime("%Y-%m-%d %H:%M:%S %Z")
    who = f"{user} on {name} (process {process}) since {since}"
    about = {"host": name, "process": process, "user": user, "since": since, "who": who}
    return about | {"machine": machine(), "started": started(process) or ""}


def _read(file: Path) -> dict[str, object]:
    """The owner; what the disk has lost after a power cut is nobody."""
    try:
        owner: dict[str, object] = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        return {"who": "somebody", "machine": ""}
    return owner


def _death(file: Path, owner: dict[str, object], own: Path) -> str:
    """How it is known that the owner is dead; empty where it may live. `own` is a file to be touched."""
    if owner["machine"] == machine():
        return "" if started(int(str(owner["process"]))) == owner["started"] else "that process is gone"
    os.utime(own)
    age = (_touched(own) - _touched(file)) / 1e9
    if abs(age) <= STALE_SECONDS or _is_touched(file):
        return ""
    return f"without a sign of life for {age:.0f} s" if age > 0 else "without a sign of life"


def _is_touched(file: Path) -> bool:
    """Whether somebody touches the file while we watch."""
    before, end = _touched(file), time.monotonic() + WATCH_SECONDS
    while time.monotonic() < end:
        time.sleep(min(0.5, WATCH_SECONDS / 10))
        if _touched(file) != before:
            return True
    return False


def _touched(file: Path) -> int:
    """When a file was last touched, in ns; it is opened for that, as network file systems remember old times else."""
    with file.open("rb") as opened:
        return os.fstat(opened.fileno()).st_mtime_ns


def _files(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except FileNotFoundError:
        return []
