"""Points read from a table, CSV or parquet.

Files may be untrusted. A small parquet file can contain a huge table, and a line of
commas a million columns. The sizes are therefore checked before any value is read.
"""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from sweep.spec.document import Entry
from sweep.spec.limits import MOST_POINTS, check_cells
from sweep.spec.parquet_sizes import PagesError, check_footer, unpacked
from sweep.spec.settings import NotAllowedError, Setting, Values
from sweep.text import unknown

TABLE = "table"
"""Value of `sample` for an axis that is read from a table."""
MOST_BYTES = 1_000_000_000
MOST_COLUMNS = 10_000
MOST_HEAD = 1_000_000
"""Bytes of the line that names the columns of a CSV file."""
MOST_TEXT = 1000
"""Characters of a cell."""
BLOCK = 2**20

T = TypeVar("T")
Reader = Callable[[list[str]], Any]
"""Reads some columns of a table."""


def read_table(
    axis: Entry, settings: dict[str, Setting], folder: Path
) -> dict[str, Values]:
    """Return the columns that a `sample: table` axis selects.

    Parameters
    ----------
    axis : Entry
    settings : dict
        Parameters of the study by name.
    folder : Path
        The path of the file is relative to this folder.

    Returns
    -------
    dict
        Values by parameter, (rows,) each.

    Raises
    ------
    SpecError
        If a file or column does not exist, or a cell is empty or not allowed.
    """
    file = axis.child("file")
    names, read = _open(file, folder / file.text())
    sources: dict[str, str] = {}
    for setting, column, entry in _selected_columns(axis, names):
        if setting not in settings:
            raise entry.error(unknown("parameter", setting, settings))
        if column not in names:
            raise entry.error(unknown(f"column of {file.value}", column, names))
        if setting in sources:
            raise entry.error(f'"{setting}" is read from two columns')
        sources[setting] = column
    table = _read(file, read, list(dict.fromkeys(sources.values())))
    return {
        setting: _column(file, settings[setting], column, table[column].to_pylist())
        for setting, column in sources.items()
    }


def _selected_columns(axis: Entry, names: list[str]) -> list[tuple[str, str, Entry]]:
    """Return the parameter, the column and the spec entry of each column to read.

    Without `columns` all columns are read.
    """
    columns = axis.get("columns")
    if columns is None:
        return [(name, name, axis.child("file")) for name in names]
    if isinstance(columns.value, list):
        return [(entry.text(), entry.text(), entry) for entry in columns.entries()]
    return [(setting, entry.text(), entry) for setting, entry in columns.mapping()]


def _open(file: Entry, path: Path) -> tuple[list[str], Reader]:
    """Return the names of the columns of the file, and a reader of columns."""
    openers = {".csv": _open_csv, ".parquet": _open_parquet}
    if path.suffix not in openers:
        raise file.error(f'"{file.value}" is neither a .csv nor a .parquet file')
    if not _legibly(file, path.is_file):
        raise file.error(f'there is no file "{file.value}" in {path.parent}')
    if path.stat().st_size > MOST_BYTES:
        raise file.error(f'"{file.value}" is larger than {MOST_BYTES:,} bytes')
    return _legibly(file, lambda: openers[path.suffix](file, path))


def _read(file: Entry, read: Reader, columns: list[str]) -> Any:
    table = _legibly(file, lambda: read(columns))
    if len(table) == 0:
        raise file.error(f'"{file.value}" has no rows')
    return table


def _legibly(file: Entry, look: Callable[[], T]) -> T:
    """Return the result of `look`. Raise SpecError for an unreadable file."""
    import pyarrow as pa

    try:
        return look()
    except PagesError as error:
        raise file.error(f'"{file.value}" {error}') from None
    except UnicodeDecodeError:
        raise file.error(f'"{file.value}" is not UTF-8 text') from None
    except (OSError, pa.ArrowException) as error:
        raise file.error(
            f'"{file.value}" cannot be read: {str(error).splitlines()[0]}'
        ) from None


def _open_csv(file: Entry, path: Path) -> tuple[list[str], Reader]:
    from pyarrow import csv

    with path.open("rb") as stream:
        head = stream.readline(MOST_HEAD + 1)
        if len(head) > MOST_HEAD or head.count(b",") >= MOST_COLUMNS:
            raise file.error(
                f'"{file.value}" has a first line that is too long; at most'
                f" {MOST_COLUMNS:,} columns are allowed"
            )
        lines = 0
        while block := stream.read(BLOCK):
            # Each of these two characters may end a line.
            lines += max(block.count(b"\n"), block.count(b"\r"))
        _check_rows(file, lines)
        stream.seek(0)
        names = csv.open_csv(stream).schema.names

    def read(columns: list[str]) -> Any:
        """Return the table of some columns. Raise SpecError if it is too large."""
        check_cells(file, lines, len(columns))
        # A table of cells of one character takes eight times the bytes of the file.
        options = csv.ConvertOptions(include_columns=columns)
        with path.open("rb") as stream:
            table = csv.read_csv(stream, convert_options=options)
        _check_rows(file, len(table))
        return table

    return names, read


def _open_parquet(file: Entry, path: Path) -> tuple[list[str], Reader]:
    from pyarrow import parquet

    # A short footer cannot list many columns. Without this limit a false number of
    # columns in the footer would take memory.
    limits = {"thrift_container_size_limit": 2 * MOST_COLUMNS}
    check_footer(path)
    with parquet.ParquetFile(path, **limits) as opened:
        metadata = opened.metadata
        schema = opened.schema_arrow
    if metadata.num_columns > MOST_COLUMNS:
        raise file.error(
            f'"{file.value}" has {metadata.num_columns:,} columns; at most'
            f" {MOST_COLUMNS:,} are allowed"
        )
    groups = [metadata.row_group(index) for index in range(metadata.num_row_groups)]
    rows = max(metadata.num_rows, sum(group.num_rows for group in groups))
    _check_rows(file, rows)

    def read(columns: list[str]) -> Any:
        """Return the table of some columns. Raise SpecError if it is too large."""
        check_cells(file, rows, len(columns))
        texts = _checked_columns(file, columns, schema)
        if unpacked(path, metadata, columns).size > MOST_BYTES:
            raise file.error(
                f'"{file.value}" unpacks to more than {MOST_BYTES:,} bytes'
            )
        # Equal strings are kept once: ten million copies of a long string would fill
        # the memory.
        with parquet.ParquetFile(path, read_dictionary=texts, **limits) as again:
            table = again.read(columns)
        _check_texts(file, table, texts)
        return table

    return list(schema.names), read


def _check_rows(file: Entry, rows: int) -> None:
    if rows > MOST_POINTS:
        raise file.error(
            f'"{file.value}" has {rows:,} rows; at most {MOST_POINTS:,} are allowed'
        )


def _checked_columns(file: Entry, columns: list[str], schema: Any) -> list[str]:
    """Return the columns of strings.

    Raises SpecError for a column of values that are not strings, numbers or booleans.
    """
    import pyarrow as pa

    texts = []
    for name in columns:
        kind = schema.field(name).type
        kind = kind.value_type if pa.types.is_dictionary(kind) else kind
        if pa.types.is_string(kind) or pa.types.is_large_string(kind):
            texts.append(name)
        elif not (
            pa.types.is_integer(kind)
            or pa.types.is_floating(kind)
            or pa.types.is_boolean(kind)
        ):
            raise file.error(
                f'"{file.value}", column "{name}" has the type {kind};'
                " allowed: numbers, strings, true and false"
            )
    return texts


def _check_texts(file: Entry, table: Any, texts: list[str]) -> None:
    import pyarrow.compute as pc

    for name in texts:
        for chunk in table[name].chunks:
            longest = pc.max(pc.binary_length(chunk.dictionary)).as_py() or 0
            if longest > MOST_TEXT:
                raise file.error(
                    f'"{file.value}", column "{name}" has a string of more than'
                    f" {MOST_TEXT:,} characters"
                )


def _column(file: Entry, setting: Setting, column: str, values: list[Any]) -> Values:
    if None in values:
        raise file.error(
            f'"{file.value}" has an empty cell: column "{column}", row'
            f" {values.index(None) + 1}"
        )
    try:
        return setting.column(values)
    except NotAllowedError as error:
        place = f'"{file.value}", column "{column}", row {error.index + 1}'
        raise file.error(f"{place}: {error}") from None
