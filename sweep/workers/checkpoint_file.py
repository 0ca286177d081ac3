"""The two files of a checkpoint: the state of a trial, replaced each time, and its
frames, to which new ones are added.

    boidsweep checkpoint 2 8f3a02c1...   the format, and the seal of all that follows
    {"trial_id": ..., "step": 120000, "arrays": ..., ...}   a header in JSON
    ...                                  the bytes of the arrays, one after the other

The file of frames has records of one size. The header says how many of them count, and
their CRC: records that a writer added, but died before it could declare, are cut off by
the next writer. No type and no size in memory is taken from the file: its arrays must
have those of the trial at hand. The seal (HMAC-SHA256) is made with the user's own key,
because kernels take indices and counts without a check, and numbers become results. The
same bits are promised only for the same code, libraries and processor, so a checkpoint
of others is refused.
"""

import hmac
import json
import os
import platform
import zlib
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from sweep.store.durable import flush
from sweep.store.new_files import replacing
from sweep.store.processes import cpu_name
from sweep.store.regular import open_regular, read_whole
from sweep.trial.state import State, Taken
from sweep.workers.fingerprint import fingerprint, refusal

FORMAT = 2
MOST_HEADER = 2**20

FrameType = np.dtype[np.void]


class Saved(NamedTuple):
    """A state, the seconds that the trial had taken until then, and the number and CRC
    of its frames.
    """

    state: State
    seconds: float
    frames: int = 0
    crc: int = 0


def write_state(path: Path, trial_id: str, saved: Saved, key: bytes) -> None:
    """Replace the state of a trial in one step. Afterwards the disk holds it.

        path      the file of the state
        trial_id  the trial
        saved     its state, seconds, and the number and CRC of its frames
        key       the key that seals the file

    Raises OSError.
    """
    with replacing(path) as file:
        file.write(state_bytes(trial_id, saved, key, fingerprint()))


def state_bytes(trial_id: str, saved: Saved, key: bytes, code: str) -> bytes:
    """The content of the file of the state of a trial: see `write_state`. `code` says
    on which code its bits depend.
    """
    state = saved.state
    header = {
        "trial_id": trial_id,
        "step": int(state.arrays["record.progress"][0]),
        "seconds": saved.seconds,
        "frames": saved.frames,
        "crc": saved.crc,
        "generator": state.generator,
        "arrays": _shapes(state),
        "code": code,
        "machine": _machine(),
    }
    arrays = (array.tobytes() for array in state.arrays.values())
    content = b"".join([json.dumps(header).encode(), b"\n", *arrays])
    return sealed(content, key)


def read_state(path: Path, trial_id: str, own: State, key: bytes) -> Saved:
    """Read the state of a trial.

        path      the file of the state
        trial_id  the trial
        own       the state of the trial at its start; both have the same arrays
        key       the key with which the file must be sealed

    Raises ValueError, which says what is wrong, if the file cannot be used. Raises
    OSError if it cannot be read.
    """
    most = MOST_HEADER + sum(array.nbytes for array in own.arrays.values())
    return state_of(read_whole(path, most), trial_id, own, key, refusal)


def state_of(
    content: bytes,
    trial_id: str,
    own: State,
    key: bytes,
    refused: Callable[[str], str],
) -> Saved:
    """The state of a trial in the content of its file: see `read_state`. `refused` says
    why it cannot be used by what it says of its code.
    """
    header, _, values = unsealed(content, key).partition(b"\n")
    about = json.loads(header)
    if about["trial_id"] != trial_id:
        raise ValueError("is of another trial")
    if differing := refused(about["code"]):
        raise ValueError(f"was written by other code: {differing}")
    if about["machine"] != _machine():
        raise ValueError(
            "was written on another kind of machine, which may round otherwise"
        )
    if about["arrays"] != _shapes(own):
        raise ValueError("has other arrays than the trial")
    state = State(_split(values, own), about["generator"])
    return Saved(
        state, float(about["seconds"]), int(about["frames"]), int(about["crc"])
    )


def frame_type(metrics: int, bodies: int, states: int = 0) -> FrameType:
    """The record of a frame: its step, metrics, and x, y, vx, vy and so many rows of
    state of `bodies` boids.
    """
    return np.dtype(
        [
            ("step", "<i8"),
            ("values", "<f8", (metrics,)),
            ("bodies", "<f8", (4, bodies)),
            ("state", "<f8", (states, bodies)),
        ]
    )


def add_frames(
    path: Path, kind: FrameType, taken: Iterable[Taken], frames: int, crc: int
) -> tuple[int, int]:
    """Write frames behind the first ones of a file. Afterwards the disk holds them.

        path    the file of the frames
        kind    the record of a frame, see `frame_type`
        taken   the new frames
        frames  how many frames of the file count; later ones are cut off
        crc     the CRC of these

    Returns the number and the CRC of all frames. Raises OSError, also if the file is a
    link.
    """
    with _cut(path, frames * kind.itemsize) as file:
        file.seek(0, os.SEEK_END)
        for one in taken:
            content = frame_bytes(kind, one)
            file.write(content)
            frames, crc = frames + len(one.steps), zlib.crc32(content, crc)
        file.flush()
        flush(file.fileno())
    return frames, crc


def frame_bytes(kind: FrameType, taken: Taken) -> bytes:
    """Frames as they stand in a file; `kind` is the record of one."""
    rows = np.empty(len(taken.steps), kind)
    rows["step"], rows["values"] = taken.steps, taken.values.T
    rows["bodies"], rows["state"] = taken.bodies, taken.state
    return rows.tobytes()


def drop_frames(path: Path, kind: FrameType, frames: int) -> None:
    """Cut a file after its first `frames` frames, because others could not be written.
    Raises OSError, also for a link.
    """
    _cut(path, frames * kind.itemsize).close()


def _cut(path: Path, size: int) -> BinaryIO:
    """The file, open for writing, cut to at most `size` bytes."""
    file = open_regular(path, os.O_RDWR | os.O_CREAT)
    file.truncate(size)
    return file


def read_frames(path: Path, kind: FrameType, saved: Saved, most: int) -> Taken:
    """Read the frames that a checkpoint declares.

        path   the file of the frames
        kind   the record of a frame, see `frame_type`
        saved  the state, with the number and CRC of its frames
        most   how many frames the whole trial has

    Raises ValueError if they are not what was written, or OSError.
    """
    if saved.frames > most:
        raise ValueError("has more frames than the trial has steps")
    size = saved.frames * kind.itemsize
    with open_regular(path) as file:
        if not 0 <= size <= os.fstat(file.fileno()).st_size:
            raise ValueError("has fewer frames than it says")
        content = file.read(size)
    return frames_of(content, kind, saved.crc)


def frames_of(content: bytes, kind: FrameType, crc: int) -> Taken:
    """The frames in the content of a file. Raises ValueError where they are not those
    of that CRC.
    """
    if zlib.crc32(content) != crc:
        raise ValueError("has damaged frames")
    rows = np.frombuffer(content, kind)
    return Taken(
        rows["step"].copy(),
        np.ascontiguousarray(rows["values"].T),
        rows["bodies"].copy(),
        rows["state"].copy(),
    )


def sealed(content: bytes, key: bytes) -> bytes:
    """Some content behind a first line with its seal."""
    return _first_line(content, key) + content


def unsealed(content: bytes, key: bytes) -> bytes:
    """What was `sealed`. Raises ValueError, which says what is wrong."""
    first, _, content = content.partition(b"\n")
    line, words = first + b"\n", first.split()
    if words[:2] != [b"boidsweep", b"checkpoint"] or len(words) != 4:
        raise ValueError("is not a checkpoint, or is damaged")
    if words[2] != b"%d" % FORMAT:
        raise ValueError(
            f"is of a format that this version does not know; it knows {FORMAT}"
        )
    if not hmac.compare_digest(line, _first_line(content, key)):
        raise ValueError(
            "is damaged, or was written by somebody else or on a machine where you have"
            " another key"
        )
    return content


def _first_line(content: bytes, key: bytes) -> bytes:
    seal = hmac.digest(key, content, "sha256").hex()
    return f"boidsweep checkpoint {FORMAT} {seal}\n".encode()


def _shapes(state: State) -> dict[str, Any]:
    """The type and the shape of every array."""
    return {
        name: [array.dtype.str, *array.shape] for name, array in state.arrays.items()
    }


def _split(values: bytes, own: State) -> dict[str, np.ndarray[Any, Any]]:
    """The arrays in `values`, one after the other, with types and shapes of `own`."""
    if len(values) != sum(array.nbytes for array in own.arrays.values()):
        raise ValueError("is damaged")
    found, start = {}, 0
    for name, array in own.arrays.items():
        found[name] = np.frombuffer(values, array.dtype, array.size, start).reshape(
            array.shape
        )
        start += array.nbytes
    return found


@cache
def _machine() -> list[str]:
    """What the last bit of a number may depend on besides the code: the processor and
    the mathematics library.
    """
    return [cpu_name(), platform.machine(), *platform.libc_ver()]
