"""The studies in a folder of results with the progress, and notes about means.

The notes concern points without a trial, and metrics with few skewed, constant or
undeclared values.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from sweep.analysis import FEW, in_full
from sweep.errors import UserError
from sweep.spec import Column, launched_studies
from sweep.store import check_folder
from sweep.tables.results import Results
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

COUNTS = ("trials", "done", "not_done", "missing")


def studies(results: Path) -> pd.DataFrame:
    """Return one row per study in a folder of results.

    Columns: `study`, `model`, `preset`; `varied`, the varied parameters; the numbers
    `trials`, `done`, `not_done` and `missing`; and `error`, the reason if the study
    cannot be read. Raises StoreError if the folder does not exist.
    """
    check_folder(results)
    rows = [_study(name, results) for name in launched_studies(results)]
    columns = ["study", "model", "preset", "varied", *COUNTS, "error"]
    return pd.DataFrame(rows, columns=columns).astype(dict.fromkeys(COUNTS, "Int64"))


def untried(study: Results) -> str:
    """Return the number of points without a stored trial, in words, or ""."""
    if not study.untried:
        return ""
    number = f"{study.untried:,} of {so_many(len(study.points), 'point')}"
    return f"{number} {'has' if study.untried == 1 else 'have'} no trial yet"


def few_skewed(study: Results, counts: Mapping[str, Iterable[int]]) -> str:
    """Return a warning about intervals of skewed metrics from 2 to FEW values.

    The string is "" if no point has so few. `counts` has the numbers of values by
    column.
    """
    few = [
        name
        for name, numbers in counts.items()
        if in_full(study.distributions[name]).distribution == "skewed"
        and any(2 <= number <= FEW for number in numbers)
    ]
    if not few:
        return ""
    return (
        f"{' and '.join(few)}: 2 to {FEW} skewed values cannot show a long tail, so the"
        " confidence intervals may contain the mean with less than 95 % probability"
    )


def constant(rows: pd.DataFrame, metrics: Iterable[str]) -> str:
    """Return a note about metrics with several values but no confidence interval.

    The string is "" if there is no such metric. `rows` has the columns of `by_point`.
    """
    unknown = {
        name: int(((rows[f"{name}_n"] > 1) & rows[f"{name}_low"].isna()).sum())
        for name in metrics
    }
    without = [f"{name} in {so_many(n, 'row')}" for name, n in unknown.items() if n]
    if not without:
        return ""
    return (
        f"no confidence interval of {', '.join(without)}: all values, or all values"
        " except one, are equal and show no variation; declare `low` and `high` of the"
        " metric"
    )


def undeclared(study: Results, columns: Iterable[str]) -> list[str]:
    """Return the columns of metrics without a declared distribution.

    Only custom metrics may lack a distribution.
    """
    known = study.known_metrics
    named = {column: Column.read(column).metric for column in columns}
    return [
        column
        for column, name in named.items()
        if name in known and known[name].distribution is None
    ]


def _study(name: str, results: Path) -> dict[str, object]:
    try:
        study = StoredStudy(name, results)
        statuses = study.statuses()
        origin = study.provenance
        varied = ", ".join(study.headings)
    except UserError as error:
        return {"study": name, "error": error.reason}
    done = statuses["done"]
    missing = statuses["missing"]
    return {
        "study": name,
        "model": origin["model"],
        "preset": origin["preset"],
        "varied": varied,
        "trials": statuses.total(),
        "done": done,
        "not_done": statuses.total() - done - missing,
        "missing": missing,
        "error": "",
    }
