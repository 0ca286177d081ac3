"""Whether the links of a stored plan are those that chains have: it may come from
anyone, or be damaged.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.design.chains import FIRST, before_each
from sweep.errors import StoreError
from sweep.spec.continuing import DIRECTION, PARENT


def check_links(plan: pa.Table, about: Mapping[str, Any]) -> None:
    """Raise ValueError where a link of a plan begins elsewhere than at the link before
    it in its chain: at itself, in a circle, at a trial that there is not, or at one of
    other settings. `about` is the provenance of the plan, which has been checked.
    """
    if "continued" in about:
        _check(plan, about)
    elif PARENT in plan.column_names:
        raise ValueError("it has links of chains, and no axis that is continued")


def check_stored_link(study: str, row: Mapping[str, Any], plan: pa.Table) -> None:
    """Raise StoreError where the row of a stored trial says that it begins elsewhere
    than its plan does. Trials that the plan does not have are left alone.
    """
    if PARENT not in plan.column_names:
        return
    place = pc.index(plan["trial_id"], row["trial_id"]).as_py()
    if place < 0:
        return
    planned, stored = plan[PARENT][place].as_py(), row.get(PARENT)
    if stored != planned:
        raise StoreError(
            f"trial {row['trial_id']} is stored as one that begins {_where(stored)},"
            f" and the plan has it begin {_where(planned)}",
            study,
        )


def _check(plan: pa.Table, about: Mapping[str, Any]) -> None:
    trials = _texts(plan, "trial_id")
    if len(pc.unique(trials)) < len(trials):
        raise ValueError("a trial stands twice")
    if PARENT not in plan.column_names:
        raise ValueError("its links do not say where they begin")
    parents, wanted = _texts(plan, PARENT), _before(plan, about)
    known = pc.index_in(parents, value_set=trials).fill_null(len(trials))
    found = np.where(parents.is_null(), FIRST, known)
    wrong = np.flatnonzero(found != wanted)
    if len(wrong):
        place = int(wrong[0])
        parent = parents[place].as_py()
        whether = "" if found[place] < len(trials) else ", which it does not have"
        before = int(wanted[place])
        instead = None if before == FIRST else trials[before].as_py()
        raise ValueError(
            f"trial {trials[place]} begins {_where(parent)}{whether}; by its settings"
            f" it begins {_where(instead)}"
        )


def _where(parent: object) -> str:
    return "as its settings say" if parent is None else f"where trial {parent} ended"


def _before(plan: pa.Table, about: Mapping[str, Any]) -> NDArray[np.int64]:
    """The place of the link before each one of a plan in its chain, by the settings of
    both.
    """
    rule, axes = about["continued"], about["axes"]
    others = [one["fields"] for name, one in axes.items() if name != rule["axis"]]
    columns = [*(name for fields in others for name in fields), "replicate"]
    chain = plan.select(columns).to_pandas().groupby(columns, dropna=False).ngroup()
    directions = np.array(rule["directions"], object)
    turn = np.zeros(plan.num_rows, np.int64)
    if len(directions) > 1:
        turn = _turns(plan, directions)
    value = _numbers(plan, rule["axis"])
    return before_each(chain.to_numpy(), turn, directions[turn], value)


def _turns(plan: pa.Table, directions: NDArray[np.object_]) -> NDArray[np.int64]:
    """Which of the directions each link has."""
    if DIRECTION not in plan.column_names:
        raise ValueError("its links have no direction")
    ways = pa.array(directions, pa.string())
    found = pc.index_in(_texts(plan, DIRECTION), value_set=ways)
    if found.null_count:
        raise ValueError("a link has another direction than its chain")
    turns: NDArray[np.int64] = found.to_numpy().astype(np.int64)
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
        raise ValueError(f'column "{name}" has values that are no numbers')
    numbers: NDArray[np.float64] = column.to_numpy().astype(np.float64)
    return numbers
