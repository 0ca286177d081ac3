"""The table of a study for the page: the rows of `sweep table`, some at a time, with
the text of each cell as it stands there.
"""

import shlex
from collections.abc import Iterable, Mapping
from typing import Any

import pandas as pd

from sweep.explorer.asking import MOST_ROWS, AskPoints
from sweep.explorer.watching import Watched
from sweep.tables.json_rows import json_rows
from sweep.tables.means_text import brief, caption, cell_text, point_rows
from sweep.tables.point_means import PointMeans, point_means
from sweep.tables.safe_csv import as_csv
from sweep.tables.stored_study import StoredStudy


def points(watched: Watched, asked: AskPoints) -> dict[str, Any]:
    """A page of the table.

    `rows` are those of `sweep table --json`, with `point`, the id of the point, or ""
    where a row pools several; `cells` has for each row the texts of its headings and
    metrics. With `csv` the whole table is `csv`, as `sweep table --csv` prints it.
    """
    study = watched.narrow(asked.study, asked.metric).where(*asked.where)
    by = list(asked.by) or None
    table = point_means(study, asked.metric, by=by, sort=asked.sort, half=asked.half)
    if asked.csv:
        return {"csv": as_csv(point_rows(study, table))}
    start = asked.page * MOST_ROWS
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
        "page": asked.page,
        "size": MOST_ROWS,
        "rows": rows,
        "points": ids,
        "cells": [_cells(study, row, table) for _, row in shown.iterrows()],
        "caption": caption(study, table),
        "command": table_command(watched, asked),
    }


def _cells(study: StoredStudy, row: "pd.Series[Any]", table: PointMeans) -> list[str]:
    headings = [*table.headings, *(["points"] if table.pooled else [])]
    said = [brief(row[name]) for name in headings]
    return said + [cell_text(study, row, name, table) for name in table.metrics]


def table_command(watched: Watched, asked: AskPoints) -> str:
    """The command that prints the table."""
    by = [",".join(asked.by)] if asked.by else []
    over = ["half"] if asked.half else []
    options = {
        "--metric": asked.metric,
        "--over": over,
        "--where": asked.where,
        "--by": by,
        "--sort": asked.sort,
    }
    return spelled_command("table", [asked.study], options, watched)


def spelled_command(
    verb: str,
    names: Iterable[str],
    options: Mapping[str, Iterable[str]],
    watched: Watched,
) -> str:
    """A command as a shell takes it; the folder of results is named unless it is the
    usual one.
    """
    words = ["sweep", verb, *names]
    for option, values in options.items():
        for value in values:
            words += [option, value]
    if str(watched.results) != "results":
        words += ["--results", str(watched.results)]
    return shlex.join(words)
