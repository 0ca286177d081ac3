"""Frames of recordings that are kept on this machine.

The name of a file is the sha256 of its content. Each process maps the frames that a
trial needs. Workers import no tables, so this module reads none.
"""

import hashlib
import os
import shutil
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from kernels.model import Event
from sweep.errors import StoreError

Floats = NDArray[np.float64]
FRAMES_AT_ONCE = 4096
"""Frames of which the hash is computed at once."""
MOST_KEPT = 20 * 10**9
"""Bytes of kept frames; the frames that no process has used for longest are deleted."""
FRAMES = ".frames.npy"
READING = "reading-"
DAY = 86_400.0
REMEDY = "launch the study again where its files are"


def frames_folder() -> Path:
    """Return the folder of this user with the frames of recordings.

    Raises StoreError if the user has no home folder.
    """
    cache = Path(os.environ.get("XDG_CACHE_HOME") or "")
    if not cache.is_absolute():
        try:
            cache = Path.home() / ".cache"
        except RuntimeError:
            raise StoreError("you have no home folder; set XDG_CACHE_HOME") from None
    return cache / "boidsweep" / "recordings"


def open_frames(event: Event) -> Floats:
    """Return the frames of an event, shape (F, 4, N), as a map of the file.

    The rows are x, y, vx and vy; NaN for an individual without a position.

    Raises StoreError if the frames are not on this machine, or have changed.
    """
    path = frames_folder() / f"{event.sha}{FRAMES}"
    try:
        frames: Floats = np.load(path, mmap_mode="r")
        size = path.stat().st_size
        with suppress(OSError):
            os.utime(path)
    except (OSError, ValueError):
        raise _not_kept(event) from None
    if _sha_of(path, size) != event.sha:
        path.unlink(missing_ok=True)
        _sha_of.cache_clear()
        raise StoreError(f"{path} was damaged, and is deleted; {REMEDY}")
    shape = (event.steps + 1, 4, event.boids)
    if frames.dtype != np.float64 or frames.shape != shape:
        reason = f'event "{event.name}" has other frames than the study says'
        raise StoreError(f"{reason}; {REMEDY}")
    return frames


@cache
def _sha_of(path: Path, _size: int) -> str:
    """Return the sha256 of kept frames, computed once in a process."""
    return sha_of_frames(np.load(path, mmap_mode="r"))


def sha_of_frames(frames: Floats) -> str:
    """Return the sha256 of frames and of their shape."""
    digest = hashlib.sha256(repr(frames.shape).encode())
    for first in range(0, len(frames), FRAMES_AT_ONCE):
        digest.update(frames[first : first + FRAMES_AT_ONCE].tobytes())
    return digest.hexdigest()


def check_kept(events: Iterable[Event]) -> None:
    """Raise StoreError unless the frames of all events are on this machine."""
    for event in events:
        if not are_kept(event):
            raise _not_kept(event)


def are_kept(event: Event) -> bool:
    """Return whether the frames of an event are on this machine, and note the use."""
    path = frames_folder() / f"{event.sha}{FRAMES}"
    with suppress(OSError):
        os.utime(path)
    return path.is_file()


def _not_kept(event: Event) -> StoreError:
    reason = f'the frames of event "{event.name}" of a recording are not in'
    return StoreError(f"{reason} {frames_folder()}; {REMEDY}")


@contextmanager
def working_folder() -> Iterator[Path]:
    """Make an empty folder next to the kept frames, and delete it at the end."""
    parent = frames_folder()
    parent.mkdir(parents=True, exist_ok=True)
    for left in parent.glob(f"{READING}*"):  # of a process that was killed
        with suppress(OSError):
            if time.time() - left.stat().st_mtime > DAY:
                shutil.rmtree(left)
    folder = Path(tempfile.mkdtemp(prefix=READING, dir=parent))
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def forget_oldest(needed: Sequence[str]) -> None:
    """Delete the frames that were used longest ago, so that MOST_KEPT suffices.

    The frames with a hash in `needed` remain.
    """
    files = []
    for file in frames_folder().glob(f"*{FRAMES}"):
        with suppress(OSError):  # another process deletes the file
            state = file.stat()
            files.append((state.st_mtime, state.st_size, file))
    total = sum(size for _, size, _ in files)
    for _, size, file in sorted(files):
        if total <= MOST_KEPT:
            return
        if file.name.removesuffix(FRAMES) not in needed:
            with suppress(OSError):
                file.unlink()
                total -= size
