"""Two sides compared, for the page: the rows of `sweep compare`, some at a time, each
with the points whose trials stand behind it.
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
from sweep.spec.recorded import Column
from sweep.tables.safe_csv import as_csv
from sweep.text import unknown


def comparison(watched: Watched, asked: AskComparison) -> dict[str, Any]:
    """A page of the comparison.

    `revision` is a word for what is stored of both sides; where the page has seen it,
    only that is answered. `facts` are those of `sweep compare --json` with the rows of
    this page; `cells` has the texts of each row below `titles`, and `behind` says for
    each whose trials it rests on: a metric, and a point of side a and of side b, by
    their ids. `settings` are those that tell rows apart. `heading` and `notes` stand
    above and below the table that `command` prints. `metrics` can be compared, and
    `corrections` are the words of `--together`.
    With `csv` the whole table is `csv`, as `sweep compare --csv` prints it. Raises
    ChoiceError as `compare_sides`.
    """
    names = [study_named(text) for text in (asked.a, asked.b)]
    revision = " ".join(watched.revision(name) for name in names)
    if asked.seen == revision:
        return {"revision": revision}
    one, other = (
        side_of(text, watched.whole(name))
        for text, name in zip((asked.a, asked.b), names, strict=True)
    )
    found = _compared(one, other, asked)
    if asked.csv:
        return {"csv": as_csv(found.rows)}
    start = asked.page * MOST_ROWS
    shown = found.rows.iloc[start : start + MOST_ROWS]
    facts = comparison_facts(found)
    return {
        "revision": revision,
        "facts": {**facts, "rows": facts["rows"][start : start + MOST_ROWS]},
        "titles": titles(found),
        "cells": cells(found, shown),
        "behind": [_behind(found, place) for place in shown.index],
        "settings": telling(found.matching.settings),
        "total": len(found.rows),
        "page": asked.page,
        "size": MOST_ROWS,
        "heading": list(heading(found)),
        "notes": list(notes(found)),
        "metrics": shared_metrics(one, other, ()),
        "corrections": list(get_args(Together)),
        "command": comparison_command(watched, asked),
    }


def _behind(found: Comparison, place: int) -> dict[str, str]:
    """Whose trials stand behind the row at a place."""
    pairs = found.matching.points
    metric = Column.read(found.rows["metric"].iloc[place]).metric
    a, b = pairs[place % len(pairs)]
    return {"metric": metric, "a": a, "b": b}


def _compared(one: Side, other: Side, asked: AskComparison) -> Comparison:
    corrections = get_args(Together)
    if asked.together not in corrections:
        raise ChoiceError(unknown("correction", asked.together, corrections))
    together = cast(Together, asked.together)
    method = Inference(asked.confidence, together, asked.margin)
    return compare_sides(one, other, asked.metric, half=asked.half, method=method)


def comparison_command(watched: Watched, asked: AskComparison) -> str:
    """The command that prints the comparison."""
    usual = Inference()
    options = {
        "--metric": asked.metric,
        "--over": ["half"] if asked.half else [],
        "--margin": [] if asked.margin is None else [str(asked.margin)],
        "--confidence": (
            [] if asked.confidence == usual.confidence else [str(asked.confidence)]
        ),
        "--together": [] if asked.together == usual.together else [asked.together],
    }
    return spelled_command("compare", [asked.a, asked.b], options, watched)
