"""One hash of all results of a study.

Equal numbers have an equal hash. The hash does not depend on the location, the parts
and the name of the study.
"""

import hashlib
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sweep.tables import TABLES, StoredStudy

LEFT_OUT = ("seconds", "error", "replay")
"""Columns that differ from run to run, or with the name of the study."""
TRIALS_AT_A_TIME = 50_000
"""Trials per block. The hash depends on this number, which therefore cannot change."""


def content_hash(study: StoredStudy) -> str:
    """Return the sha256 of the results of a study, in hexadecimal.

    The hash covers the stored tables of the trials of the spec, in the order of the
    spec and bit for bit. Each block of 50,000 trials enters table by table. Each table
    enters column by column, in the order of column names. A column enters with its
    name, type, number of rows, empty rows, and values. Strings and lists begin with a
    length, and all numbers are little-endian. Wall times, error texts and commands are
    left out. Raises StoreError.
    """
    digest = hashlib.sha256()
    ids = study.plan["trial_id"].combine_chunks()
    for first in range(0, len(ids), TRIALS_AT_A_TIME):
        block = ids.slice(first, TRIALS_AT_A_TIME)
        for name in TABLES:
            _add_table(digest, name, study.read(name, block), block)
    return digest.hexdigest()


def _add_table(digest: Any, name: str, table: pa.Table, ids: pa.Array) -> None:
    place = pc.index_in(table["trial_id"], value_set=ids).to_numpy()
    table = table.take(pa.array(np.argsort(place, kind="stable")))
    for column in sorted(set(table.column_names) - {*LEFT_OUT}):
        values = table[column].combine_chunks()
        digest.update(f"{name}.{column} {values.type} {len(values)}\n".encode())
        _add(digest, values)


def _add(digest: Any, values: pa.Array) -> None:
    if isinstance(values, pa.ChunkedArray):  # a column without rows
        values = pa.array([], values.type)
    digest.update(pc.is_valid(values).to_numpy(zero_copy_only=False).tobytes())
    values = values.drop_null()
    if pa.types.is_null(values.type):
        return
    if pa.types.is_list(values.type):
        _add_numbers(digest, pc.list_value_length(values))
        _add(digest, values.flatten())
    elif pa.types.is_string(values.type):
        _add_numbers(digest, pc.binary_length(values))
        digest.update("".join(values.to_pylist()).encode(errors="surrogatepass"))
    else:
        _add_numbers(digest, values)


def _add_numbers(digest: Any, values: pa.Array) -> None:
    numbers = values.to_numpy(zero_copy_only=False)
    digest.update(numbers.astype(numbers.dtype.newbyteorder("<")).tobytes())
