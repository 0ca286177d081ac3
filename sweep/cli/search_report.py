"""The report of a search, as text for a terminal and as JSON for programs."""

import json
from io import StringIO

from rich.table import Table

from sweep.cli.terminal import Terminal
from sweep.methods.search import (
    Findings,
    ReportTable,
    against_text,
    best_text,
    differences_table,
    front_table,
    judged_table,
    read_asked,
    references_text,
    report_facts,
    searched_text,
    warnings,
)
from sweep.tables import StoredStudy

WIDTH = 10_000
"""The width of a table in characters, so large that no cell is cut off."""


def text(study: StoredStudy) -> str:
    """Return the report of a stored search.

    Raises
    ------
    ChoiceError
        The study is not a search, or `where` has restricted it.
    StoreError
        The search has a statistic or distribution that is unknown here.
    """
    findings = Findings(study, read_asked(study))
    parts = [
        searched_text(findings),
        _warnings_text(findings),
        best_text(findings),
        _table_text(judged_table(findings), once=True),
        _table_text(front_table(findings)),
        _table_text(differences_table(findings)),
        references_text(findings),
        against_text(findings),
    ]
    return "\n\n".join(part for part in parts if part)


def as_json(study: StoredStudy) -> str:
    """Return the report as JSON, see `report_facts`.

    Raises
    ------
    ChoiceError
        The study is not a search, or `where` has restricted it.
    StoreError
        The search has a statistic or distribution that is unknown here.
    """
    return json.dumps(report_facts(Findings(study, read_asked(study))), indent=2)


def _warnings_text(findings: Findings) -> str:
    return "\n".join(f"note        {sentence}" for sentence in warnings(findings))


def _table_text(table: ReportTable | None, *, once: bool = False) -> str:
    """Return a table with its note; `once` names a candidate only in its first row."""
    if table is None:
        return ""
    shown = _table(*table.titles)
    last = ""
    for candidate, *cells in table.rows:
        shown.add_row("" if once and candidate == last else candidate, *cells)
        last = candidate
    return f"{_rendered(shown)}\n{table.note}"


def _table(*columns: str) -> Table:
    table = Table()
    for column in columns:
        table.add_column(column, no_wrap=True)
    return table


def _rendered(table: Table) -> str:
    stream = StringIO()
    # Without these options rich would display the table at once in a notebook, and
    # would use bold type where FORCE_COLOR is set.
    Terminal(file=stream, width=WIDTH, force_jupyter=False, force_terminal=False).print(
        table
    )
    return stream.getvalue().rstrip("\n")
