"""Limits on the unpacked size of a stored table.

The limits are checked by the footer of the file, before memory is allocated. A parquet
file of one megabyte can hold billions of equal rows.

Plans, and the trials of a part, have an id in each row: 24 hexadecimal digits of a
hash. No compression reduces an id below 12 bytes. So the size of the file bounds the
number of rows, whatever the size of the study.

Series, heatmaps and trajectories of quiet swarms compress well, so small files may have
many rows. The memory of this machine is their limit.
"""

from typing import Any

from sweep.spec import ASKED, PLAN

ROW_BYTES = {PLAN: 8, "trials.parquet": 8, ASKED: 1}
"""Least bytes of a row in files with ids.

In the last file a trial may have several rows. A trial may also have several entries in
lists of a plan, where a value takes a byte or more.
"""
FREE_ROWS = 100_000
"""Number of rows that a file of any size may have."""
CELL_BYTES = 8


def excess_rows(name: str, metadata: Any, size: int) -> str:
    """Return why no launch can have stored a table, in a few words; empty if one can.

    Parameters
    ----------
    name : str
        Name of the file.
    metadata : FileMetaData
        Metadata of the footer of the file.
    size : int
        Bytes of the file.
    """
    rows = _rows(metadata)
    if name in ROW_BYTES and rows > FREE_ROWS + size // ROW_BYTES[name]:
        return f"{rows:,} rows with an id each cannot fit in {size:,} bytes"
    if name in ROW_BYTES and (values := _values(metadata)) > FREE_ROWS + size:
        return f"{values:,} values of lists cannot fit in {size:,} bytes"
    return ""


def excess_bytes(metadata: Any) -> str:
    """Return why this machine cannot hold a table, in a few words; empty if it can."""
    packed = sum(group.total_byte_size for group in _groups(metadata))
    unpacked = max(packed, CELL_BYTES * _rows(metadata) * metadata.num_columns)
    room = _memory()
    if unpacked > room:
        return f"unpacks to {unpacked:,} bytes; this machine has {room:,} bytes"
    return ""


def _groups(metadata: Any) -> list[Any]:
    return [metadata.row_group(index) for index in range(metadata.num_row_groups)]


def _rows(metadata: Any) -> int:
    return max(
        int(metadata.num_rows), sum(int(group.num_rows) for group in _groups(metadata))
    )


def _values(metadata: Any) -> int:
    """Return the largest number of values in a column: with lists, more than rows."""
    groups = _groups(metadata)
    return max(
        (
            sum(int(group.column(index).num_values) for group in groups)
            for index in range(metadata.num_columns)
        ),
        default=0,
    )


def _memory() -> int:
    """Return the bytes of memory of this machine."""
    import psutil

    return int(psutil.virtual_memory().total)
