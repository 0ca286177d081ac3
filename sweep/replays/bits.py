"""Compares a trial that was run again with what is stored of it, bit by bit."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.spec.study import LAST_FLOCKS
from sweep.store.rows import boid_columns, flock_columns, trial_row
from sweep.tables.stored_trials import Columns, StoredTrial
from sweep.trial.result import Result

NOT_COMPARED = ("seconds", "error", "replay")
"""Columns of trials that differ from run to run. Of an error its kind is compared."""
LOWEST = int(np.iinfo(np.int64).min)


class BitDifference(NamedTuple):
    """A column of a table that differs, and the first row in which it does.

    `differing` of `total` values differ. `ulps` says how many floating-point numbers
    lie between the first two; None for what is no number. If the number of rows
    differs, `stored` and `found` are these numbers, and `row` is None.
    """

    trial: str
    table: str
    column: str
    differing: int
    total: int
    row: int | None
    stored: object
    found: object
    ulps: int | None = None

    def __str__(self) -> str:
        place = f"trial {self.trial}: {self.table}.{self.column}"
        if self.row is None:
            return f"{place} has {self.stored} values stored, and {self.found} now"
        apart = "" if self.ulps is None else f" ({self.ulps:,} ulp)"
        values = f"stored {self.stored!r}, now {self.found!r}{apart}"
        if self.total == 1:
            return f"{place}: {values}"
        return (
            f"{place} differs in {self.differing:,} of {self.total:,} values, first in"
            f" row {self.row}: {values}"
        )


def differences(study: str, stored: StoredTrial, result: Result) -> list[BitDifference]:
    """Where `result`, the same trial run again, differs from what is stored: every
    column of every table, to the last bit.

    Of an error only the kind must be the same. The seconds that the trial took are not
    compared.
    """
    trial, found = str(stored.row["trial_id"]), _found(study, stored, result)
    then = {"trials": _row(stored.row)} | stored.tables
    return [
        difference
        for table, columns in then.items()
        for column, values in columns.items()
        for difference in _compared(
            trial, table, column, values, found.get(table, {}).get(column, np.empty(0))
        )
    ]


def values_compared(stored: StoredTrial) -> dict[str, int]:
    """How many stored values `differences` compares, by table."""
    tables = {"trials": _row(stored.row)} | stored.tables
    return {
        name: sum(len(values) for values in columns.values())
        for name, columns in tables.items()
    }


def error_kind(status: str, error: str) -> str:
    """The kind of an error: the name of the exception in a traceback, or else its whole
    text.
    """
    lines = error.strip().splitlines()
    return (
        lines[-1].partition(":")[0] if status == "failed" and len(lines) > 1 else error
    )


def _row(row: dict[str, Any]) -> Columns:
    """A row of trials, as columns of one value each."""
    kept = {name: value for name, value in row.items() if name not in NOT_COMPARED}
    kept["error"] = error_kind(row["status"], row["error"] or "")
    return {
        name: np.array([value], None if isinstance(value, float) else object)
        for name, value in kept.items()
    }


def _found(study: str, stored: StoredTrial, result: Result) -> dict[str, Columns]:
    row = dict.fromkeys(stored.row) | trial_row(study, result)
    nothing, job = np.empty(0), result.job
    frames = nothing if result.frames is None else result.frames
    tables = {"trials": _row(row)}
    tables["series"] = {"frame": frames} | {
        name: result.series.get(name, nothing) for name in job.record.series
    }
    tables["heatmaps"] = _heatmap(result.heatmap)
    tables["trajectories"] = {"frame": frames}
    if result.trajectory is not None and result.states is not None:
        tables["trajectories"] |= boid_columns(job, result.trajectory, result.states)
    if result.last_flock is not None:
        tables[LAST_FLOCKS] = flock_columns(job, result.last_flock)
    return tables


def _heatmap(visits: NDArray[np.int32] | None) -> Columns:
    """A heatmap as its columns in the store; empty columns if there is none."""
    rows, columns = ([], []) if visits is None else ([size] for size in visits.shape)
    flat = np.empty(0) if visits is None else visits.ravel()
    return {"rows": np.array(rows), "columns": np.array(columns), "visits": flat}


def _compared(
    trial: str, table: str, column: str, stored: NDArray[Any], found: NDArray[Any]
) -> Iterator[BitDifference]:
    if len(stored) != len(found):
        had, has = len(stored), len(found)
        yield BitDifference(trial, table, column, abs(had - has), had, None, had, has)
        return
    floats = stored.dtype.kind == found.dtype.kind == "f"
    differing = np.flatnonzero(
        _bits(stored) != _bits(found) if floats else stored != found
    )
    if len(differing):
        row = int(differing[0])
        one, other = stored[row : row + 1], found[row : row + 1]
        apart = ulps(float(one[0]), float(other[0])) if floats else None
        count, total = len(differing), len(stored)
        yield BitDifference(
            trial, table, column, count, total, row, one.item(), other.item(), apart
        )


def _bits(values: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.ascontiguousarray(values, np.float64).view(np.int64)


def ulps(one: float, other: float) -> int:
    """The number of steps between two numbers, where a step goes from one
    floating-point number to the next. From -0 to 0 is one step.
    """
    first, second = (
        int(bits) if bits >= 0 else LOWEST - int(bits) - 1
        for bits in _bits(np.array([one, other]))
    )
    return abs(first - second)
