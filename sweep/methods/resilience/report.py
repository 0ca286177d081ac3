"""The report of resilience: effects of failures on recorded series."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from sweep.analysis import with_interval
from sweep.methods.resilience.analysis import PARTS, TIME
from sweep.tables import Report, StoredStudy, TextTable, brief, json_rows
from sweep.text import so_many


def resilience_report(study: StoredStudy, rows: pd.DataFrame, within: float) -> Report:
    """Return the fraction that is kept, the proportion that recovers, and the time.

    docs/json.md describes each key.

    Parameters
    ----------
    study : StoredStudy
    rows : DataFrame
        One row per point and metric, from `resilience_rows`.
    within : float
        Tolerance of a recovery, see `resilience_rows`.

    Returns
    -------
    Report
    """
    unit_of_time = study.units.get(TIME, "")
    measured = {"metric", "pairs", "lack"}
    measured |= {part + end for part in PARTS for end in ("", "_low", "_high")}
    settings = [str(name) for name in rows.columns if name not in measured]
    *shares, time = PARTS
    table = TextTable(
        columns=[*settings, "metric", *shares, f"{time} ({unit_of_time})", "pairs"],
        rows=[_cells(row, settings) for _, row in rows.iterrows()],
        title=f"{study.name}: resilience",
        caption="\n".join(_notes(rows, within)),
    )
    facts = {
        "study": study.name,
        "within": within,
        "confidence": 0.95,
        "unit_of_time": unit_of_time,
        "rows": json_rows(rows),
    }
    return Report(rows, facts, [table])


def _cells(row: "pd.Series[Any]", settings: Sequence[str]) -> list[str]:
    parts = [
        with_interval(row[part], row[f"{part}_low"], row[f"{part}_high"])
        for part in PARTS
    ]
    places = [brief(row[name]) for name in settings]
    return [*places, str(row["metric"]), *parts, str(row["pairs"])]


def _notes(rows: pd.DataFrame, within: float) -> Iterator[str]:
    yield "kept: mean after the failure, divided by the mean of the trial without"
    yield (
        f"recovered: fraction of pairs within {within:.0%} of the level of the trial"
        " without failure at the end; time: from the failure to the lasting recovery,"
        " mean over recovered pairs"
    )
    if lack := int(rows["lack"].max()):
        yield f"up to {so_many(lack, 'trial')} left out, without partner or value"
