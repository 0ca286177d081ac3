"""Sizes of unpacked parquet files, from the headers of pages.

The footer of a file may claim less than the pages contain. A page unpacks to at most
the size in the header of the page, so the sizes in headers are reliable. Format:
https://github.com/apache/parquet-format, headers in Thrift's compact protocol.
"""

import struct
from collections.abc import Collection
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

MOST_FOOTER = 10_000_000
"""Bytes. A byte of the footer may need a few hundred bytes of memory after reading."""
MOST_HEAD = 100_000
"""Bytes of the header of a page, whose statistics may contain two long strings."""
MOST_PAGES = 1_000_000
MAGIC = b"PAR1"
DELTA_BYTE_ARRAY = 7
"""Encoding that stores the difference of each string from the string before.

A few bytes then unpack to any number of long strings.
"""

Head = dict[int, Any]
"""Values of a Thrift struct by the numbers of the fields."""


class PagesError(ValueError):
    """A parquet file that is not unpacked, with the reason."""


class Unpacked(NamedTuple):
    """The size of unpacked pages in bytes, and the number of values."""

    size: int
    values: int


def check_footer(path: Path) -> None:
    """Raise PagesError for a file without a footer, or with too large a footer."""
    with path.open("rb") as stream:
        stream.seek(-min(8, path.stat().st_size), 2)
        end = stream.read(8)
    if len(end) < 8 or end[4:] != MAGIC:
        raise PagesError("is not a parquet file, or the end of the file is missing")
    if struct.unpack("<I", end[:4])[0] > MOST_FOOTER:
        raise PagesError(f"has a footer of more than {MOST_FOOTER:,} bytes")


def unpacked(path: Path, metadata: Any, columns: Collection[str]) -> Unpacked:
    """Return the size of some columns of a file after unpacking, without unpacking.

    Parameters
    ----------
    path : Path
    metadata : FileMetaData
        Metadata of the file, read by pyarrow.
    columns : collection of str

    Returns
    -------
    Unpacked

    Raises
    ------
    PagesError
        If pages violate the format, are too many, or contain strings as deltas.
    OSError
        If the file cannot be read.
    """
    size = values = pages = 0
    with path.open("rb") as stream:
        for group in map(metadata.row_group, range(metadata.num_row_groups)):
            for chunk in map(group.column, range(group.num_columns)):
                if chunk.path_in_schema.split(".")[0] not in columns:
                    continue
                first, last = _extent(chunk)
                while first < last:
                    head, first = _page(stream, first)
                    size += head[2]
                    values += _values(head)
                    pages += 1
                    if pages > MOST_PAGES:
                        raise PagesError(f"has more than {MOST_PAGES:,} pages")
    return Unpacked(size, values)


def _extent(chunk: Any) -> tuple[int, int]:
    """Return the first and last byte of the pages of a column, as pyarrow does."""
    first = chunk.data_page_offset
    if chunk.has_dictionary_page and 0 < chunk.dictionary_page_offset < first:
        first = chunk.dictionary_page_offset
    return first, first + chunk.total_compressed_size


def _page(stream: BinaryIO, first: int) -> tuple[Head, int]:
    """Return the header of the page at `first`, and the position of the next page."""
    stream.seek(first)
    reader = _ThriftReader(stream.read(MOST_HEAD))
    try:
        head = reader.struct()
        sizes = head[2], head[3]
    except (IndexError, KeyError, RecursionError):
        raise PagesError("has a page without a readable header") from None
    if not all(isinstance(size, int) and size >= 0 for size in sizes):
        raise PagesError("has a page of a negative size")
    return head, first + reader.place + head[3]


def _values(head: Head) -> int:
    """Return the number of values of a data page (two formats) or a dictionary page."""
    count = 0
    for kind, encoding in ((5, 2), (7, 2), (8, 4)):
        description = head.get(kind)
        if isinstance(description, dict):
            if description.get(encoding) in (DELTA_BYTE_ARRAY, None):
                raise PagesError("has strings as deltas, which may grow without bound")
            count += abs(int(description.get(1) or 0))
    return count


class _ThriftReader:
    """A reader of a struct in Thrift's compact protocol.

    Raises IndexError for bytes that are not such a struct.
    """

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.place = 0

    def struct(self) -> Head:
        """Return the struct that begins here."""
        values = Head()
        field = 0
        while (byte := self._byte()) & 15:
            field = field + (byte >> 4) if byte >> 4 else self._signed()
            if field in values:
                raise IndexError
            values[field] = self._value(byte & 15)
        return values

    def _value(self, kind: int) -> Any:
        if kind in (1, 2):  # true and false are kinds without a value
            return kind == 1
        if kind == 3:
            return self._byte()
        if kind == 5:  # 32 bits, as all numbers that are used here
            return self._signed()
        if kind in (4, 6):
            self._signed()
        elif kind == 7:
            self.place += 8
        elif kind == 8:
            length = self._unsigned()
            self.place += length
        elif kind == 12:
            return self.struct()
        else:
            # A header of a page contains no lists and no maps.
            raise IndexError
        return None

    def _byte(self) -> int:
        self.place += 1
        return self.content[self.place - 1]

    def _unsigned(self) -> int:
        value = shift = 0
        while (byte := self._byte()) & 128:
            value |= (byte & 127) << shift
            shift += 7
        return value | byte << shift

    def _signed(self) -> int:
        value = self._unsigned()
        return value >> 1 ^ -(value & 1)
