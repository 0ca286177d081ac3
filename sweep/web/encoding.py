"""Frames in a few bytes per boid, in the format of sweep.web.protocol."""

import struct
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sweep.web.page_text import packed

Floats = NDArray[np.float64]

FLOCKS = 1
ACCELERATIONS = 2
COVERAGE = 4
MAGIC = b"BSF1"
HEAD = struct.Struct("<4s3I4f")
SPAN = 65535
TURN = 256
ALONE = 65535
BLOCKED = 255
WHOLE = 254


def frame(
    step: int,
    bodies: Floats,
    size: tuple[float, float],
    sections: Sequence[tuple[int, bytes]] = (),
) -> bytes:
    """Return one frame in bytes.

    Parameters
    ----------
    step : int
        Steps done.
    bodies : array (4, N)
        x, y, vx and vy, in the model's length and length/time.
    size : (float, float)
        Width and height of the world, in the model's length.
    sections : sequence of (int, bytes), optional
        Flag and bytes of each section: return values of `flocks`, `accelerations` and
        `coverage`.
    """
    x, y, vx, vy = bodies
    left, right = _span(x, size[0])
    top, bottom = _span(y, size[1])
    flags = sum(flag for flag, _ in sections)
    counts = (flags, step, x.size)
    box = (left, top, right, bottom)
    head = HEAD.pack(MAGIC, *counts, *box)
    heading = (
        np.round(np.arctan2(vy, vx) * (TURN / (2 * np.pi))).astype(np.int64) % TURN
    )
    parts = [
        _quantised(x, left, right),
        _quantised(y, top, bottom),
        heading.astype(np.uint8).tobytes(),
    ]
    return head + padded(b"".join(parts)) + b"".join(section for _, section in sections)


def _span(coordinate: Floats, length: float) -> tuple[float, float]:
    """Return the ends of a coordinate in a frame.

    The ends are 0 and `length`, moved outwards to boids outside, but by no more than
    `length`. The values are rounded to the 32 bits that the page reads.
    """
    low = max(-length, min(0.0, coordinate.min()))
    high = min(2 * length, max(length, coordinate.max()))
    return float(np.float32(low)), float(np.float32(high))


def _quantised(coordinate: Floats, low: float, high: float) -> bytes:
    places = np.clip((coordinate - low) * (SPAN / (high - low)), 0, SPAN)
    return np.round(places).astype("<u2").tobytes()


def padded(content: bytes) -> bytes:
    """Return the content with as many zeros as make a multiple of 4 bytes."""
    return content + bytes(-len(content) % 4)


def packed_frames(frames: Sequence[bytes]) -> str:
    """Return frames of the same size as a text for a page.

    Successive frames differ by little. So the text has the differences of each byte in
    sequence, modulo 256. In measured pages, compression saves 40 % of them, but 7 % of
    the frames. The function `framesOf` of `static/packed.js` returns the frames.
    """
    rows = np.frombuffer(b"".join(frames), np.uint8).reshape(len(frames), -1)
    differences = np.diff(rows, axis=0, prepend=np.uint8(0))
    return packed(differences.T.tobytes())


def flocks(labels: NDArray[np.int64]) -> tuple[int, bytes]:
    """Return the section of flocks; `labels` (N,) has one number per flock."""
    _, first, members, sizes = np.unique(
        labels, return_index=True, return_inverse=True, return_counts=True
    )
    shown = np.where(sizes > 1, first % ALONE, ALONE)
    return FLOCKS, padded(shown[members].astype("<u2").tobytes())


def accelerations(by_rule: Floats) -> tuple[int, bytes]:
    """Return the section of accelerations (rules, 2, N)."""
    return ACCELERATIONS, struct.pack("<I", len(by_rule)) + by_rule.astype(
        "<f4"
    ).tobytes()


def coverage(shares: Floats) -> tuple[int, bytes]:
    """Return the section of coverage, from the visited fractions of cells.

    `shares` (rows, columns) are from 0 to 1; NaN in obstacles.
    """
    shown = np.where(np.isnan(shares), BLOCKED, np.round(WHOLE * shares))
    shown = shown.astype(np.uint8)
    return COVERAGE, struct.pack("<2I", *shown.shape) + padded(shown.tobytes())
