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
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from sweep.store.durable import flush
from sweep.store.new_files import replacing
from sweep.store.provenance import cpu_name
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
    state = saved.state
    header = {
        "trial_id": trial_id,
        "step": int(state.arrays["record.progress"][0]),
        "seconds": saved.seconds,
        "frames": saved.frames,
        "crc": saved.crc,
        "generator": state.generator,
        "room": state.room,
        "arrays": _shapes(state),
        "code": fingerprint(),
        "machine": _machine(),
    }
    arrays = (array.tobytes() for array in state.arrays.values())
    content = b"".join([json.dumps(header).encode(), b"\n", *arrays])
    with replacing(path) as file:
        file.write(_first_line(content, key))
        file.write(content)


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
    first, _, content = read_whole(path, most).partition(b"\n")
    _check_first_line(first + b"\n", content, key)
    header, _, values = content.partition(b"\n")
    about = json.loads(header)
    if about["trial_id"] != trial_id:
        raise ValueError("is of another trial")
    if differing := refusal(about["code"]):
        raise ValueError(f"was written by other code: {differing}")
    if about["machine"] != _machine():
        raise ValueError(
            "was written on another kind of machine, which may round otherwise"
        )
    if about["arrays"] != _shapes(own):
        raise ValueError("has other arrays than the trial")
    state = State(_split(values, own), about["generator"], int(about["room"]))
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
            rows = np.empty(len(one.steps), kind)
            rows["step"], rows["values"] = one.steps, one.values.T
            rows["bodies"], rows["state"] = one.bodies, one.state
            content = rows.tobytes()
            file.write(content)
            frames, crc = frames + len(rows), zlib.crc32(content, crc)
        file.flush()
        flush(file.fileno())
    return frames, crc


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
    if zlib.crc32(content) != saved.crc:
        raise ValueError("has damaged frames")
    rows = np.frombuffer(content, kind)
    return Taken(
        rows["step"].copy(),
        np.ascontiguousarray(rows["values"].T),
        rows["bodies"].copy(),
        rows["state"].copy(),
    )


def _first_line(content: bytes, key: bytes) -> bytes:
    seal = hmac.digest(key, content, "sha256").hex()
    return f"boidsweep checkpoint {FORMAT} {seal}\n".encode()


def _check_first_line(line: bytes, content: bytes, key: bytes) -> None:
    words = line.split()
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
