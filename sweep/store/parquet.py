"""Reading and writing of parquet files in the store.

The files have checksums, and errors report damage.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, TypeVar

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from sweep.errors import TooLargeError, UnreachableError, UnreadableError
from sweep.store.bounds import excess_bytes, excess_rows
from sweep.store.locations import GONE, Location, patiently
from sweep.store.regular import regular_size

T = TypeVar("T")

REQUESTS_AT_ONCE = 16


def remedy_for(part: Location) -> str:
    """Return how to fix a part that cannot be read."""
    if isinstance(part, Path) and not part.exists():
        return (
            "the part has been removed: launch the study again to run its trials again"
        )
    if isinstance(part, Path):
        return (
            f"launch the study again, to set {part.name} aside below damaged and to"
            " run its trials again"
        )
    return (
        f"delete {part}/manifest.json and launch the study again,"
        " to run its trials again"
    )


@contextmanager
def opened(path: Location, remedy: str | None = None) -> Iterator[Any]:
    """Open a parquet file for reading.

    Raises UnreadableError with `remedy`, the fix, if the file cannot be read, and
    TooLargeError if the memory of this machine cannot hold the file.
    """
    local = isinstance(path, Path)
    try:
        # Arrow opens a local file itself: a thread of its pool that lets go of an
        # object of Python's while the interpreter ends aborts the process.
        size = regular_size(path) if isinstance(path, Path) else path.stat().st_size
        source = path if isinstance(path, Path) else path.open()
        with pq.ParquetFile(
            source, page_checksum_verification=True, pre_buffer=not local
        ) as file:
            if why := excess_rows(path.name, file.metadata, size):
                raise OSError(why)
            if why := excess_bytes(file.metadata):
                raise TooLargeError(f"{path}: {why}; use a machine with more memory")
            yield file
    except (pa.ArrowException, OSError) as error:
        if (
            not isinstance(path, Path)
            and "AWS Error" in str(error)
            and not GONE.search(str(error))
        ):
            raise path.server.trouble(path, OSError(str(error))) from error
        raise UnreadableError(
            path, f"cannot be read ({error})", remedy or remedy_for(path.parent)
        ) from error


def each(parts: Sequence[Location], read: Callable[[Location], T]) -> list[T]:
    """Return the result of `read` for each part, in their order.

    In an object store several calls run at once, because each call makes a request or
    two. After an outage of the store, only the parts that failed are read again.
    """
    if len(parts) < 2 or isinstance(parts[0], Path):
        return [read(part) for part in parts]
    results = dict[Location, T]()

    def attempt(part: Location) -> UnreachableError | None:
        try:
            results[part] = read(part)
        except UnreachableError as error:
            return error
        return None

    def read_the_rest() -> None:
        rest = [part for part in parts if part not in results]
        with ThreadPoolExecutor(REQUESTS_AT_ONCE) as threads:
            errors = [error for error in threads.map(attempt, rest) if error]
        if errors:
            raise errors[0]

    patiently(read_the_rest)
    return [results[part] for part in parts]


def check_part(tables: Mapping[str, pa.Table]) -> None:
    """Raise ValueError for tables that are not a valid part: see `Store.append`."""
    for name, table in tables.items():
        if (
            "trial_id" not in table.column_names
            or table.schema.field("trial_id").type != pa.string()
        ):
            raise ValueError(f"a part's {name} need a `trial_id` column of strings")
    if "trials" not in tables or tables["trials"].num_rows == 0:
        raise ValueError("a part needs a `trials` table with at least one row")
    ids = tables["trials"]["trial_id"]
    if pc.count_distinct(ids).as_py() != len(ids):
        raise ValueError("a part cannot hold the same trial_id twice")
    for name, table in tables.items():
        if not pc.all(pc.is_in(table["trial_id"], value_set=ids), min_count=0).as_py():
            raise ValueError(
                f"a part cannot hold {name} of trials that are not in its `trials`"
            )


def load_table(part: Location, name: str, columns: list[str] | None = None) -> pa.Table:
    """Return a table of a part, or some columns of the table.

    Parameters
    ----------
    part : Location
    name : str
        Name of the table.
    columns : list of str, optional
        By default all columns.

    Raises
    ------
    StoreError
        If the file is damaged.
    """
    with opened(part / f"{name}.parquet") as file:
        return file.read(columns=columns)


def pieces(part: Location, name: str) -> Iterator[pa.Table]:
    """Yield the row groups of a table of a part, in the order of writing.

    Raises StoreError for a damaged file.
    """
    with opened(part / f"{name}.parquet") as file:
        for group in range(file.num_row_groups):
            yield file.read_row_group(group)


def stored_schema(path: Location) -> pa.Schema:
    """Return the schema of a file.

    Raises StoreError for a damaged file.
    """
    with opened(path) as file:
        return file.schema_arrow


def table_writer(file: BinaryIO, schema: pa.Schema) -> pq.ParquetWriter:
    """Return a writer of tables into a file.

    The writer stores strings as dictionaries and splits floats by byte. This encoding
    makes trajectories smaller than a dictionary does.
    """
    return pq.ParquetWriter(
        file,
        schema,
        compression="zstd",
        use_dictionary=[
            name for field in schema for name in _leaves(field, pa.types.is_string)
        ],
        use_byte_stream_split=[
            name for field in schema for name in _leaves(field, pa.types.is_floating)
        ],
        use_compliant_nested_type=False,
        write_page_checksum=True,
    )


def _leaves(field: pa.Field, matches: Callable[[pa.DataType], bool]) -> list[str]:
    """Return the parquet path of a column whose values, or list elements, match.

    The list is empty if the type does not match.
    """
    kind = field.type
    path = field.name
    if isinstance(kind, pa.BaseExtensionType):
        kind = kind.storage_type
    while pa.types.is_list(kind) or pa.types.is_fixed_size_list(kind):
        path = f"{path}.list.{kind.value_field.name}"
        kind = kind.value_type
    return [path] if matches(kind) else []
