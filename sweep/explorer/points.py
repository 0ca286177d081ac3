"""The table of a study for the page: the rows of `sweep table`, a page at a time.

Each cell has the text that `sweep table` prints.
"""

import shlex
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from sweep.explorer.asking import MOST_ROWS, AskPoints
from sweep.explorer.watching import Watched
from sweep.tables import (
    PointMeans,
    StoredStudy,
    as_csv,
    brief,
    caption,
    cell_text,
    json_rows,
    point_means,
    point_rows,
)


def points(watched: Watched, question: AskPoints) -> dict[str, Any]:
    """Return a page of the table.

    `rows` equal the rows of `sweep table --json`. `points` has, per row, the id of the
    point; the list is empty for a table that pools points. `cells` has, per row, the
    texts of headings and metrics. With `csv` the answer is the whole table, equal to
    the output of `sweep table --csv`.
    """
    study = watched.narrow(question.study, question.metric).where(*question.where)
    by = list(question.by) or None
    table = point_means(
        study, question.metric, by=by, sort=question.sort, half=question.half
    )
    if question.csv:
        return {"csv": as_csv(point_rows(study, table))}
    start = question.page * MOST_ROWS
    shown = table.rows.iloc[start : start + MOST_ROWS]
    point = study.trials.set_index("trial_id")["point"]
    ids = [] if table.pooled else point.reindex(shown["trial_id"]).tolist()
    rows = json_rows(point_rows(study, table).loc[shown.index])
    named = (*table.headings, *table.metrics)
    return {
        "headings": [*table.headings, *(["points"] if table.pooled else [])],
        "metrics": table.metrics,
        "units": {name: study.units.get(name, "") for name in named},
        "total": len(table.rows),
        "page": question.page,
        "size": MOST_ROWS,
        "rows": rows,
        "points": ids,
        "cells": [_cells(study, row, table) for _, row in shown.iterrows()],
        "caption": caption(study, table),
        "command": table_command(watched, question),
    }


def _cells(study: StoredStudy, row: "pd.Series[Any]", table: PointMeans) -> list[str]:
    headings = [*table.headings, *(["points"] if table.pooled else [])]
    texts = [brief(row[name]) for name in headings]
    return texts + [cell_text(study, row, name, table) for name in table.metrics]


def table_command(watched: Watched, question: AskPoints) -> str:
    """Return the command that prints the table."""
    by = [",".join(question.by)] if question.by else []
    over = ["half"] if question.half else []
    options = {
        "--metric": question.metric,
        "--over": over,
        "--where": question.where,
        "--by": by,
        "--sort": question.sort,
    }
    return spelled_command("table", [question.study], options, watched)


def spelled_command(
    verb: str,
    names: Iterable[str],
    options: Mapping[str, Iterable[str]],
    watched: Watched,
) -> str:
    """Return a command in the syntax of a shell.

    Parameters
    ----------
    verb : str
        Command of `sweep`.
    names : iterable of str
        Positional arguments of the command.
    options : mapping of str to iterable of str
        Values by option; an option appears once per value.
    watched : Watched
        The stored studies. The command names the folder, except for `results`.
    """
    arguments = ["sweep", verb, *names]
    for option, values in options.items():
        for value in values:
            arguments += [option, value]
    if str(watched.results) != "results":
        arguments += ["--results", str(watched.results)]
    return shlex.join(arguments)
