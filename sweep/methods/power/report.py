"""The report of a pilot: the number of replicates that a study needs."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pandas as pd

from sweep.analysis import CAVEATS, FEWEST, MOST, SMALL, number
from sweep.methods.power.analysis import Power
from sweep.tables import MAX_ROWS, Report, TextTable, brief, json_rows
from sweep.text import so_many

MARKS = dict(zip(CAVEATS, ("?", "=", "*", "!"), strict=True))
CAUTIONS = dict(
    zip(
        CAVEATS,
        (
            f"fewer than {FEWEST} values: no answer",
            "all values are equal, or all but one, so the spread is unknown: no answer",
            "the pilot has no event, only events, or no pair that differs: computed"
            " for a rate that the pilot allows",
            f"fewer than {SMALL} values that are not normal: the power may be lower"
            " than stated, or the number far too large; use a larger pilot",
        ),
        strict=True,
    )
)
GOALS = {
    "half width": "the 95 % confidence interval of sweep table is as narrow as asked",
    "difference": "sweep compare detects a true difference as large as asked",
}
RANGE = "range: 95 % uncertainty due to the size of the pilot"


def power_report(power: Power) -> Report:
    """Return the replicates of each row, and notes on how to read the table.

    A note names the row with the largest number. In JSON, a number that is unknown or
    above a million is null.
    """
    table = TextTable(
        columns=[
            *power.headings,
            *("metric", "goal", "asked", "mean", "values\nof pilot", "half-width\nnow"),
            *("replicates", "range"),
        ],
        rows=[
            [*(brief(row[name]) for name in power.headings), *_cells(row)]
            for _, row in power.rows.head(MAX_ROWS).iterrows()
        ],
        title=power.title,
        caption="\n".join(_read(power)),
        hidden=max(len(power.rows) - MAX_ROWS, 0),
    )
    return Report(power.rows, json_rows(power.rows), [table, *_notes(power)])


def _read(power: Power) -> Iterable[str]:
    """Yield lines on how to read the table."""
    for goal in power.rows["goal"].unique():
        yield (
            f"with the listed replicates, {GOALS[goal]} with a probability of"
            f" {100.0 * power.chance:g} %"
        )
    yield RANGE


def _cells(row: "pd.Series[Any]") -> list[str]:
    half = (row["high"] - row["low"]) / 2.0
    pairs = " pairs" if row["paired"] else ""
    return [
        f"{row['metric']} ({row['unit']})" if row["unit"] else row["metric"],
        row["goal"],
        row["asked"],
        number(row["mean"], half),
        f"{row['values']}{pairs}",
        number(half, half),
        _count(row["replicates"]) + MARKS.get(row["caveat"], ""),
        _range(row),
    ]


def _count(replicates: float) -> str:
    if np.isnan(replicates):
        return "-"
    return f"{replicates:,.0f}" if replicates < np.inf else f"over {MOST:,.0f}"


def _range(row: "pd.Series[Any]") -> str:
    low, high = (_count(row[f"replicates_{end}"]) for end in ("low", "high"))
    return f"{low} to {high}"


def _notes(power: Power) -> Iterable[str]:
    if power.against:
        yield f"each against {power.against}"
    if power.tests > 1:
        yield (
            f"all {power.tests:,} differences are tested together: each at"
            f" {5.0 / power.tests:.2g} %"
        )
    for row in power.worst():
        place = ", ".join(f"{name} = {brief(row[name])}" for name in power.headings)
        yield (
            f"most for {row['metric']}, {row['goal']} {row['asked']}:"
            f" {_count(row['replicates'])} replicates ({_range(row)})"
            f"{f', at {place}' if place else ''}"
        )
    counts = power.rows["caveat"].value_counts()
    for caveat in CAVEATS:
        if count := int(counts.get(caveat, 0)):
            yield f"{MARKS[caveat]} {CAUTIONS[caveat]} ({so_many(count, 'row')})"
