"""The comparison of a repeated trial with its stored values, bit for bit."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.spec import LAST_FLOCKS
from sweep.store import boid_columns, flock_columns, profile_columns, trial_row
from sweep.tables import Columns, StoredTrial
from sweep.trial import Result

NOT_COMPARED = ("seconds", "error", "replay")
"""Columns of trials that differ between runs. Only the kind of an error is compared."""
LOWEST = int(np.iinfo(np.int64).min)


class BitDifference(NamedTuple):
    """A column of a table that differs, and the first differing row.

    `differing` of `total` values differ. `stored` and `recomputed` are the first pair
    that differs. `ulps` is the number of steps between the pair; None if the values are
    not floats. If the number of rows differs, `stored` and `recomputed` are the numbers
    of rows, and `row` is None.
    """

    trial: str
    table: str
    column: str
    differing: int
    total: int
    row: int | None
    stored: object
    recomputed: object
    ulps: int | None = None

    def __str__(self) -> str:
        place = f"trial {self.trial}: {self.table}.{self.column}"
        if self.row is None:
            stored_now = f"{self.stored} values stored, and {self.recomputed} now"
            return f"{place} has {stored_now}"
        apart = "" if self.ulps is None else f" ({self.ulps:,} ulp)"
        values = f"stored {self.stored!r}, now {self.recomputed!r}{apart}"
        if self.total == 1:
            return f"{place}: {values}"
        return (
            f"{place} differs in {self.differing:,} of {self.total:,} values, first in"
            f" row {self.row}: {values}"
        )


def differences(study: str, stored: StoredTrial, result: Result) -> list[BitDifference]:
    """Compare a repeated trial with its stored values, bit for bit.

    Every column of every table is compared, except the seconds that the trial took. For
    an error, only the kind must be equal.

    Parameters
    ----------
    study : str
        The name of the study.
    stored : StoredTrial
        The stored values of the trial.
    result : Result
        The result of the repeated trial.

    Returns
    -------
    list of BitDifference
        One for each column that differs.
    """
    trial = str(stored.row["trial_id"])
    recomputed = _recomputed_tables(study, stored, result)
    return [
        difference
        for table, columns in _stored_tables(stored).items()
        for column, values in columns.items()
        for difference in _compared(
            (trial, table, column),
            values,
            recomputed.get(table, {}).get(column, np.empty(0)),
        )
    ]


def values_compared(stored: StoredTrial) -> dict[str, int]:
    """Return the number of stored values that `differences` compares, by table."""
    return {
        name: sum(len(values) for values in columns.values())
        for name, columns in _stored_tables(stored).items()
    }


def error_kind(status: str, error: str) -> str:
    """Return the exception name of a traceback, or else the complete text of an error.

    Only a trial of status "failed" has a traceback.
    """
    lines = error.strip().splitlines()
    return (
        lines[-1].partition(":")[0] if status == "failed" and len(lines) > 1 else error
    )


def _stored_tables(stored: StoredTrial) -> dict[str, Columns]:
    return {"trials": _row(stored.row)} | stored.tables


def _row(row: dict[str, Any]) -> Columns:
    """Return the compared values of a row of trials as columns of one value each."""
    compared = {name: value for name, value in row.items() if name not in NOT_COMPARED}
    compared["error"] = error_kind(row["status"], row["error"] or "")
    return {
        name: np.array([value], None if isinstance(value, float) else object)
        for name, value in compared.items()
    }


def _recomputed_tables(
    study: str, stored: StoredTrial, result: Result
) -> dict[str, Columns]:
    row = dict.fromkeys(stored.row) | trial_row(study, result)
    job = result.job
    nothing = np.empty(0)
    frames = nothing if result.frames is None else result.frames
    tables = {"trials": _row(row)}
    tables["series"] = {"frame": frames} | {
        name: result.series.get(name, nothing) for name in job.record.series
    }
    tables["heatmaps"] = _heatmap(result.heatmap)
    tables["profiles"] = {
        name: values[0] for name, values in profile_columns(result.profiles).items()
    }
    tables["trajectories"] = {"frame": frames}
    if result.trajectory is not None and result.states is not None:
        tables["trajectories"] |= boid_columns(job, result.trajectory, result.states)
    if result.last_flock is not None:
        tables[LAST_FLOCKS] = flock_columns(job, result.last_flock)
    return tables


def _heatmap(visits: NDArray[np.int32] | None) -> Columns:
    """Return the columns of a heatmap in the store; empty without a heatmap."""
    rows, columns = ([], []) if visits is None else ([size] for size in visits.shape)
    flat = np.empty(0) if visits is None else visits.ravel()
    return {"rows": np.array(rows), "columns": np.array(columns), "visits": flat}


def _compared(
    column: tuple[str, str, str], stored: NDArray[Any], recomputed: NDArray[Any]
) -> Iterator[BitDifference]:
    """Yield the difference of a column, named by trial, table and column."""
    if len(stored) != len(recomputed):
        yield BitDifference(
            *column,
            differing=abs(len(stored) - len(recomputed)),
            total=len(stored),
            row=None,
            stored=len(stored),
            recomputed=len(recomputed),
        )
        return
    floats = stored.dtype.kind == recomputed.dtype.kind == "f"
    differing = np.flatnonzero(
        _bits(stored) != _bits(recomputed) if floats else stored != recomputed
    )
    if len(differing):
        row = int(differing[0])
        before = stored[row : row + 1].item()
        now = recomputed[row : row + 1].item()
        yield BitDifference(
            *column,
            differing=len(differing),
            total=len(stored),
            row=row,
            stored=before,
            recomputed=now,
            ulps=ulps(float(before), float(now)) if floats else None,
        )


def _bits(values: NDArray[np.float64]) -> NDArray[np.int64]:
    return np.ascontiguousarray(values, np.float64).view(np.int64)


def ulps(a: float, b: float) -> int:
    """Return the number of steps between two numbers.

    A step leads from one floating-point number to the next. From -0 to 0 is one step.
    """
    a_steps, b_steps = (
        int(bits) if bits >= 0 else LOWEST - int(bits) - 1
        for bits in _bits(np.array([a, b]))
    )
    return abs(a_steps - b_steps)
