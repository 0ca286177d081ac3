"""Limits of what a stored table may unpack to.

They are read from its footer before memory is taken. A parquet file of a megabyte can
hold billions of equal rows. Plans, and the trials of a part, have an id in each row, of
24 hexadecimal digits of a hash. No compression brings those below 12 bytes. So the size
of the file bounds the number of its rows, whatever the size of the study. Series,
heatmaps and trajectories of quiet swarms compress well, so their files may be small.
They are bounded by the memory of this machine, which could not hold more anyway.
"""

from typing import Any

from sweep.spec import ASKED, PLAN

ROW_BYTES = {PLAN: 8, "trials.parquet": 8, ASKED: 1}
"""Least bytes of a row in files with ids.

In the last of them one trial may have several rows. So it may in lists of a plan, where
a value takes a byte or more.
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
        return f"{rows:,} rows with an id each cannot lie in {size:,} bytes"
    if name in ROW_BYTES and (values := _values(metadata)) > FREE_ROWS + size:
        return f"{values:,} values of lists cannot lie in {size:,} bytes"
    return ""


def excess_bytes(metadata: Any) -> str:
    """Return why this machine cannot hold a table, in a few words; empty if it can."""
    packed = sum(group.total_byte_size for group in _groups(metadata))
    unpacked = max(packed, CELL_BYTES * _rows(metadata) * metadata.num_columns)
    room = _memory()
    if unpacked > room:
        return f"it unpacks to {unpacked:,} bytes, this machine has {room:,}"
    return ""


def _groups(metadata: Any) -> list[Any]:
    return [metadata.row_group(index) for index in range(metadata.num_row_groups)]


def _rows(metadata: Any) -> int:
    return max(
        int(metadata.num_rows), sum(int(group.num_rows) for group in _groups(metadata))
    )


def _values(metadata: Any) -> int:
    """Return the most values that a column has: more than rows where it has lists."""
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
