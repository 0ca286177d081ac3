"""The report of a search for the page.

The report has the tables and sentences that `sweep search` prints, and the trials
behind each row.
"""

from typing import Any

from sweep.explorer.asking import AskSearch
from sweep.explorer.points import spelled_command
from sweep.explorer.watching import Watched
from sweep.methods.search import (
    HELD_OUT,
    REFERENCES,
    SEARCH,
    Findings,
    PointsBehind,
    ReportTable,
    against_text,
    best_text,
    read_asked,
    references_text,
    report_tables,
    searched_text,
    warnings,
)
from sweep.spec import SPEC


def search(watched: Watched, question: AskSearch) -> dict[str, Any]:
    """Return the report of a search.

    - ``searched``: the extent of the search
    - ``notes``: warnings to know before believing the report
    - ``best``: the best parameters, in the form of a spec
    - ``tables``: tables with the ids of the points behind each row
    - ``said``: sentences on references and on random search
    - ``command``: the command that prints the report

    Raises ChoiceError for a study that is not a search.
    """
    study = watched.narrow(question.study)
    table = read_asked(study)
    findings = Findings(study, table)
    behind = PointsBehind(study, table)
    again = table.description["repetitions"]
    options = {"--repetitions": [str(again)] if again else []}
    spec = str(study.store.folder / SPEC)
    comparisons = (references_text(findings), against_text(findings))
    return {
        "searched": searched_text(findings),
        "notes": warnings(findings),
        "best": best_text(findings),
        "tables": [_table(part, behind) for part in report_tables(findings)],
        "said": [text for text in comparisons if text],
        "command": spelled_command("search", [spec], options, watched),
    }


def _table(table: ReportTable, behind: PointsBehind) -> dict[str, Any]:
    """Return a table with the points behind each row.

    The points of a row are the held-out trials of the candidate and of the reference. A
    candidate without held-out trials has the trials of the search instead.
    """
    judged = behind.ids(SEARCH, HELD_OUT, table.candidates)
    searched = behind.ids(SEARCH, SEARCH, table.candidates)
    references = behind.ids(REFERENCES, HELD_OUT, table.references)
    sides = zip(judged, searched, references, strict=True)
    return {
        "titles": table.titles,
        "rows": table.rows,
        "note": table.note,
        "points": [" ".join(filter(None, [a or b, c])) for a, b, c in sides],
    }
