"""Rows of files: which files and columns a section names, and values of columns."""

import os
from collections.abc import Sequence
from contextlib import suppress
from glob import escape, glob
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.recordings.files import FORMATS, UNREADABLE, CsvFile, TrackFile, WideFile
from sweep.recordings.row_errors import RowErrors
from sweep.spec import ANY, FILE, Delimiter, Entry, Mistakes, RecordingSpec
from sweep.text import shortened, unknown

MISSING = ("", "NA", "NaN", "nan", "null", "None")
"""Texts of a missing value."""
DELIMITERS: dict[Delimiter, str] = {"comma": ",", "semicolon": ";", "tab": "\t"}
Floats = NDArray[np.float64]


def track_files(entry: Entry, spec: RecordingSpec) -> list[TrackFile]:
    """Return the files of a recording, in the order of their names.

    Raises SpecError with all patterns without files, and files of another format.
    """
    mistakes = Mistakes()
    folder = entry.document.path.parent
    delimiter = DELIMITERS[spec.delimiter]
    names = dict[Path, str]()
    for index, pattern in enumerate(spec.files):
        item = entry.child("files").child(index)
        with mistakes.noted():
            for path in _matches(item, pattern, folder):
                is_absolute = Path(pattern).is_absolute()
                name = path if is_absolute else Path(os.path.relpath(path, folder))
                names[path] = name.as_posix()
    mistakes.check()
    files = [
        FORMATS[path.suffix](path, name, delimiter) for path, name in names.items()
    ]
    columns = spec.columns
    patterns = tuple(
        name
        for name in (columns.x, columns.y, columns.vx, columns.vy)
        if name is not None and ANY in name
    )
    if not patterns:
        return files
    return [
        WideFile(
            file.path,
            file.name,
            delimiter,
            file,
            patterns=patterns,
        )
        for file in files
    ]


def _matches(item: Entry, pattern: str, folder: Path) -> list[Path]:
    """Return the files of a pattern. Raises SpecError if they cannot be read."""
    # Path.glob takes no absolute pattern.
    is_absolute = Path(pattern).is_absolute()
    inside = pattern if is_absolute else f"{escape(str(folder))}/{pattern}"
    every = sorted(glob(inside, recursive=True))  # noqa: PTH207
    matches = [Path(path) for path in every if Path(path).is_file()]
    if not matches:
        raise item.error(f'no file matches "{shortened(pattern)}" in {folder}')
    for path in matches:
        if path.suffix not in FORMATS:
            reason = f'"{path.name}" ends with "{path.suffix}"'
            raise item.error(f"{reason}; allowed: {', '.join(FORMATS)}")
    return matches


def check_columns(entry: Entry, file: TrackFile, columns: Sequence[str]) -> None:
    """Raise SpecError with all mistakes unless a file has all columns, each once.

    Parameters
    ----------
    entry : Entry
        Section of the spec; errors have the line of this entry.
    file : TrackFile
    columns : sequence of str
        Names of the columns.
    """
    try:
        present = file.columns()
    except UNREADABLE as error:
        raise entry.error(f"{file.name} cannot be read: {error}") from None
    needed = [column for column in columns if column != FILE]
    lacking = [column for column in needed if column not in present]
    if lacking and (hint := _other_delimiter(present, file)):
        reason = unknown("column", lacking[0], present)
        raise entry.error(f"{file.name}: {reason}{hint}")
    mistakes = Mistakes()
    for column in needed:
        with mistakes.noted():
            if column in lacking:
                reason = unknown("column", column, present)
                raise entry.error(f"{file.name}: {reason}")
            if present.count(column) > 1:
                raise entry.error(f'{file.name} has several columns "{column}"')
    mistakes.check()


def _other_delimiter(present: Sequence[str], file: TrackFile) -> str:
    """Return a hint if the only column of a CSV file contains another delimiter."""
    if len(present) != 1 or not isinstance(file, CsvFile):
        return ""
    for name, delimiter in DELIMITERS.items():
        if delimiter in present[0]:
            return f"; is the delimiter a {name}? Then write `delimiter: {name}`"
    return ""


class RowsOf(NamedTuple):
    """The rows of a file that a piece has.

    Attributes
    ----------
    file : TrackFile
    numbers : array of int, shape (n,)
        Numbers of the rows in the file, from 0.
    """

    file: TrackFile
    numbers: NDArray[np.int64]

    def place(self, index: int) -> str:
        """Return the file and the row of an index of the piece, in words."""
        return self.file.place(int(self.numbers[index]))


def numbers(piece: pa.Table, name: str, rows: RowsOf, errors: RowErrors) -> Floats:
    """Return a column as numbers, NaN for missing values.

    Parameters
    ----------
    piece : pyarrow.Table
        n rows.
    name : str
        Name of the column.
    rows : RowsOf
        The rows in their file.
    errors : RowErrors
        Receives texts in place of numbers, and infinite numbers.

    Returns
    -------
    array of float, shape (n,)
    """
    column = piece[name]
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        trimmed = pc.utf8_trim_whitespace(column)
        missing = pc.is_in(trimmed, value_set=pa.array(MISSING, trimmed.type))
        column = pc.if_else(missing, pa.scalar(None, trimmed.type), trimmed)
    if pa.types.is_timestamp(column.type):
        column = _seconds(column)
    try:
        read = pc.cast(column, pa.float64())
    except pa.ArrowInvalid:
        read = pa.chunked_array([_one_by_one(column, name, rows, errors)])
    values: Floats = read.to_numpy().astype(np.float64)
    for row in np.flatnonzero(np.isinf(values)):
        message = f"{name} is infinite; allowed: a finite number, or nothing"
        errors.note("an infinite number", rows.place(int(row)), message)
    return values


def _one_by_one(
    column: pa.ChunkedArray, name: str, rows: RowsOf, errors: RowErrors
) -> pa.Array:
    values = list[float | None]()
    for row, text in enumerate(column.to_pylist()):
        try:
            values.append(None if text is None else float(text))
        except ValueError:
            values.append(None)
            comma = isinstance(text, str) and "," in text
            hint = "; write a decimal point, not a comma" if comma else ""
            message = f'{name} is "{shortened(str(text))}", which is no number{hint}'
            errors.note("text in place of a number", rows.place(row), message)
    return pa.array(values, pa.float64())


def times(piece: pa.Table, name: str, rows: RowsOf, errors: RowErrors) -> Floats:
    """Return a column of times in seconds; dates with a time of day are allowed.

    Parameters
    ----------
    piece, name, rows, errors
        As in `numbers`.
    """
    column = piece[name]
    if pa.types.is_string(column.type):
        trimmed = pc.utf8_trim_whitespace(column)
        for kind in (pa.timestamp("us"), pa.timestamp("us", "UTC")):
            with suppress(pa.ArrowInvalid):  # numbers, or a mistake of `numbers`
                piece = pa.table({name: pc.cast(trimmed, kind)})
                break
    return numbers(piece, name, rows, errors)


def _seconds(column: pa.ChunkedArray) -> pa.ChunkedArray:
    """Return times of a clock as seconds since 1970."""
    micro = pc.cast(pc.cast(column, pa.timestamp("us"), safe=False), pa.int64())
    return pc.divide(pc.cast(micro, pa.float64()), 1e6)


def projected(
    longitude: Floats, latitude: Floats, centre: tuple[float, float]
) -> tuple[Floats, Floats]:
    """Return positions in m, east and north of a centre; NaN stays NaN.

    The projection is azimuthal and equidistant: distances from the centre are exact.

    Parameters
    ----------
    longitude, latitude : array of float
        Degrees, WGS 84.
    centre : tuple of float
        Longitude and latitude.
    """
    from pyproj import Transformer  # an extra

    longitude_0, latitude_0 = centre
    plane = f"+proj=aeqd +lon_0={longitude_0!r} +lat_0={latitude_0!r} +datum=WGS84"
    transformer = Transformer.from_crs("EPSG:4326", plane, always_xy=True)
    x, y = transformer.transform(longitude, latitude)
    present = np.isfinite(longitude) & np.isfinite(latitude)
    return np.where(present, x, np.nan), np.where(present, y, np.nan)


def texts(column: pa.ChunkedArray) -> pa.Array:
    """Return a column of names as text, without spaces at the ends."""
    as_text = pc.cast(column, pa.string()).combine_chunks()
    return pc.utf8_trim_whitespace(as_text)
