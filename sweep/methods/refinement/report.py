"""The report of a refined study: where a mean crosses a level."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pandas as pd

from sweep.methods.refinement.analysis import Boundary, find_boundary
from sweep.methods.refinement.rule import ABOVE, BELOW, UNKNOWN, Refinement
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief
from sweep.tables.reports import MAX_ROWS, Report, TextTable
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

WORDS = {ABOVE: "above it", BELOW: "below it", UNKNOWN: "on a side that is not known"}


def boundary_report(study: StoredStudy, found: Boundary) -> Report:
    """Return the crossings, or the cells of several axes, what is not resolved, and
    where no crossing is known; docs/json.md says what each key is.
    """
    rows = found.rows
    title = f"{study.name}: mean {found.rule.metric} {_sought(found.rule)}"
    notes = list(_notes(study, found))
    parts: list[TextTable | str] = [title, *notes]
    if not rows.empty:
        table = TextTable(
            columns=[str(name) for name in rows],
            rows=[[_cell(value) for value in row] for row in _first(rows)],
            title=title,
            caption="\n".join(notes),
            hidden=max(len(rows) - MAX_ROWS, 0),
        )
        parts = [table]
    return Report(rows, _facts(study, found), parts)


def _first(rows: pd.DataFrame) -> list[list[Any]]:
    """The rows that a reader sees."""
    return [list(row) for _, row in rows.head(MAX_ROWS).iterrows()]


def _facts(study: StoredStudy, found: Boundary) -> dict[str, Any]:
    rule = found.rule
    tables = dict[str, Any]()
    for name in ("points", "cells", "crossings"):
        table = getattr(found, name)
        tables[name] = None if table is None else json_rows(table.reset_index())
    return {
        "study": study.name,
        "metric": rule.metric,
        "at": rule.at,
        "axes": list(rule.scales),
        "until": rule.until,
        "confidence": rule.confidence,
        "budget": rule.budget,
        "trials": study.plan.num_rows,
        **tables,
    }


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
    for part in groups[:MAX_ROWS]:
        at = [f"{name} = {brief(part[name].iloc[0])}" for name in found.settings]
        where = f"where {', '.join(at)}, " if at else ""
        yield (
            f"{where}the mean crosses {found.rule.level:g} nowhere, as far as the grid"
            f" can tell: {_sides(part)}"
        )
    if (more := len(groups) - MAX_ROWS) > 0:
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


def cells_in_words(study: StoredStudy) -> str:
    """Return how many cells the boundary of a refined study goes through, and how many
    are not resolved. Raises ChoiceError for a study with a fixed grid.
    """
    states = Counter(find_boundary(study).cells["state"])
    crossed, left = states["boundary"], states["unresolved"]
    return f"in {crossed:,} of {states.total():,} cells, {left:,} unresolved"


def why_unfinished(study: StoredStudy) -> str:
    """Return why more trials follow, in words, or "" where none do."""
    if "refine" not in study.about.sections:
        return ""
    unresolved = (find_boundary(study).cells["state"] == "unresolved").any()
    return f"cells of {study.name} are not resolved" if unresolved else ""
