"""First rows of a file of tracks: which columns it has, and how far apart times are."""

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.errors import SpecError
from sweep.recordings.files import FORMATS, CsvFile, WideFile
from sweep.recordings.row_errors import RowErrors
from sweep.recordings.rows import (
    DELIMITERS,
    RowsOf,
    check_columns,
    numbers,
    texts,
    times,
)
from sweep.spec import ANY, Delimiter, Document, Entry

USUAL: dict[str, tuple[str, ...]] = {
    "individual": (
        *("id", "individual", "individuals", "individual_id", "animal", "animal_id"),
        *("subject", "identity", "agent", "boid", "robot", "robot_id", "drone"),
        *("fish", "bird", "sheep", "ant", "bee", "locust", "mouse", "fly"),
        *("track", "track_id", "tag", "tag_id", "individual_local_identifier", "name"),
    ),
    "time": ("t", "time", "seconds", "sec", "timestamp", "datetime"),
    "frame": ("frame", "frames", "frame_number", "frame_id"),
    "x": (
        *("x", "px", "pos_x", "x_pos", "x_position", "position_x", "easting"),
        *("location_long", "longitude", "long", "lon"),
    ),
    "y": (
        *("y", "py", "pos_y", "y_pos", "y_position", "position_y", "northing"),
        *("location_lat", "latitude", "lat"),
    ),
    "vx": ("vx", "v_x", "velocity_x"),
    "vy": ("vy", "v_y", "velocity_y"),
    "event": (
        *("event", "event_id", "trial", "trial_id", "session", "session_id"),
        *("video", "run", "recording", "replicate"),
    ),
    "kind": ("kind", "species", "type"),
}
"""Usual names of each column, without capital letters and units."""
DEGREES = ("location_long", "longitude", "long", "lon")
"""Names of a column x that has degrees."""
WIDE = (("x_", "", "y_"), ("x", "", "y"), ("", "_x", "_y"), ("", ".x", ".y"))
"""Text before and after the name of an individual in a column x, and that of y."""
LENGTHS = ("m", "cm", "mm", "km", "px")
UNITS = re.compile(rf"(?P<name>.+?)_+(?P<unit>s|{'|'.join(LENGTHS)})_*")
"""Name of a column that ends with a unit, such as x_cm."""
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
        Mean time between two rows, without gaps and bursts; None for numbers of frames.
    longest : float
        Longest time between two rows of an individual.
    is_regular : bool
        True if all times are multiples of the time step after the first time.
    rows, individuals : int
        Numbers of rows and of individuals among the first rows.
    width, height : float
        Extent of the positions.
    length : str
        Unit of length in the name of the column x; "" without a unit.
    in_degrees : bool
        True if the positions are longitudes and latitudes.
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
    length: str
    in_degrees: bool


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
        message = f'{path}: ends with "{path.suffix}"; allowed: {", ".join(FORMATS)}'
        raise SpecError(message)
    delimiter = _delimiter(path)
    file = FORMATS[path.suffix](path, path.name, DELIMITERS[delimiter])
    check_columns(entry, file, ())
    columns = _columns(path, file.columns())
    if ANY in columns["x"]:
        patterns = (columns["x"], columns["y"])
        file = WideFile(
            path,
            path.name,
            file.delimiter,
            file,
            patterns=patterns,
        )
    errors = RowErrors(entry)
    names = list(columns.values())
    piece = next(file.pieces(names, errors), None)
    errors.check()
    if piece is None or not piece.num_rows:
        raise SpecError(f"{path}: has no rows")

    rows = RowsOf(file, np.arange(piece.num_rows))
    x = numbers(piece, columns["x"], rows, errors)
    y = numbers(piece, columns["y"], rows, errors)
    individuals = texts(piece[columns["individual"]]).dictionary_encode()
    if "event" in columns and piece.num_rows > 1:
        events = pc.count_distinct(piece[columns["event"]]).as_py()
        if events == piece.num_rows:  # numbers of rows, as in files of Movebank
            del columns["event"]
    time_step = None
    longest = 0.0
    is_regular = True
    if "time" in columns:
        clock = times(piece, columns["time"], rows, errors)
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
        length=_plain(columns["x"])[1],
        in_degrees=_plain(columns["x"])[0] in DEGREES,
    )


def _time_step(passed: NDArray[np.float64]) -> float:
    """Return the mean time between rows, without gaps and bursts.

    Rounded times have a wrong median. A time near an integer number of frames per
    second is that of the frame rate.
    """
    of_median = passed / np.median(passed)
    mean = float(passed[(of_median > 0.5) & (of_median < 1.5)].mean())
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
    """Return the present columns with usual names, by key.

    Of two columns with equal plain names, the first counts.
    """
    by_name = {_plain(name)[0]: name for name in present[::-1]}
    columns = {
        key: by_name[name]
        for key, names in USUAL.items()
        for name in names[::-1]
        if name in by_name
    }
    if "x" not in columns and "individual" not in columns:
        columns |= _wide_columns([*present])
    if "time" in columns:
        columns.pop("frame", None)
    if not {"vx", "vy"} <= columns.keys():
        columns = {key: columns[key] for key in columns if key not in ("vx", "vy")}
    lacking = [key for key in NEEDED if key not in columns]
    lacking += [] if {"time", "frame"} & columns.keys() else ["time"]
    if lacking:
        raise SpecError(
            f"{path}: no column has a usual name of {', '.join(lacking)}; the columns"
            f" are {', '.join(present)}. Rename columns, or write a spec with `columns:"
            f" {{{lacking[0]}: {present[0]}}}` by hand (`sweep guide recordings`)"
        )
    return columns


def _wide_columns(present: Sequence[str]) -> dict[str, str]:
    """Return the names of columns of positions per individual, if there are such."""
    usual = {name for names in USUAL.values() for name in names}
    present = [name for name in present if _plain(name)[0] not in usual]
    for begin, end, other in WIDE:
        x = f"{begin}{ANY}{end}"
        y = f"{ANY}{other}" if end else f"{other}{ANY}"
        names = [
            name[len(begin) : len(name) - len(end)]
            for name in present
            if name.startswith(begin) and name.endswith(end)
        ]
        own = [name for name in names if name and y.replace(ANY, name) in present]
        if own and len(own) == len(names):
            return {"individual": ANY, "x": x, "y": y}
    return {}


def _plain(name: str) -> tuple[str, str]:
    """Return the name of a column in small letters, without a unit, and the unit.

    The unit is "" for a name without one. `X (cm)` and `x_cm` are both x in cm.
    """
    plain = re.sub(r"[^0-9a-z]+", "_", name.strip().lower())
    match = UNITS.fullmatch(plain)
    return (match["name"], match["unit"]) if match else (plain.strip("_"), "")


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
