"""The two files of a checkpoint: the state of a trial, and its frames.

Each checkpoint replaces the state, and appends new frames to the earlier frames.

    boidsweep checkpoint 2 8f3a02c1...   the format, and the seal of the remaining file
    {"trial_id": ..., "step": 120000, "arrays": ..., ...}   a header in JSON
    ...                                  the bytes of the arrays, one after the other

The file of frames has records of one size. The header has the number of valid frames
and their CRC. The next writer cuts off frames whose writer died before the header was
written. No type and no size in memory is taken from the file: the arrays must match the
arrays of the trial at hand. The seal (HMAC-SHA256) is made with the private key of the
user: kernels use indices and counts without a check, and the numbers become results.
Bitwise identical results are promised only for equal code, libraries and processor, so
a checkpoint of another environment is rejected.
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

from sweep.store import cpu_name, flush, open_regular, read_whole, replacing
from sweep.trial import State, Taken
from sweep.workers.fingerprint import fingerprint, refusal

FORMAT = 2
MOST_HEADER = 2**20

FrameType = np.dtype[np.void]


class Saved(NamedTuple):
    """A state of a trial with its frames.

    Attributes
    ----------
    state : State
    seconds : float
        Wall seconds that the trial had taken before.
    frames : int
        Number of the frames.
    crc : int
        CRC-32 of the frames.
    """

    state: State
    seconds: float
    frames: int = 0
    crc: int = 0


def write_state(path: Path, trial_id: str, saved: Saved, key: bytes) -> None:
    """Replace the state of a trial in one step, and flush the state to disk.

    Parameters
    ----------
    path : Path
        File of the state.
    trial_id : str
        Id of the trial.
    saved : Saved
        State and seconds of the trial, and the number and CRC of the frames.
    key : bytes
        Key that seals the file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    with replacing(path) as file:
        file.write(state_bytes(trial_id, saved, key, fingerprint()))


def state_bytes(trial_id: str, saved: Saved, key: bytes, code: str) -> bytes:
    """Return the state of a trial as the content of a file.

    Parameters
    ----------
    trial_id, saved, key
        As in `write_state`.
    code : str
        Code and libraries on which the results depend, as JSON: a fingerprint, or a
        part of a fingerprint.
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

    Parameters
    ----------
    path : Path
        File of the state.
    trial_id : str
        Id of the trial.
    own : State
        State of the trial at its start, with equal names, types and shapes of arrays.
    key : bytes
        Key with which the file must be sealed.

    Raises
    ------
    ValueError
        If the file cannot be used; the message names the reason.
    OSError
        If the file cannot be read.
    """
    most = MOST_HEADER + sum(array.nbytes for array in own.arrays.values())
    content = read_whole(path, most)
    return state_of(content, trial_id, own, key, differing=refusal)


def state_of(
    content: bytes,
    trial_id: str,
    own: State,
    key: bytes,
    differing: Callable[[str], str],
) -> Saved:
    """Return the state of a trial from the content of a file.

    Parameters
    ----------
    content : bytes
        Content of the file.
    trial_id, own, key
        As in `read_state`.
    differing : callable
        Returns the differences between the code of this process and the code of the
        state, in words; "" if the state is usable.

    Raises
    ------
    ValueError
        If the state cannot be used; the message names the reason.
    """
    first_line, _, values = unsealed(content, key).partition(b"\n")
    header = json.loads(first_line)
    if header["trial_id"] != trial_id:
        raise ValueError("belongs to another trial")
    if differences := differing(header["code"]):
        raise ValueError(f"was written by other code: {differences}")
    if header["machine"] != _machine():
        raise ValueError(
            "was written on another kind of machine, which may round differently"
        )
    if header["arrays"] != _shapes(own):
        raise ValueError("has other arrays than the trial")
    state = State(_split(values, own), header["generator"])
    return Saved(
        state, float(header["seconds"]), int(header["frames"]), int(header["crc"])
    )


def frame_type(metrics: int, bodies: int, states: int = 0) -> FrameType:
    """Return the record of a frame: step, metrics, x, y, vx, vy and state of boids.

    Parameters
    ----------
    metrics : int
        Number of metrics.
    bodies : int
        Number of boids whose motion and state are recorded.
    states : int, default 0
        Number of values of state per boid.
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
    """Append frames to the valid frames of a file, and flush the file to disk.

    Parameters
    ----------
    path : Path
        File of the frames.
    kind : dtype
        Record of a frame, see `frame_type`.
    taken : iterable of Taken
        New frames.
    frames : int
        Number of valid frames in the file; later frames are cut off.
    crc : int
        CRC-32 of the valid frames.

    Returns
    -------
    frames, crc : int
        Number and CRC-32 of all frames.

    Raises
    ------
    OSError
        If the frames cannot be written, or the file is a link.
    """
    with _cut(path, frames * kind.itemsize) as file:
        file.seek(0, os.SEEK_END)
        for new in taken:
            content = frame_bytes(kind, new)
            file.write(content)
            frames += len(new.steps)
            crc = zlib.crc32(content, crc)
        file.flush()
        flush(file.fileno())
    return frames, crc


def frame_bytes(kind: FrameType, taken: Taken) -> bytes:
    """Return frames as bytes of a file; `kind` is the record of one frame."""
    rows = np.empty(len(taken.steps), kind)
    rows["step"] = taken.steps
    rows["values"] = taken.values.T
    rows["bodies"] = taken.bodies
    rows["state"] = taken.state
    return rows.tobytes()


def drop_frames(path: Path, kind: FrameType, frames: int) -> None:
    """Cut a file after its first frames, because later ones could not be written.

    Parameters
    ----------
    path : Path
        File of the frames.
    kind : dtype
        Record of a frame.
    frames : int
        Number of frames that stay.

    Raises
    ------
    OSError
        If the file cannot be cut, or is a link.
    """
    _cut(path, frames * kind.itemsize).close()


def _cut(path: Path, size: int) -> BinaryIO:
    """Return the file, open for writing, cut to `size` bytes."""
    file = open_regular(path, os.O_RDWR | os.O_CREAT)
    file.truncate(size)
    return file


def read_frames(path: Path, kind: FrameType, saved: Saved, most: int) -> Taken:
    """Read the frames that a checkpoint declares.

    Parameters
    ----------
    path : Path
        File of the frames.
    kind : dtype
        Record of a frame, see `frame_type`.
    saved : Saved
        State, with the number and CRC of its frames.
    most : int
        Number of frames of the whole trial.

    Raises
    ------
    ValueError
        If the frames are not as they were written.
    OSError
        If the file cannot be read.
    """
    if saved.frames > most:
        raise ValueError("has more frames than the trial has steps")
    size = saved.frames * kind.itemsize
    with open_regular(path) as file:
        if not 0 <= size <= os.fstat(file.fileno()).st_size:
            raise ValueError("has fewer frames than its header declares")
        content = file.read(size)
    return frames_of(content, kind, saved.crc)


def frames_of(content: bytes, kind: FrameType, crc: int) -> Taken:
    """Return frames from the content of a file.

    Parameters
    ----------
    content : bytes
        Bytes of the frames in the file.
    kind : dtype
        Record of a frame.
    crc : int
        CRC-32 that the content must have.

    Raises
    ------
    ValueError
        If the content has another CRC-32.
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
    """Return content with its seal as the first line."""
    return _first_line(content, key) + content


def unsealed(content: bytes, key: bytes) -> bytes:
    """Return content that was `sealed`, without its first line.

    Raises ValueError if the first line or the seal is wrong.
    """
    first, _, content = content.partition(b"\n")
    fields = first.split()
    if fields[:2] != [b"boidsweep", b"checkpoint"] or len(fields) != 4:
        raise ValueError("is not a checkpoint, or is damaged")
    if fields[2] != b"%d" % FORMAT:
        raise ValueError(f"has an unknown format; this version reads format {FORMAT}")
    if not hmac.compare_digest(first + b"\n", _first_line(content, key)):
        raise ValueError(
            "is damaged, or was written by another user, or on a machine with another"
            " key"
        )
    return content


def _first_line(content: bytes, key: bytes) -> bytes:
    seal = hmac.digest(key, content, "sha256").hex()
    return f"boidsweep checkpoint {FORMAT} {seal}\n".encode()


def _shapes(state: State) -> dict[str, Any]:
    """Return the type and the shape of each array."""
    return {
        name: [array.dtype.str, *array.shape] for name, array in state.arrays.items()
    }


def _split(values: bytes, own: State) -> dict[str, np.ndarray[Any, Any]]:
    """Split `values` into consecutive arrays with the shapes of `own`."""
    if len(values) != sum(array.nbytes for array in own.arrays.values()):
        raise ValueError("is damaged")
    arrays = {}
    start = 0
    for name, array in own.arrays.items():
        flat = np.frombuffer(values, array.dtype, array.size, start)
        arrays[name] = flat.reshape(array.shape)
        start += array.nbytes
    return arrays


@cache
def _machine() -> list[str]:
    """Return the processor and the mathematics library.

    The last bit of a number may depend on the processor and this library.
    """
    return [cpu_name(), platform.machine(), *platform.libc_ver()]
