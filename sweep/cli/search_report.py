"""What a search found, as text for a terminal and as JSON for programs."""

import json
from io import StringIO

from rich.table import Table

from sweep.campaigns.search.asked_trials import read_asked
from sweep.campaigns.search.findings import Findings, warnings
from sweep.campaigns.search.report import (
    ReportTable,
    against_text,
    best_text,
    differences_table,
    front_table,
    judged_table,
    references_text,
    report_facts,
    searched_text,
)
from sweep.cli.terminal import Terminal
from sweep.tables.stored_study import StoredStudy

WIDTH = 10_000
"""A table takes what its cells need, and none of them is cut off."""


def text(study: StoredStudy) -> str:
    """The report of a stored search. Raises StoreError if the study is no search."""
    found = Findings(study, read_asked(study))
    parts = [
        searched_text(found),
        _warnings_text(found),
        best_text(found),
        _table_text(judged_table(found), once=True),
        _table_text(front_table(found)),
        _table_text(differences_table(found)),
        references_text(found),
        against_text(found),
    ]
    return "\n\n".join(part for part in parts if part)


def as_json(study: StoredStudy) -> str:
    """The report as JSON, see `report_facts`. Raises StoreError as `text` does."""
    return json.dumps(report_facts(Findings(study, read_asked(study))), indent=2)


def _warnings_text(found: Findings) -> str:
    return "\n".join(f"note        {sentence}" for sentence in warnings(found))


def _table_text(about: ReportTable | None, *, once: bool = False) -> str:
    """A table with its note; `once` says each candidate in its first row alone."""
    if about is None:
        return ""
    table, last = _table(*about.titles), ""
    for who, *others in about.rows:
        table.add_row("" if once and who == last else who, *others)
        last = who
    return f"{_rendered(table)}\n{about.note}"


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
