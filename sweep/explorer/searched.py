"""The report of a search for the page: the tables and sentences that `sweep search`
prints, and behind each row its trials.
"""

from typing import Any

from sweep.campaigns.search.asked_trials import read_asked
from sweep.campaigns.search.findings import Findings, warnings
from sweep.campaigns.search.outcome import HELD_OUT, REFERENCES, SEARCH
from sweep.campaigns.search.points_behind import PointsBehind
from sweep.campaigns.search.report import (
    ReportTable,
    against_text,
    best_text,
    references_text,
    report_tables,
    searched_text,
)
from sweep.explorer.asking import AskSearch
from sweep.explorer.points import spelled_command
from sweep.explorer.watching import Watched
from sweep.spec.study_folder import SPEC


def search(watched: Watched, asked: AskSearch) -> dict[str, Any]:
    """The report: what was `searched`, `notes` to know before believing it, the `best`
    settings as a spec has them, `tables` with the ids of the points behind each row,
    what is `said` of references and of random search, and the `command` that prints it.

    Raises ChoiceError for a study that is no search.
    """
    study = watched.narrow(asked.study)
    table = read_asked(study)
    found, behind = Findings(study, table), PointsBehind(study, table)
    again = table.about["repetitions"]
    options = {"--repetitions": [str(again)] if again else []}
    spec = str(study.store.folder / SPEC)
    said = (references_text(found), against_text(found))
    return {
        "searched": searched_text(found),
        "notes": warnings(found),
        "best": best_text(found),
        "tables": [_table(one, behind) for one in report_tables(found)],
        "said": [text for text in said if text],
        "command": spelled_command("search", [spec], options, watched),
    }


def _table(table: ReportTable, behind: PointsBehind) -> dict[str, Any]:
    """A table, and for each row the held-out trials of its candidate and reference, or
    what the search has seen of a candidate that has none.
    """
    chosen = behind.ids(SEARCH, HELD_OUT, table.candidates)
    seen = behind.ids(SEARCH, SEARCH, table.candidates)
    others = behind.ids(REFERENCES, HELD_OUT, table.references)
    sides = zip(chosen, seen, others, strict=True)
    return {
        "titles": table.titles,
        "rows": table.rows,
        "note": table.note,
        "points": [" ".join(filter(None, [a or b, c])) for a, b, c in sides],
    }
