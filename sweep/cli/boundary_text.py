"""The boundary of a refined study, for a reader in a terminal or for a program."""

import json
from collections.abc import Iterator
from typing import Any

import pandas as pd
from rich.table import Table

from sweep.analysis.refinement import ABOVE, BELOW, UNKNOWN, Refinement
from sweep.cli.listing import MOST_ROWS
from sweep.cli.terminal import console
from sweep.tables.boundary import Boundary
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

WORDS = {ABOVE: "above it", BELOW: "below it", UNKNOWN: "on a side that is not known"}


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
    """Print the crossings, or the cells of several axes, what is not resolved, and
    where no crossing is known.
    """
    rule, rows, out = found.rule, found.rows, console()
    title = f"{study.name}: mean {rule.metric} {_sought(rule)}"
    notes = "\n".join(_notes(study, found))
    if rows.empty:
        out.print(f"{title}\n{notes}", soft_wrap=True)
    else:
        table = Table(*rows, title=title, caption=notes)
        for _, row in rows.head(MOST_ROWS).iterrows():
            table.add_row(*map(_cell, row))
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
    if not rule.steepest:
        yield from _nowhere(found)


def _nowhere(found: Boundary) -> Iterator[str]:
    """Of each group in which no crossing is known, on which side its points lie."""
    points = found.points[~found.points["group"].isin(found.crossed)]
    groups = [part for _, part in points.groupby("group")]
    for part in groups[:MOST_ROWS]:
        at = [f"{name} = {brief(part[name].iloc[0])}" for name in found.settings]
        where = f"where {', '.join(at)}, " if at else ""
        yield (
            f"{where}the mean crosses {found.rule.level:g} nowhere, as far as the grid"
            f" can tell: {_sides(part)}"
        )
    if (more := len(groups) - MOST_ROWS) > 0:
        yield f"so it is in {so_many(more, 'other group')}: --json has all"


def _sides(points: pd.DataFrame) -> str:
    """On which side of the level points lie, in words."""
    counts = points["side"].value_counts()
    if len(counts) == 1 and UNKNOWN not in counts:
        return f"all {len(points):,} points lie {WORDS[counts.index[0]]}"
    return ", ".join(
        f"{so_many(int(counts[side]), 'point')} {words}"
        for side, words in WORDS.items()
        if side in counts
    )
