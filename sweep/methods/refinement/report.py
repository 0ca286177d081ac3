"""The report of a refined study: the boundary at which a mean crosses a level."""

from collections import Counter
from collections.abc import Iterator
from typing import Any

import pandas as pd

from sweep.methods.refinement.analysis import Boundary, find_boundary
from sweep.methods.refinement.rule import ABOVE, BELOW, UNKNOWN, Refinement
from sweep.tables import MAX_ROWS, Report, StoredStudy, TextTable, brief, json_rows
from sweep.text import so_many

WORDS = {ABOVE: "above", BELOW: "below", UNKNOWN: "on an unknown side"}


def boundary_report(study: StoredStudy, boundary: Boundary) -> Report:
    """Return the crossings, or the cells of several axes, and notes.

    Notes list unresolved cells, and groups without a known crossing. docs/json.md
    describes the keys of the JSON form.
    """
    rows = boundary.rows
    title = f"{study.name}: mean {boundary.rule.metric} {_sought(boundary.rule)}"
    notes = list(_notes(study, boundary))
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
    return Report(rows, _facts(study, boundary), parts)


def _first(rows: pd.DataFrame) -> list[list[Any]]:
    """Return the rows that a reader sees."""
    return [list(row) for _, row in rows.head(MAX_ROWS).iterrows()]


def _facts(study: StoredStudy, boundary: Boundary) -> dict[str, Any]:
    rule = boundary.rule
    tables = dict[str, Any]()
    for name in ("points", "cells", "crossings"):
        table = getattr(boundary, name)
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


def _notes(study: StoredStudy, boundary: Boundary) -> Iterator[str]:
    rule = boundary.rule
    spent = so_many(study.plan.num_rows, "trial")
    right = (
        "the interval contains the position"
        if rule.steepest
        else "all sides are correct"
    )
    yield (
        f"along an axis {right} with {100.0 * rule.confidence:g} % confidence;"
        f" {spent} of {rule.budget:,}"
    )
    left = boundary.cells[boundary.cells["state"] == "unresolved"]
    for why, cells in left.groupby("why"):
        yield f"{so_many(len(cells), 'cell')} unresolved: {why}"
    if not rule.steepest:
        yield from _nowhere(boundary)


def _nowhere(boundary: Boundary) -> Iterator[str]:
    """Yield the sides of points of each group in which no crossing is known."""
    points = boundary.points[~boundary.points["group"].isin(boundary.crossed)]
    groups = [part for _, part in points.groupby("group")]
    for part in groups[:MAX_ROWS]:
        at = [f"{name} = {brief(part[name].iloc[0])}" for name in boundary.settings]
        where = f"where {', '.join(at)}, " if at else ""
        yield (
            f"{where}no crossing of {boundary.rule.level:g} found on this grid:"
            f" {_sides(part)}"
        )
    if (more := len(groups) - MAX_ROWS) > 0:
        yield f"{so_many(more, 'more group')} without a crossing: --json lists all"


def _sides(points: pd.DataFrame) -> str:
    """Return the sides of the level on which points are, in words."""
    counts = points["side"].value_counts()
    if len(counts) == 1 and UNKNOWN not in counts:
        return f"all {len(points):,} points are {WORDS[counts.index[0]]}"
    return ", ".join(
        f"{so_many(int(counts[side]), 'point')} {phrase}"
        for side, phrase in WORDS.items()
        if side in counts
    )


def cells_in_words(study: StoredStudy) -> str:
    """Return the numbers of cells at the boundary and not resolved, in words.

    ChoiceError if the study has a fixed grid.
    """
    states = Counter(find_boundary(study).cells["state"])
    crossed = states["boundary"]
    left = states["unresolved"]
    return f"in {crossed:,} of {states.total():,} cells, {left:,} unresolved"


def why_unfinished(study: StoredStudy) -> str:
    """Return the reason for further trials, in words; "" without further trials."""
    if "refine" not in study.about.sections:
        return ""
    unresolved = (find_boundary(study).cells["state"] == "unresolved").any()
    return f"cells of {study.name} are not resolved" if unresolved else ""
