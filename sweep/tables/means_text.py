"""A table of means in words, printed by `sweep table`: the cells and the caption."""

import math
from typing import Any

import pandas as pd

from sweep.analysis import (
    MeanKind,
    in_full,
    is_centred,
    number,
    percent,
    plus_minus,
    with_interval,
)
from sweep.tables.json_text import json_rows
from sweep.tables.means import PointMeans
from sweep.tables.overview import constant, few_skewed, undeclared, untried
from sweep.tables.reports import MAX_ROWS, Report, TextTable
from sweep.tables.stored_study import StoredStudy
from sweep.tables.stored_tables import command
from sweep.text import shortened, so_many

INTERVALS: dict[MeanKind | None, str] = {
    None: (
        "mean with the 95 % confidence interval for the distribution (sweep metrics);"
        " ± is the half-width of a Student's t interval"
    ),
    "t": "mean ± half-width of the 95 % confidence interval",
    "bootstrap": "mean and 95 % confidence interval by the BCa bootstrap",
    "bootstrap_t": "mean and 95 % confidence interval by the bootstrap-t",
}

POOLED = (
    "each row pools points with equal weight: a value is the mean over the points in a"
    " replicate. Only replicates with a value at every point count"
)


def means_report(study: StoredStudy, table: PointMeans) -> Report:
    """Return a table of means; Student's intervals are shown as half-widths.

    A row has the number of trials, or of replicates if the row pools points.
    """
    rows = point_rows(study, table)
    units = study.units
    settings = [*table.headings, *(["points"] if table.pooled else [])]
    metrics = [
        f"{name}\n({units[name]})" if name in units else name for name in table.metrics
    ]
    row_name = "row" if table.pooled else "point"
    shown = TextTable(
        columns=[*settings, *metrics, "replicates" if table.pooled else "trials"],
        rows=[
            [
                *(brief(row[name]) for name in settings),
                *(cell_text(study, row, name, table) for name in table.metrics),
                _count(row, table.metrics),
            ]
            for _, row in table.rows.head(MAX_ROWS).iterrows()
        ],
        title=study.name,
        caption=caption(study, table),
        hidden=max(len(table.rows) - MAX_ROWS, 0),
        row_name=row_name,
    )
    views = [
        f"a trial of the first {row_name} (--csv and --json: of every row): {view}"
        for view in rows["view"].head(1)
    ]
    return Report(rows, json_rows(rows), [shown, *views])


def _count(row: "pd.Series[Any]", metrics: list[str]) -> str:
    n = max((int(row[f"{name}_n"]) for name in metrics), default=0)
    return f"{n}" + (f" (+{row['not_done']} not done)" if row["not_done"] else "")


def point_rows(study: StoredStudy, table: PointMeans) -> pd.DataFrame:
    """Return the rows of a table for programs.

    `METRIC_declared` is false for a metric that declares no distribution, and absent
    for other metrics. The last column, `view`, is the command that shows a trial of the
    row.
    """
    metrics = undeclared(study, table.metrics)
    declared = {f"{name}_declared": False for name in metrics}
    views = [command("view", study.name, trial) for trial in table.rows["trial_id"]]
    return table.rows.drop(columns="trial_id").assign(**declared, view=views)


def cell_text(
    study: StoredStudy, row: "pd.Series[Any]", name: str, table: PointMeans
) -> str:
    """Return a mean with its confidence interval, for a cell.

    Parameters
    ----------
    study : StoredStudy
    row : Series
        The row of `table.rows`.
    name : str
        The column of the metric.
    table : PointMeans

    Returns
    -------
    str
        With the fraction of trials without a value in a second line, if there are such
        trials. The cell states if several values have no confidence interval, for
        example equal values without a range.
    """
    mean, low, high = (float(row[name + end]) for end in ("", "_low", "_high"))
    repeated = name in study.repeated and not table.pooled
    own = table.interval is None or repeated
    normal = in_full(study.distributions[name]).distribution == "normal"
    students = normal if own else table.interval == "t"
    if row[f"{name}_n"] > 1 and math.isnan(low):
        text = f"{number(mean)} (no interval)"
    elif students and is_centred(mean, low, high):
        text = plus_minus(mean, high - mean)
    else:
        text = with_interval(mean, low, high)
    undefined = row[f"{name}_undefined"]
    return f"{text}\n{percent(undefined)} undefined" if undefined else text


def caption(study: StoredStudy, table: PointMeans) -> str:
    """Return the notes below a table.

    The notes name the kind of the confidence intervals, the pooling of points,
    intervals of few values, unknown intervals, and trials that are not stored.
    """
    counts = {name: table.rows[f"{name}_n"] for name in table.metrics}
    notes = [
        _intervals(study, table),
        "; ".join(study.apart_notes),
        few_skewed(study, counts),
        constant(table.rows, table.metrics),
        _undeclared(study, table),
        _missing(study),
    ]
    return "\n".join(filter(None, notes))


def _undeclared(study: StoredStudy, table: PointMeans) -> str:
    """Return the metrics that declare no distribution, in words, or ""."""
    metrics = undeclared(study, table.metrics)
    if not metrics:
        return ""
    declares = "declares" if len(metrics) == 1 else "declare"
    return (
        f"{' and '.join(metrics)} {declares} no distribution and"
        f" {'is' if len(metrics) == 1 else 'are'} treated as normal"
    )


def _missing(study: StoredStudy) -> str:
    """Return the numbers of missing trials and of points without trials, or ""."""
    if not study.missing:
        return ""
    number = f"{study.missing:,} of {so_many(study.plan.num_rows, 'trial')} missing"
    return "; ".join(filter(None, [number, untried(study)]))


def _intervals(study: StoredStudy, table: PointMeans) -> str:
    """Return the kind of confidence intervals of a table, and the pooling of points.

    If a metric decided the number of trials of a point, only the interval of this
    metric accounts for the decision.
    """
    if table.pooled:
        fixed = ", valid for fixed numbers of trials" if study.repeated else ""
        return f"{INTERVALS[table.interval]}{fixed}\n{POOLED}"
    looks = study.looks
    if not looks:
        return INTERVALS[table.interval]
    metrics = looks.metrics
    declared = {in_full(study.distributions[name]).distribution for name in metrics}
    normal = declared == {"normal"}
    return (
        f"{', '.join(metrics)}: mean {'± half-width of' if normal else 'with'} the"
        f" repeated {100 * looks.confidence:g} % confidence interval, which decided the"
        f" number of trials of each point\nother metrics: {INTERVALS[table.interval]},"
        " valid for fixed numbers of trials"
    )


def brief(value: Any) -> str:
    """Return the value of a parameter in few characters."""
    return f"{value:.6g}" if isinstance(value, float) else shortened(str(value)) or "-"
