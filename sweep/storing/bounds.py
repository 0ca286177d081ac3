"""How much a stored table may unpack to, asked of its footer before memory is taken.

A parquet file of a megabyte can hold billions of equal rows. Plans, and the trials of a
part, have an id in each row, of 24 hexadecimal digits of a hash. No compression brings
those below 12 bytes. So the size of the file bounds the number of its rows, whatever the
size of the study. Series, heatmaps and trajectories of quiet swarms may be small by
right: they are bounded by the memory of this machine, which could not hold more anyway.
"""

import os
from typing import Any

from sweep.storing.layout import ASKED, PLAN

ROW_BYTES = {PLAN: 8, "trials.parquet": 8, ASKED: 1}
"""The least bytes of a row of files with ids; in the last a trial may stand often."""
FREE_ROWS = 100_000
"""Rows that a file of any size may have."""
CELL_BYTES = 8


def excess(name: str, metadata: Any, size: int) -> str:
    """Why a table is not to be read, in a few words; empty where it may be.

    It lies in a file of this name and size in bytes; `metadata` is that in its footer.
    """
    groups = [metadata.row_group(index) for index in range(metadata.num_row_groups)]
    rows = max(metadata.num_rows, sum(group.num_rows for group in groups))
    if name in ROW_BYTES and rows > FREE_ROWS + size // ROW_BYTES[name]:
        return f"{rows:,} rows with an id each cannot lie in {size:,} bytes"
    packed = sum(group.total_byte_size for group in groups)
    unpacked, room = max(packed, CELL_BYTES * rows * metadata.num_columns), _memory()
    if unpacked > room:
        return f"it unpacks to {unpacked:,} bytes, this machine has {room:,}"
    return ""


def _memory() -> int:
    """The bytes of memory of this machine."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
