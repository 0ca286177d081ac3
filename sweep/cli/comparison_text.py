"""A comparison for a reader in a terminal, or as JSON for a program."""

import json

from rich.box import SIMPLE_HEAD
from rich.table import Table

from sweep.cli.listing import MOST_ROWS
from sweep.cli.terminal import console
from sweep.tables.comparison import Comparison
from sweep.tables.comparison_facts import comparison_facts
from sweep.tables.comparison_words import (
    VERDICT,
    cells,
    heading,
    metric_named,
    notes,
    summary,
    titles,
)
from sweep.tables.matched_points import telling


def comparison_text(comparison: Comparison) -> None:
    """Print a comparison: what is compared, a row for each point and metric, how to
    read the table, and a summary.
    """
    out = console()
    for line in heading(comparison):
        out.print(line, soft_wrap=True)
    out.print(_table(comparison))
    if len(comparison.rows) > MOST_ROWS:
        out.print(
            f"{len(comparison.rows) - MOST_ROWS:,} more rows: --csv and --json give all"
        )
    for line in (*notes(comparison), "", *summary(comparison)):
        out.print(line, soft_wrap=True)


def comparison_json(comparison: Comparison) -> str:
    """The comparison as JSON, see `comparison_facts`."""
    return json.dumps(comparison_facts(comparison), indent=2)


def _table(comparison: Comparison) -> Table:
    """The metric stands once above its rows, as the title where there is one only."""
    rows = comparison.rows
    several = rows["metric"].nunique() > 1
    table = Table(
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title=None if several else metric_named(rows.iloc[0]),
    )
    left = ("metric", *telling(comparison.matching.settings), VERDICT)
    for title in titles(comparison)[0 if several else 1 :]:
        table.add_column(title, justify="left" if title in left else "right")
    last = ""
    for metric, *others in cells(comparison, rows.head(MOST_ROWS)):
        if several and metric != last:
            table.add_section()
        named = [metric if metric != last else ""] if several else []
        table.add_row(*named, *others)
        last = metric
    return table
