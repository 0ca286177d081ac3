"""Check of the links of a stored plan, which may be untrusted or damaged."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.design import FIRST, before_each
from sweep.errors import StoreError
from sweep.spec import DIRECTION, PARENT


def check_links(plan: pa.Table, provenance: Mapping[str, Any]) -> None:
    """Raise ValueError unless each link begins at the previous link of the chain.

    Wrong beginnings are the link itself, a circle, a trial that does not exist, and a
    trial with different parameters. The provenance of the plan must have been checked.
    """
    if "continued" in provenance:
        _check(plan, provenance)
    elif PARENT in plan.column_names:
        raise ValueError("the plan has links of chains, but no continued axis")


def check_stored_link(study: str, row: Mapping[str, Any], plan: pa.Table) -> None:
    """Raise StoreError if the beginning of a stored trial differs from the plan.

    Trials that the plan does not have pass.

    Parameters
    ----------
    study : str
        The study, for errors.
    row : mapping
        The row of the trial.
    plan : pyarrow.Table
    """
    if PARENT not in plan.column_names:
        return
    place = pc.index(plan["trial_id"], row["trial_id"]).as_py()
    if place < 0:
        return
    planned = plan[PARENT][place].as_py()
    stored = row.get(PARENT)
    if stored != planned:
        raise StoreError(
            f"trial {row['trial_id']} begins {_where(stored)} in the table of trials,"
            f" but {_where(planned)} in the plan",
            study,
        )


def _check(plan: pa.Table, provenance: Mapping[str, Any]) -> None:
    trials = _texts(plan, "trial_id")
    if len(pc.unique(trials)) < len(trials):
        raise ValueError("a trial is listed twice")
    if PARENT not in plan.column_names:
        raise ValueError("the links have no column with the beginnings")
    parents = _texts(plan, PARENT)
    expected = _before(plan, provenance)
    # Trials that do not exist have an index past the last one.
    places = pc.index_in(parents, value_set=trials).fill_null(len(trials))
    planned = np.where(parents.is_null(), FIRST, places)
    wrong = np.flatnonzero(planned != expected)
    if len(wrong):
        place = int(wrong[0])
        parent = parents[place].as_py()
        unknown = "" if planned[place] < len(trials) else ", which is not in the plan"
        before = int(expected[place])
        right = None if before == FIRST else trials[before].as_py()
        raise ValueError(
            f"trial {trials[place]} begins {_where(parent)}{unknown}, but its"
            f" parameters require a beginning {_where(right)}"
        )


def _where(parent: object) -> str:
    return "with a new flock" if parent is None else f"where trial {parent} ended"


def _before(plan: pa.Table, provenance: Mapping[str, Any]) -> NDArray[np.int64]:
    """Return the row of the link before each link, by the parameters of the links."""
    rule = provenance["continued"]
    columns = [
        name
        for axis, stored in provenance["axes"].items()
        if axis != rule["axis"]
        for name in stored["fields"]
    ]
    columns.append("replicate")
    chain = plan.select(columns).to_pandas().groupby(columns, dropna=False).ngroup()
    directions = np.array(rule["directions"], object)
    turn = np.zeros(plan.num_rows, np.int64)
    if len(directions) > 1:
        turn = _turns(plan, directions)
    value = _numbers(plan, rule["axis"])
    return before_each(chain.to_numpy(), turn, directions[turn], value)


def _turns(plan: pa.Table, directions: NDArray[np.object_]) -> NDArray[np.int64]:
    """Return the index of the direction of each link."""
    if DIRECTION not in plan.column_names:
        raise ValueError("the links have no direction")
    ways = pa.array(directions, pa.string())
    indices = pc.index_in(_texts(plan, DIRECTION), value_set=ways)
    if indices.null_count:
        raise ValueError("the direction of a link differs from its chain")
    turns: NDArray[np.int64] = indices.to_numpy().astype(np.int64)
    return turns


def _texts(plan: pa.Table, name: str) -> pa.Array:
    column = plan[name].combine_chunks()
    if column.type not in (pa.string(), pa.null()):
        raise ValueError(f'column "{name}" holds {column.type}, not string')
    return column.cast(pa.string())


def _numbers(plan: pa.Table, name: str) -> NDArray[np.float64]:
    column = plan[name].combine_chunks()
    if column.null_count or not (
        pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
    ):
        raise ValueError(f'column "{name}" has values that are not numbers')
    numbers: NDArray[np.float64] = column.to_numpy().astype(np.float64)
    return numbers
