"""Rows of CSV and parquet files, piece by piece, so that a file may exceed the memory.

All columns of a CSV file are read as text first, so that a mistake has a row.
"""

import csv
import hashlib
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet as pq
from numpy.typing import NDArray

from sweep.recordings.row_errors import RowErrors
from sweep.spec import Delimiter, Entry, RecordingSpec
from sweep.text import shortened, unknown

CSV = ".csv"
PARQUET = ".parquet"
MISSING = ("", "NA", "NaN", "nan", "null", "None")
"""Texts of a missing value."""
BLOCK_BYTES = 8 * 2**20
"""Bytes of a CSV file that are read at once."""
BLOCK_ROWS = 100_000
"""Rows of a parquet file that are read at once."""
DELIMITERS: dict[Delimiter, str] = {"comma": ",", "semicolon": ";", "tab": "\t"}
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class TrackFile:
    """A file of a recording.

    Attributes
    ----------
    path : Path
    name : str
        Path from the folder of the spec, for messages.
    delimiter : str
        Delimiter of a CSV file.
    """

    path: Path
    name: str
    delimiter: str

    @property
    def is_csv(self) -> bool:
        """True for a CSV file, False for a parquet file."""
        return self.path.suffix == CSV

    def place(self, row: int) -> str:
        """Return the file and the number of a row, in words; rows count from 0."""
        if self.is_csv:
            return f"{self.name}, line {row + 2}"
        return f"{self.name}, row {row + 1}"

    def sha(self) -> str:
        """Return the sha256 of the content."""
        with self.path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    def columns(self) -> list[str]:
        """Return the names of the columns. Raises ValueError for an unreadable file."""
        if not self.is_csv:
            return list(pq.read_schema(self.path).names)
        with self.path.open(encoding="utf-8-sig", newline="") as file:
            return next(csv.reader(file, delimiter=self.delimiter), [])

    def pieces(self, columns: Sequence[str], errors: RowErrors) -> Iterator[pa.Table]:
        """Yield the rows, in pieces; all values of a CSV file are texts.

        Parameters
        ----------
        columns : sequence of str
            Columns of the pieces.
        errors : RowErrors
            Receives rows of a CSV file with a wrong number of values.

        Yields
        ------
        pyarrow.Table
        """
        if not self.is_csv:
            file = pq.ParquetFile(self.path)
            for batch in file.iter_batches(BLOCK_ROWS, columns=[*columns]):
                yield pa.Table.from_batches([batch])
            return

        def skip(row: Any) -> str:
            words = (
                f"{row.actual_columns} values; the header has {row.expected_columns}"
            )
            number = 1 if row.number is None else row.number - 2
            errors.note("a wrong number of values", self.place(number), words)
            return "skip"

        reader = pyarrow.csv.open_csv(
            self.path,
            read_options=pyarrow.csv.ReadOptions(
                use_threads=False, block_size=BLOCK_BYTES
            ),
            parse_options=pyarrow.csv.ParseOptions(
                delimiter=self.delimiter, invalid_row_handler=skip
            ),
            convert_options=pyarrow.csv.ConvertOptions(
                include_columns=[*columns],
                column_types=dict.fromkeys(columns, pa.string()),
                strings_can_be_null=False,
            ),
        )
        for batch in reader:
            yield pa.Table.from_batches([batch])


def track_files(entry: Entry, spec: RecordingSpec) -> list[TrackFile]:
    """Return the files of a recording, in the order of their names.

    Raises SpecError for a pattern without files, and for a file of another format.
    """
    folder = entry.document.path.parent
    delimiter = DELIMITERS[spec.delimiter]
    names = dict[Path, str]()
    for index, pattern in enumerate(spec.files):
        item = entry.child("files").child(index)
        # Path.glob takes no absolute pattern.
        every = sorted(glob(str(folder / pattern), recursive=True))  # noqa: PTH207
        matches = [Path(path) for path in every if Path(path).is_file()]
        if not matches:
            raise item.error(f'no file matches "{shortened(pattern)}" in {folder}')
        for path in matches:
            if path.suffix not in (CSV, PARQUET):
                words = f'"{path.name}" ends with "{path.suffix}"'
                raise item.error(f"{words}; allowed: {CSV} and {PARQUET}")
            is_absolute = Path(pattern).is_absolute()
            name = path if is_absolute else Path(os.path.relpath(path, folder))
            names[path] = name.as_posix()
    return [TrackFile(path, name, delimiter) for path, name in names.items()]


def check_columns(entry: Entry, file: TrackFile, columns: Sequence[str]) -> None:
    """Raise SpecError unless a file has all columns, each once.

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
    except (OSError, ValueError, csv.Error) as error:
        raise entry.error(f"{file.name} cannot be read: {error}") from None
    for column in columns:
        if column not in present:
            words = unknown("column", column, present)
            hint = _other_delimiter(present, file)
            raise entry.error(f"{file.name}: {words}{hint}")
        if present.count(column) > 1:
            raise entry.error(f'{file.name} has several columns "{column}"')


def _other_delimiter(present: Sequence[str], file: TrackFile) -> str:
    """Return a hint if the only column of a CSV file contains another delimiter."""
    if len(present) != 1 or not file.is_csv:
        return ""
    for name, delimiter in DELIMITERS.items():
        if delimiter in present[0]:
            return f"; is the delimiter a {name}? Then write `delimiter: {name}`"
    return ""


def numbers(
    piece: pa.Table, name: str, file: TrackFile, first: int, *, errors: RowErrors
) -> Floats:
    """Return a column as numbers, NaN for missing values.

    Parameters
    ----------
    piece : pyarrow.Table
        n rows.
    name : str
        Name of the column.
    file : TrackFile
        File of the column.
    first : int
        Number of the first of the rows in the file, from 0.
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
    try:
        read = pc.cast(column, pa.float64())
    except pa.ArrowInvalid:
        read = pa.chunked_array([_one_by_one(column, name, file, first, errors=errors)])
    values: Floats = read.to_numpy().astype(np.float64)
    for row in np.flatnonzero(np.isinf(values)):
        words = f"{name} is infinite; allowed: a finite number, or nothing"
        errors.note("an infinite number", file.place(first + int(row)), words)
    return values


def _one_by_one(
    column: pa.ChunkedArray,
    name: str,
    file: TrackFile,
    first: int,
    *,
    errors: RowErrors,
) -> pa.Array:
    values = list[float | None]()
    for row, text in enumerate(column.to_pylist(), first):
        try:
            values.append(None if text is None else float(text))
        except ValueError:
            values.append(None)
            comma = isinstance(text, str) and "," in text
            hint = "; write a decimal point, not a comma" if comma else ""
            words = f'{name} is "{shortened(str(text))}", which is no number{hint}'
            errors.note("text in place of a number", file.place(row), words)
    return pa.array(values, pa.float64())


def texts(column: pa.ChunkedArray) -> pa.Array:
    """Return a column of names as text, without spaces at the ends."""
    as_text = pc.cast(column, pa.string()).combine_chunks()
    return pc.utf8_trim_whitespace(as_text)
