"""Files of tracks: CSV, parquet, netCDF of movement, arrays of TRex, wide files.

A file gives its rows piece by piece, so that a file may exceed the memory. A new format
is a class here, and an entry of FORMATS.
"""

import csv
import hashlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv
import pyarrow.parquet as pq

from sweep.recordings.row_errors import RowErrors
from sweep.spec import ANY
from sweep.text import installing

UNREADABLE = (
    *(OSError, ValueError, TypeError, KeyError, EOFError),
    *(NotImplementedError, OverflowError, BadZipFile),
)
"""Errors of a file that is damaged, or has content of another kind."""
BLOCK_BYTES = 8 * 2**20
"""Bytes of a CSV file that are read at once."""
BLOCK_ROWS = 100_000
"""Rows of other files that are read at once."""


@dataclass(frozen=True)
class TrackFile(ABC):
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

    def place(self, row: int) -> str:
        """Return the file and the number of a row, in words; rows count from 0."""
        return f"{self.name}, row {row + 1}"

    def sha(self) -> str:
        """Return the sha256 of the content."""
        with self.path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()

    @abstractmethod
    def columns(self) -> list[str]:
        """Return the names of the columns. Raises ValueError for an unreadable file."""

    def pieces(self, columns: Sequence[str], errors: RowErrors) -> Iterator[pa.Table]:
        """Yield the rows, in pieces; all values of a CSV file are texts.

        Notes an error in the file.

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
        try:
            yield from self._pieces(columns, errors)
        except UNREADABLE as error:
            message = f"cannot be read: {type(error).__name__}: {error}"
            errors.note("an unreadable file", self.name, message)

    @abstractmethod
    def _pieces(self, columns: Sequence[str], errors: RowErrors) -> Iterator[pa.Table]:
        """Yield what `pieces` returns."""


class CsvFile(TrackFile):
    """Text with a header, which is line 1."""

    def place(self, row: int) -> str:
        """Return the file and the line of a row, in words; rows count from 0."""
        return f"{self.name}, line {row + 2}"

    def columns(self) -> list[str]:
        """Return the names in the header."""
        with self.path.open(encoding="utf-8-sig", newline="") as file:
            try:
                return next(csv.reader(file, delimiter=self.delimiter), [])
            except csv.Error as error:
                raise ValueError(str(error)) from None

    def _pieces(self, columns: Sequence[str], errors: RowErrors) -> Iterator[pa.Table]:
        """Yield the rows as texts. Notes rows with a wrong number of values."""

        def skip(row: Any) -> str:
            message = (
                f"{row.actual_columns} values; the header has {row.expected_columns}"
            )
            number = 1 if row.number is None else row.number - 2
            errors.note("a wrong number of values", self.place(number), message)
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


class ParquetFile(TrackFile):
    """Columns with types."""

    def columns(self) -> list[str]:
        """Return the names of the columns."""
        return list(pq.read_schema(self.path).names)

    def _pieces(self, columns: Sequence[str], _errors: RowErrors) -> Iterator[pa.Table]:
        """Yield the rows."""
        file = pq.ParquetFile(self.path)
        for batch in file.iter_batches(BLOCK_ROWS, columns=[*columns]):
            yield pa.Table.from_batches([batch])


class MovementFile(TrackFile):
    """A netCDF file of the package movement.

    The variable `position` has the dimensions `time`, `space` and `individuals`, and
    may have `keypoints`, of which the mean counts. The columns are `id`, `t`, `x` and
    `y`.
    """

    def columns(self) -> list[str]:
        """Return the names that trackdf gives the columns."""
        if not (find_spec("xarray") and find_spec("netCDF4")):
            extra = installing("netcdf")
            raise ValueError(f"netCDF needs xarray and netCDF4; {extra} installs both")
        with self._dataset() as dataset:
            if lacking := {"time", "space", "individuals"} - {
                *dataset["position"].dims
            }:
                message = f"the variable position lacks the dimension {min(lacking)}"
                raise ValueError(message)
        return ["id", "t", "x", "y"]

    def _pieces(self, columns: Sequence[str], _errors: RowErrors) -> Iterator[pa.Table]:
        """Yield the individuals at some times, time after time."""
        with self._dataset() as dataset:
            position = dataset["position"]
            names = [str(name) for name in position["individuals"].values]
            times = position["time"].values
            size = max(1, BLOCK_ROWS // max(1, len(names)))
            for first in range(0, len(times), size):
                part = position.isel(time=slice(first, first + size))
                if "keypoints" in part.dims:
                    part = part.mean("keypoints", skipna=False)
                values = part.transpose("space", "time", "individuals").sel(
                    space=["x", "y"]
                )
                x, y = values.to_numpy().reshape(2, -1)
                some = times[first : first + size]
                table = {
                    "id": pa.array(names * len(some)),
                    "t": pa.array(np.repeat(some, len(names))),
                    "x": pa.array(x),
                    "y": pa.array(y),
                }
                yield pa.table(table).select([*columns])

    def _dataset(self) -> Any:
        import xarray as xr

        try:
            dataset = xr.open_dataset(self.path)
        except OSError as error:
            raise ValueError(str(error)) from None
        if "position" not in dataset:
            dataset.close()
            raise ValueError("the file has no variable position")
        return dataset


class ArraysFile(TrackFile):
    """An .npz file with an array per column, as TRex writes one per individual.

    An infinite value is a missing value.
    """

    def columns(self) -> list[str]:
        """Return the names of the arrays that have the most frequent length."""
        return [*self._arrays()]

    def _pieces(self, columns: Sequence[str], _errors: RowErrors) -> Iterator[pa.Table]:
        """Yield the rows."""
        arrays = self._arrays()
        length = len(arrays[columns[0]]) if columns else 0
        for first in range(0, length, BLOCK_ROWS):
            part = {}
            for name in columns:
                values = arrays[name][first : first + BLOCK_ROWS]
                if values.dtype.kind == "f":
                    values = np.where(np.isinf(values), np.nan, values)
                part[name] = pa.array(values)
            yield pa.table(part)

    def _arrays(self) -> Mapping[str, Any]:
        """Return the arrays of numbers or names. No pickled object is read."""
        # numpy does not close a path that it cannot read.
        with (
            self.path.open("rb") as opened,
            np.load(opened, allow_pickle=False) as file,
        ):
            arrays = {}
            for name in file.files:
                array = file[name]
                if array.ndim == 1 and array.dtype.kind in "fiuU":
                    arrays[name] = array
        lengths = [len(array) for array in arrays.values()]
        usual = max(set(lengths), key=lengths.count, default=0)
        return {name: array for name, array in arrays.items() if len(array) == usual}


@dataclass(frozen=True)
class WideFile(TrackFile):
    """A file with a row per time, and columns for each individual.

    The file is read as one with a row per individual and time. A name with ANY is then
    the name of a column, and the column ANY has the texts in place of ANY.

    Attributes
    ----------
    file : TrackFile
        The file with a row per time.
    patterns : tuple of str
        Names of columns with ANY, of which the first names the individuals.
    """

    file: TrackFile
    patterns: tuple[str, ...]

    def place(self, row: int) -> str:
        """Return the file, the row of a time and the individual, in words."""
        individuals = self._individuals()
        time, number = divmod(row, len(individuals))
        return f"{self.file.place(time)}, individual {individuals[number]}"

    def columns(self) -> list[str]:
        """Return the names of the columns of times, of the individuals and patterns."""
        present = self.file.columns()
        individuals = self._individuals()
        if not individuals:
            raise ValueError(f'no column has a name such as "{self.patterns[0]}"')
        own = [
            pattern.replace(ANY, name)
            for pattern in self.patterns
            for name in individuals
        ]
        for name in own:
            if name not in present:
                reason = f'"{self.patterns[0]}" needs the column "{name}"'
                raise ValueError(f"{reason}, which the file does not have")
            if own.count(name) > 1:
                raise ValueError(f'"{name}" is the column of two individuals')
        untouched = [name for name in present if name not in own]
        return [*untouched, ANY, *self.patterns]

    def _individuals(self) -> list[str]:
        begin, _, end = self.patterns[0].partition(ANY)
        length = len(begin) + len(end)
        return [
            name[len(begin) : len(name) - len(end)]
            for name in self.file.columns()
            if name.startswith(begin) and name.endswith(end) and len(name) > length
        ]

    def _pieces(self, columns: Sequence[str], errors: RowErrors) -> Iterator[pa.Table]:
        """Yield the individuals at some times, time after time."""
        individuals = self._individuals()
        patterns = [name for name in columns if name in self.patterns]
        untouched = [name for name in columns if name not in (ANY, *self.patterns)]
        read = patterns or self.patterns[:1]
        own = {
            pattern: [pattern.replace(ANY, name) for name in individuals]
            for pattern in read
        }
        names = [*untouched, *(name for group in own.values() for name in group)]
        for piece in self.file.pieces(names, errors):
            times = piece.num_rows
            count = len(individuals)
            # Row k has the individual k % count at the time k // count.
            turned = np.arange(times * count).reshape(count, times).T.ravel()
            table = {ANY: pa.array(individuals * times, pa.string())}
            for name in untouched:
                table[name] = piece[name].take(np.repeat(np.arange(times), count))
            for pattern, group in own.items():
                columns_of = [piece[name] for name in group]
                if len({column.type for column in columns_of}) > 1:
                    columns_of = [pc.cast(each, pa.float64()) for each in columns_of]
                chunks = [chunk for column in columns_of for chunk in column.chunks]
                column = pa.chunked_array(chunks, columns_of[0].type)
                table[pattern] = column.take(turned)
            yield pa.table(table).select([*columns])


FORMATS: Mapping[str, type[TrackFile]] = {
    ".csv": CsvFile,
    ".parquet": ParquetFile,
    ".nc": MovementFile,
    ".npz": ArraysFile,
}
"""Formats by the ending of a file."""
