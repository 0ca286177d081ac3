"""Points read from a table, CSV or parquet."""

from pathlib import Path
from typing import Any

from sweep.document import Entry
from sweep.fields import Column, Field, NotAllowedError
from sweep.names import unknown

MOST_BYTES = 1_000_000_000


def read_table(axis: Entry, fields: dict[str, Field], folder: Path) -> dict[str, Column]:
    """The columns that a `sample: table` axis names, by field. A path is relative to `folder`.

    Raises SpecError where there is no such file or column, and where a cell is empty or not allowed.
    """
    file = axis.child("file")
    table = _open(file, folder / file.text())
    columns = {}
    for field, column, entry in _wanted(axis, list(table.column_names)):
        if field not in fields:
            raise entry.error(unknown("field", field, fields))
        if column not in table.column_names:
            raise entry.error(unknown(f"column of {file.value}", column, table.column_names))
        if field in columns:
            raise entry.error(f'"{field}" is read from two columns')
        columns[field] = _column(file, fields[field], column, table.column(column).to_pylist())
    return columns


def _wanted(axis: Entry, names: list[str]) -> list[tuple[str, str, Entry]]:
    """Field, column and where it is said, of every column to read: those listed or mapped, else all."""
    columns = axis.get("columns")
    if columns is None:
        return [(name, name, axis.child("file")) for name in names]
    if isinstance(columns.value, list):
        return [(entry.text(), entry.text(), entry) for entry in columns.entries()]
    return [(field, entry.text(), entry) for field, entry in columns.mapping()]


def _open(file: Entry, path: Path) -> Any:
    """The pyarrow table in the file."""
    import pyarrow as pa
    from pyarrow import csv, parquet

    readers = {".csv": csv.read_csv, ".parquet": parquet.read_table}
    if path.suffix not in readers:
        raise file.error(f'"{file.value}" is neither a .csv nor a .parquet file')
    try:
        if path.stat().st_size > MOST_BYTES:
            raise file.error(f'"{file.value}" is larger than {MOST_BYTES:,} bytes')
        with path.open("rb") as stream:
            table = readers[path.suffix](stream)
    except FileNotFoundError:
        raise file.error(f'there is no file "{file.value}" in {path.parent}') from None
    except (OSError, pa.ArrowException) as error:
        raise file.error(f'"{file.value}" cannot be read: {str(error).splitlines()[0]}') from None
    if len(table) == 0:
        raise file.error(f'"{file.value}" has no rows')
    return table


def _column(file: Entry, field: Field, column: str, values: list[Any]) -> Column:
    if None in values:
        raise file.error(f'"{file.value}" has an empty cell: column "{column}", row {values.index(None) + 1}')
    try:
        return field.column(values)
    except NotAllowedError as error:
        place = f'"{file.value}", column "{column}", row {error.index + 1}'
        raise file.error(f"{place}: {error}") from None
