"""Requests of a search as a column of the plan: a list of requests for each trial.

A search may request a trial more than once. One file contains the plan and the
requests, so plan and requests change in a single step.
"""

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from sweep.errors import UnreadableError
from sweep.store.locations import Location

ASKED_FOR = "asked for"
"""Name of the column.

The blank distinguishes the name from parameters, which are columns too.
"""
ROW = "row"
"""Number of a request in the table of all requests."""


def with_asked(plan: pa.Table, requests: pa.Table) -> pa.Table:
    """Return the plan with a column of the requests of a search.

    Parameters
    ----------
    plan : Table
        One row per trial, with the `trial_id`.
    requests : Table
        A row per request, with the `trial_id` of a trial of the plan. The column gets
        the metadata of this table.

    Raises
    ------
    ValueError
        If a request is for a trial that is not in the plan.
    """
    ids = plan["trial_id"].combine_chunks()
    places = pc.index_in(requests["trial_id"].combine_chunks(), value_set=ids)
    if places.null_count:
        raise ValueError("a search can request only trials of the plan")
    numbers = places.to_numpy()
    ends = np.cumsum(np.bincount(numbers, minlength=len(ids)))
    rows = requests.drop_columns("trial_id").append_column(
        ROW, pa.array(np.arange(len(numbers)))
    )
    rows = rows.take(pa.array(np.argsort(numbers, kind="stable")))
    values = pa.StructArray.from_arrays(
        [column.combine_chunks() for column in rows.columns], rows.column_names
    )
    offsets = pa.array(np.concatenate([[0], ends]).astype(np.int32))
    lists = pa.ListArray.from_arrays(offsets, values)
    field = pa.field(ASKED_FOR, lists.type, metadata=requests.schema.metadata)
    return plan.append_column(field, lists)


def asked_in(plan: pa.Table, file: Location, remedy: str) -> pa.Table:
    """Return the requests of a search from the column of a plan, in order.

    Parameters
    ----------
    plan : Table
        The columns `trial_id` and ASKED_FOR of the plan.
    file : Location
        File of the plan, for the error.
    remedy : str
        How to fix the file, for the error.

    Raises
    ------
    UnreadableError
        If no search has written the column.
    """
    kind = plan.schema.field(ASKED_FOR).type
    entry = kind.value_type if pa.types.is_list(kind) else pa.null()
    fields = [field.name for field in entry] if pa.types.is_struct(entry) else []
    if ROW not in fields or len({*fields, "trial_id"}) <= len(fields):
        raise UnreadableError(file, f"has no lists under {ASKED_FOR}", remedy)
    lists = plan[ASKED_FOR].combine_chunks()
    rows = dict(zip(fields, pc.list_flatten(lists).flatten(), strict=True))
    rows["trial_id"] = (
        plan["trial_id"].combine_chunks().take(pc.list_parent_indices(lists))
    )
    table = pa.table(rows, metadata=plan.schema.field(ASKED_FOR).metadata)
    return table.sort_by(ROW).drop_columns(ROW)
