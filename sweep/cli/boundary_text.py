"""The boundary of a refined study, for a reader in a terminal or for a program."""

import json
from collections.abc import Iterator
from typing import Any

from rich.table import Table

from sweep.analysis.refinement import Refinement
from sweep.cli.listing import MOST_ROWS
from sweep.cli.terminal import console
from sweep.tables.boundary import Boundary
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many


def boundary_json(study: StoredStudy, found: Boundary) -> str:
    """All that is known of the boundary; docs/json.md says what each key is."""
    rule, tables = found.rule, {}
    for name in ("points", "cells", "crossings"):
        table = getattr(found, name)
        tables[name] = None if table is None else json_rows(table.reset_index())
    return json.dumps(
        {
            "study": study.name,
            "metric": rule.metric,
            "at": rule.at,
            "axes": list(rule.scales),
            "until": rule.until,
            "confidence": rule.confidence,
            "budget": rule.budget,
            "trials": study.plan.num_rows,
            **tables,
        },
        indent=2,
    )


def boundary_text(study: StoredStudy, found: Boundary) -> None:
    """Print the crossings, or the cells of several axes, and what is not resolved."""
    rule, rows = found.rule, found.rows
    table = Table(
        *rows,
        title=f"{study.name}: mean {rule.metric} {_sought(rule)}",
        caption="\n".join(_notes(study, found)),
    )
    for _, row in rows.head(MOST_ROWS).iterrows():
        table.add_row(*map(_cell, row))
    out = console()
    out.print(table)
    if (more := len(rows) - MOST_ROWS) > 0:
        out.print(f"{more:,} more rows: --csv and --json give all")


def _sought(rule: Refinement) -> str:
    return rule.where if rule.steepest else f"= {rule.level:g}"


def _cell(value: Any) -> str:
    return ("yes" if value else "no") if isinstance(value, bool) else brief(value)


def _notes(study: StoredStudy, found: Boundary) -> Iterator[str]:
    rule = found.rule
    spent = so_many(study.plan.num_rows, "trial")
    right = "the interval has the place" if rule.steepest else "all sides are right"
    yield (
        f"along an axis {right} with {100.0 * rule.confidence:g} %;"
        f" {spent} of {rule.budget:,}"
    )
    left = found.cells[found.cells["state"] == "unresolved"]
    for why, cells in left.groupby("why"):
        yield f"{so_many(len(cells), 'cell')} unresolved: {why}"
    if found.crossings is not None and found.crossings.empty and left.empty:
        yield "the mean crosses the level nowhere, as far as the first grid can tell"
