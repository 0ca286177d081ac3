"""First rows of a file of tracks: which columns it has, and how far apart times are."""

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.errors import SpecError
from sweep.recordings.files import FORMATS, CsvFile
from sweep.recordings.row_errors import RowErrors
from sweep.recordings.rows import DELIMITERS, check_columns, numbers, texts, times
from sweep.spec import Delimiter, Document, Entry

USUAL: dict[str, tuple[str, ...]] = {
    "individual": ("id", "individual", "individuals", "animal", "boid", "agent"),
    "time": ("t", "time", "seconds"),
    "frame": ("frame", "frames", "frame_number"),
    "x": ("x", "px", "pos_x", "x_m", "x_cm", "x_px"),
    "y": ("y", "py", "pos_y", "y_m", "y_cm", "y_px"),
    "vx": ("vx", "v_x", "velocity_x"),
    "vy": ("vy", "v_y", "velocity_y"),
    "event": ("event", "trial", "trial_id", "session"),
    "kind": ("kind", "species"),
}
"""Usual names of each column, in small letters."""
NEEDED = ("individual", "x", "y")
DIGITS = 12
"""Digits of a time step that is computed from times in a file."""
NEAR_FRAME_RATE = 5e-4
"""Largest relative difference from an integer number of frames per second.

The rates of NTSC, such as 29.97, differ by 1e-3.
"""


class Survey(NamedTuple):
    """Facts from the first rows of a file.

    Attributes
    ----------
    columns : dict of str to str
        Names of the columns, by key of `columns`.
    delimiter : Delimiter
    time_step : float or None
        Mean time between two rows without gaps; None for numbers of frames.
    longest : float
        Longest time between two rows of an individual.
    is_regular : bool
        True if all times are multiples of the time step after the first time.
    rows, individuals : int
        Numbers of rows and of individuals among the first rows.
    width, height : float
        Extent of the positions.
    """

    columns: dict[str, str]
    delimiter: Delimiter
    time_step: float | None
    longest: float
    is_regular: bool
    rows: int
    individuals: int
    width: float
    height: float


def survey(path: Path) -> Survey:
    """Return facts from the first rows of a file.

    Parameters
    ----------
    path : Path
        CSV or parquet file.

    Returns
    -------
    Survey

    Raises
    ------
    SpecError
        If the file cannot be read, has no rows or lacks a usual column.
    """
    entry = Entry(Document(path, ""), (), {})
    if path.suffix not in FORMATS:
        words = f'{path}: ends with "{path.suffix}"; allowed: {", ".join(FORMATS)}'
        raise SpecError(words)
    delimiter = _delimiter(path)
    file = FORMATS[path.suffix](path, path.name, DELIMITERS[delimiter])
    check_columns(entry, file, ())
    columns = _columns(path, file.columns())
    errors = RowErrors(entry)
    names = list(columns.values())
    piece = next(file.pieces(names, errors), None)
    if piece is None or not piece.num_rows:
        raise SpecError(f"{path}: has no rows")

    x = numbers(piece, columns["x"], file, 0, errors=errors)
    y = numbers(piece, columns["y"], file, 0, errors=errors)
    individuals = texts(piece[columns["individual"]]).dictionary_encode()
    time_step = None
    longest = 0.0
    is_regular = True
    if "time" in columns:
        clock = times(piece, columns["time"], file, 0, errors=errors)
        passed = np.concatenate([*_passed(piece, columns, individuals, clock)])
        if not passed.size:
            raise SpecError(f"{path}: no individual has two rows")
        time_step = _time_step(passed)
        longest = float(passed.max())
        steps = passed / time_step
        is_regular = bool((np.abs(steps - np.round(steps)) < 1e-3).all())
    return Survey(
        columns,
        delimiter,
        time_step=time_step,
        longest=longest,
        is_regular=is_regular,
        rows=piece.num_rows,
        individuals=len(individuals.dictionary),
        width=float(np.nanmax(x) - np.nanmin(x)),
        height=float(np.nanmax(y) - np.nanmin(y)),
    )


def _time_step(passed: NDArray[np.float64]) -> float:
    """Return the mean time between rows without gaps.

    Rounded times have a wrong median. A time near an integer number of frames per
    second is that of the frame rate.
    """
    near = passed[passed < 1.5 * np.median(passed)]
    mean = float(near.mean())
    rate = round(1.0 / mean)
    if rate and abs(mean * rate - 1.0) < NEAR_FRAME_RATE:
        return float(f"{1.0 / rate:.{DIGITS}g}")
    return float(f"{mean:.{DIGITS}g}")


def _delimiter(path: Path) -> Delimiter:
    """Return the delimiter that is most frequent in the first line of a CSV file."""
    if FORMATS[path.suffix] is not CsvFile:
        return "comma"
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            header = file.readline()
    except (OSError, ValueError, csv.Error) as error:
        raise SpecError(f"{path}: cannot be read: {error}") from None
    return max(DELIMITERS, key=lambda name: header.count(DELIMITERS[name]))


def _columns(path: Path, present: Sequence[str]) -> dict[str, str]:
    """Return the present columns with usual names, by key."""
    by_name = {name.strip().lower(): name for name in present}
    columns = {
        key: by_name[name]
        for key, names in USUAL.items()
        for name in names[::-1]
        if name in by_name
    }
    if "time" in columns:
        columns.pop("frame", None)
    if not {"vx", "vy"} <= columns.keys():
        columns = {key: columns[key] for key in columns if key not in ("vx", "vy")}
    lacking = [key for key in NEEDED if key not in columns]
    lacking += [] if {"time", "frame"} & columns.keys() else ["time"]
    if lacking:
        raise SpecError(
            f"{path}: no column has a usual name of {', '.join(lacking)}; the columns"
            f" are {', '.join(present)}. Rename columns, or write the spec by hand"
            " (`sweep guide recordings`)"
        )
    return columns


def _passed(
    piece: pa.Table,
    columns: dict[str, str],
    individuals: pa.Array,
    times: NDArray[np.float64],
) -> Iterator[NDArray[np.float64]]:
    """Yield the times between the rows of each individual in each event."""
    yield np.empty(0)
    groups = individuals.indices.to_numpy().astype(np.int64)
    if "event" in columns:
        events = texts(piece[columns["event"]]).dictionary_encode()
        groups = groups * len(events.dictionary) + events.indices.to_numpy()
    order = np.lexsort((times, groups))
    ends = np.flatnonzero(np.diff(groups[order])) + 1
    for rows in np.split(order, ends):
        passed = np.diff(times[rows])
        yield passed[passed > 0]
