"""The studies in a folder of results, and how far each is; what to know of the means of
one: how many points are without a trial, and which have few and skewed values.
"""

from collections.abc import Iterable, Mapping
from pathlib import Path

import pandas as pd

from sweep.analysis.mean_bounds import FEW, in_full
from sweep.errors import UserError
from sweep.spec.recorded import Column
from sweep.spec.study_folder import launched_studies
from sweep.store.finding import check_folder
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

COUNTS = ("trials", "done", "not_done", "missing")


def studies(results: Path) -> pd.DataFrame:
    """A row a study: `study`, `model`, `preset`, `trials`, `done`, `not_done`,
    `missing`, and `error`, which says why it cannot be read, if it cannot. Raises
    StoreError where there is no such folder.
    """
    check_folder(results)
    rows = [_study(name, results) for name in launched_studies(results)]
    columns = ["study", "model", "preset", *COUNTS, "error"]
    return pd.DataFrame(rows, columns=columns).astype(dict.fromkeys(COUNTS, "Int64"))


def untried(study: StoredStudy) -> str:
    """How many of the points have no stored trial, in words; "" where all have one."""
    if not study.untried:
        return ""
    number = f"{study.untried:,} of {so_many(len(study.points), 'point')}"
    return f"{number} {'has' if study.untried == 1 else 'have'} no trial yet"


def few_skewed(study: StoredStudy, counts: Mapping[str, Iterable[int]]) -> str:
    """A sentence about the intervals of skewed metrics of which a point has 2 to FEW
    values; "" where there are none. `counts` has the numbers of values by column.
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
        f"{' and '.join(few)}: 2 to {FEW} skewed values cannot show a long tail, so"
        " their intervals may cover the mean with less than 95 %"
    )


def constant(rows: pd.DataFrame, metrics: Iterable[str]) -> str:
    """A sentence about the metrics without an interval in some `rows`, as of
    `by_point`, which have several values; "" where there are none.
    """
    unknown = {
        name: int(((rows[f"{name}_n"] > 1) & rows[f"{name}_low"].isna()).sum())
        for name in metrics
    }
    without = [f"{name} in {so_many(n, 'row')}" for name, n in unknown.items() if n]
    if not without:
        return ""
    return (
        f"no interval of {', '.join(without)}: all values are equal, or all but one,"
        " and do not show how much they vary; `low` and `high` of a metric would"
    )


def undeclared(study: StoredStudy, columns: Iterable[str]) -> list[str]:
    """The columns of metrics that declare no distribution, as own ones may."""
    known = study.known.metrics
    named = {column: Column.read(column).metric for column in columns}
    return [
        column
        for column, name in named.items()
        if name in known and known[name].distribution is None
    ]


def _study(name: str, results: Path) -> dict[str, object]:
    try:
        study = StoredStudy(name, results)
        statuses, about = study.statuses(), study.provenance
    except UserError as error:
        return {"study": name, "error": error.reason}
    done, missing = statuses["done"], statuses["missing"]
    return {
        "study": name,
        "model": about["model"],
        "preset": about["preset"],
        "trials": statuses.total(),
        "done": done,
        "not_done": statuses.total() - done - missing,
        "missing": missing,
        "error": "",
    }
