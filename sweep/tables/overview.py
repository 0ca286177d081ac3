"""The studies in a folder of results, and how far each is; how many points of one are
still without a trial.
"""

from pathlib import Path

import pandas as pd

from sweep.errors import UserError
from sweep.spec.study_folder import launched_studies
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

COUNTS = ("trials", "done", "not_done", "missing")


def studies(results: Path) -> pd.DataFrame:
    """A row a study: `study`, `model`, `preset`, `trials`, `done`, `not_done`,
    `missing`, and `error`, which says why it cannot be read, if it cannot.
    """
    rows = [_study(name, results) for name in launched_studies(results)]
    columns = ["study", "model", "preset", *COUNTS, "error"]
    return pd.DataFrame(rows, columns=columns).astype(dict.fromkeys(COUNTS, "Int64"))


def untried(study: StoredStudy) -> str:
    """How many of the points have no stored trial, in words; "" where all have one."""
    if not study.untried:
        return ""
    number = f"{study.untried:,} of {so_many(len(study.points), 'point')}"
    return f"{number} {'has' if study.untried == 1 else 'have'} no trial yet"


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
