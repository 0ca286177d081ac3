"""Row numbers of some trials in the parts of a study.

The ids of all parts are read and looked up once, before any column of the trials is
read.
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
    """Trials of a part, some of them selected.

    Attributes
    ----------
    part : Location
    ids : ChunkedArray
        Ids of the k trials of the part.
    selected : array of bool
        Requested trials that are not in a later part, shape (k,).
    """

    part: Location
    ids: pa.ChunkedArray
    selected: NDArray[np.bool_]


class PlacedTrials(NamedTuple):
    """Row numbers of some trials.

    Attributes
    ----------
    parts : list of PartRows
    ids : ChunkedArray
        Ids of the k requested trials that are stored, in the order of the request.
    rows : array of int
        Number of each trial in the selected rows of all parts, part after part, shape
        (k,).
    """

    parts: list[PartRows]
    ids: pa.ChunkedArray
    rows: NDArray[np.int64]


def placed_trials(
    parts: Sequence[Location], trial_ids: pa.ChunkedArray | pa.Array
) -> PlacedTrials:
    """Return the row numbers of some trials in `parts`, which are oldest first.

    If several parts have a trial, the latest part counts. Raises StoreError for a
    damaged part.
    """
    tables = each(parts, lambda part: load_table(part, "trials", [ID]))
    columns = [table[ID] for table in tables]
    chunks = [chunk for column in columns for chunk in column.chunks]
    every = pa.chunked_array(chunks, pa.string())
    index = pc.index_in(every, value_set=trial_ids).fill_null(-1).to_numpy()
    matching = np.flatnonzero(index >= 0)
    row = np.full(len(trial_ids), -1, np.int64)
    row[index[matching]] = matching  # of several rows of a trial the last one stays
    stored = row >= 0
    selected = np.zeros(len(index), np.bool_)
    selected[row[stored]] = True
    ends = np.cumsum([0, *map(len, columns)], dtype=np.int64)
    own = [selected[first:end] for first, end in pairwise(ends.tolist())]
    ids = trial_ids if stored.all() else trial_ids.filter(pa.array(stored))
    number = np.cumsum(selected) - 1
    rows = zip(parts, columns, own, strict=True)
    part_rows = [PartRows(*fields) for fields in rows]
    return PlacedTrials(part_rows, ids, number[row[stored]])


def load_wanted(rows: PartRows, name: str, columns: list[str] | None) -> pa.Table:
    """Return the rows of the selected trials in a table of a part.

    Without a selected trial only the schema of the table is read.

    Parameters
    ----------
    rows : PartRows
        The part and its selected trials.
    name : str
        Name of the table.
    columns : list of str or None
        Columns; None for all.

    Raises
    ------
    UnreadableError
        If the file is damaged.
    """
    if not rows.selected.any():
        schema = stored_schema(rows.part / f"{name}.parquet")
        return schema.empty_table().select(
            [column for column in schema.names if columns is None or column in columns]
        )
    table = load_table(rows.part, name, columns)
    if rows.selected.all():
        return table
    if name == "trials":
        return table.filter(pa.array(rows.selected))
    ids = rows.ids.filter(pa.array(rows.selected))
    return table.filter(pc.is_in(table[ID], value_set=ids))


def load_each(
    parts: Sequence[PartRows], name: str, columns: list[str] | None
) -> list[pa.Table]:
    """Return the selected rows of a table for each part, by `load_wanted`.

    Parameters
    ----------
    parts : sequence of PartRows
    name : str
        Name of the table.
    columns : list of str or None
        Columns; None for all.
    """
    rows = {part_rows.part: part_rows for part_rows in parts}
    return each([*rows], lambda part: load_wanted(rows[part], name, columns))


def in_order(placed: PlacedTrials, columns: Sequence[str]) -> pa.Table:
    """Return ids and columns of placed trials, in their order.

    Columns that none of the parts has are left out. The parts are united as by
    `Store.read`. Raises StoreError for a part that is damaged or no longer exists.
    """
    further_columns = [name for name in dict.fromkeys(columns) if name != ID]
    rows = {part_rows.part: part_rows for part_rows in placed.parts}
    tables = each(
        [*rows],
        lambda part: _numbered(load_wanted(rows[part], "trials", further_columns)),
    )
    trials = united(tables, further_columns)
    if ID in trials.column_names:
        return trials  # there is no part
    if not np.array_equal(placed.rows, np.arange(trials.num_rows)):
        trials = trials.take(pa.array(placed.rows))
    trials = _spelled(trials)
    return trials.add_column(0, pa.field(ID, pa.string()), placed.ids)


def _numbered(table: pa.Table) -> pa.Table:
    """Return a table with dictionary-encoded strings.

    Many rows have few different strings. Sorting of numbers takes a tenth of the time
    of strings, and little memory.
    """
    for place, field in enumerate(table.schema):
        if pa.types.is_string(field.type):
            numbers = table[place].dictionary_encode()
            table = table.set_column(place, field.with_type(numbers.type), numbers)
    return table


def _spelled(table: pa.Table) -> pa.Table:
    """Return the table with decoded strings."""
    kinds = [
        field.with_type(field.type.value_type)
        if pa.types.is_dictionary(field.type)
        else field
        for field in table.schema
    ]
    return table.cast(pa.schema(kinds, table.schema.metadata))
