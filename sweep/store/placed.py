"""Where the rows of some trials lie in the parts of a study: the ids of all parts are
read and looked up once, whatever is read of the trials then.
"""

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.store.locations import Location
from sweep.store.parquet import each, load_table, stored_schema
from sweep.store.uniting import united

ID = "trial_id"


class PartRows(NamedTuple):
    """The trials of a part: their `ids` (k,), and which of them are `wanted` (k,), and
    in no later part.
    """

    part: Location
    ids: pa.ChunkedArray
    wanted: NDArray[np.bool_]


class PlacedTrials(NamedTuple):
    """Where the rows of some trials lie.

    `ids` (k,) are those of the trials asked for that are stored, in the order in which
    they were asked for, and `rows` (k,) has the number of each among the wanted rows of
    all parts, one part after the other.
    """

    parts: list[PartRows]
    ids: pa.ChunkedArray
    rows: NDArray[np.int64]


def placed_trials(
    parts: Sequence[Location], trial_ids: pa.ChunkedArray | pa.Array
) -> PlacedTrials:
    """Where these trials lie in `parts`, oldest first: of one in several of them the
    latest counts. Raises StoreError for a damaged part.
    """
    tables = each(parts, lambda part: load_table(part, "trials", [ID]))
    columns = [table[ID] for table in tables]
    chunks = [chunk for column in columns for chunk in column.chunks]
    every = pa.chunked_array(chunks, pa.string())
    found = pc.index_in(every, value_set=trial_ids).fill_null(-1).to_numpy()
    known = np.flatnonzero(found >= 0)
    row = np.full(len(trial_ids), -1, np.int64)
    row[found[known]] = known  # of several rows of a trial the last one stays
    stored = row >= 0
    wanted = np.zeros(len(found), np.bool_)
    wanted[row[stored]] = True
    ends = np.cumsum([0, *map(len, columns)], dtype=np.int64)
    own = [wanted[first:end] for first, end in pairwise(ends.tolist())]
    rows = zip(parts, columns, own, strict=True)
    ids = trial_ids if stored.all() else trial_ids.filter(pa.array(stored))
    number = np.cumsum(wanted) - 1
    return PlacedTrials([PartRows(*one) for one in rows], ids, number[row[stored]])


def load_wanted(rows: PartRows, name: str, columns: list[str] | None) -> pa.Table:
    """What a table of a part has of the trials that are wanted. If these are none, only
    its schema is read.

        rows     the part, and which of its trials are wanted
        name     the table
        columns  the columns; None for all

    Raises UnreadableError for a damaged file.
    """
    if not rows.wanted.any():
        schema = stored_schema(rows.part / f"{name}.parquet")
        return schema.empty_table().select(
            [column for column in schema.names if columns is None or column in columns]
        )
    table = load_table(rows.part, name, columns)
    if rows.wanted.all():
        return table
    if name == "trials":
        return table.filter(pa.array(rows.wanted))
    ids = rows.ids.filter(pa.array(rows.wanted))
    return table.filter(pc.is_in(table[ID], value_set=ids))


def load_each(
    parts: Sequence[PartRows], name: str, columns: list[str] | None
) -> list[pa.Table]:
    """`load_wanted` of each of these parts."""
    wanted = {one.part: one for one in parts}
    return each([*wanted], lambda part: load_wanted(wanted[part], name, columns))


def in_order(placed: PlacedTrials, columns: Sequence[str]) -> pa.Table:
    """The ids of placed trials, in their order, and those of these columns that any of
    their parts has, united as by `Store.read`. Raises StoreError for a damaged part,
    and for one that is no longer there.
    """
    names = [name for name in dict.fromkeys(columns) if name != ID]
    wanted = {one.part: one for one in placed.parts}
    tables = each(
        [*wanted], lambda part: _numbered(load_wanted(wanted[part], "trials", names))
    )
    found = united(tables, names)
    if ID in found.column_names:
        return found  # there is no part
    if not np.array_equal(placed.rows, np.arange(found.num_rows)):
        found = found.take(pa.array(placed.rows))
    found = _spelled(found)
    return found.add_column(0, pa.field(ID, pa.string()), placed.ids)


def _numbered(table: pa.Table) -> pa.Table:
    """A table whose texts are numbers of different ones. Few texts stand for many rows:
    numbers are put into order in a tenth of the time, and need little memory.
    """
    for place, field in enumerate(table.schema):
        if pa.types.is_string(field.type):
            numbers = table[place].dictionary_encode()
            table = table.set_column(place, field.with_type(numbers.type), numbers)
    return table


def _spelled(table: pa.Table) -> pa.Table:
    """The same table with its texts."""
    kinds = [
        field.with_type(field.type.value_type)
        if pa.types.is_dictionary(field.type)
        else field
        for field in table.schema
    ]
    return table.cast(pa.schema(kinds, table.schema.metadata))
