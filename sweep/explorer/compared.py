"""Two sides compared: the rows of `sweep compare`, a page at a time.

Each row has the points whose trials are behind it.
"""

from typing import Any, cast, get_args

from sweep.errors import ChoiceError
from sweep.explorer.asking import MOST_ROWS, AskComparison
from sweep.explorer.points import spelled_command
from sweep.explorer.watching import Watched
from sweep.methods.comparison import (
    Comparison,
    Inference,
    Side,
    Together,
    cells,
    compare_sides,
    comparison_facts,
    heading,
    notes,
    shared_metrics,
    side_of,
    study_named,
    telling,
    titles,
)
from sweep.spec import Column
from sweep.tables import as_csv
from sweep.text import unknown


def comparison(watched: Watched, question: AskComparison) -> dict[str, Any]:
    """Return a page of the comparison of two sides.

    `revision` identifies the stored trials of the two sides. If the page already has
    this revision, the answer has only this key. With `csv` the answer is the whole
    table, equal to the output of `sweep compare --csv`. Otherwise the answer has:

    - ``facts``: the facts of `sweep compare --json`, with the rows of this page
    - ``titles``: the titles of the columns of `cells`
    - ``cells``: the texts of each row
    - ``behind``: for each row the trials behind the row: a metric, and the id of a
      point of each side
    - ``settings``: the parameters that distinguish rows
    - ``heading``: the text above the table that `command` prints
    - ``notes``: the texts below the table
    - ``metrics``: all metrics that can be compared
    - ``corrections``: the values of `--together`

    The exceptions of `compare_sides` are raised.
    """
    names = [study_named(text) for text in (question.a, question.b)]
    revision = " ".join(watched.revision(name) for name in names)
    if question.known_revision == revision:
        return {"revision": revision}
    a, b = (
        side_of(text, watched.whole(name))
        for text, name in zip((question.a, question.b), names, strict=True)
    )
    compared = _compared(a, b, question)
    if question.csv:
        return {"csv": as_csv(compared.rows)}
    start = question.page * MOST_ROWS
    shown = compared.rows.iloc[start : start + MOST_ROWS]
    facts = comparison_facts(compared)
    return {
        "revision": revision,
        "facts": {**facts, "rows": facts["rows"][start : start + MOST_ROWS]},
        "titles": titles(compared),
        "cells": cells(compared, shown),
        "behind": [_behind(compared, place) for place in shown.index],
        "settings": telling(compared.matching.settings),
        "total": len(compared.rows),
        "page": question.page,
        "size": MOST_ROWS,
        "heading": list(heading(compared)),
        "notes": list(notes(compared)),
        "metrics": shared_metrics(a, b, ()),
        "corrections": list(get_args(Together)),
        "command": comparison_command(watched, question),
    }


def _behind(compared: Comparison, place: int) -> dict[str, str]:
    """Return the metric and the two points behind the row at an index."""
    pairs = compared.matching.points
    metric = Column.read(compared.rows["metric"].iloc[place]).metric
    a, b = pairs[place % len(pairs)]
    return {"metric": metric, "a": a, "b": b}


def _compared(a: Side, b: Side, question: AskComparison) -> Comparison:
    corrections = get_args(Together)
    if question.together not in corrections:
        raise ChoiceError(unknown("correction", question.together, corrections))
    together = cast(Together, question.together)
    method = Inference(question.confidence, together, question.margin)
    return compare_sides(a, b, question.metric, half=question.half, method=method)


def comparison_command(watched: Watched, question: AskComparison) -> str:
    """Return the command that prints the comparison."""
    usual = Inference()
    options = {
        "--metric": question.metric,
        "--over": ["half"] if question.half else [],
        "--margin": [] if question.margin is None else [str(question.margin)],
        "--confidence": (
            []
            if question.confidence == usual.confidence
            else [str(question.confidence)]
        ),
        "--together": []
        if question.together == usual.together
        else [question.together],
    }
    return spelled_command("compare", [question.a, question.b], options, watched)
