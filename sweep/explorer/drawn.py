"""Figures for the page: the marks of a kind of figure, and the command that draws the
same one.
"""

from typing import Any, NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.explorer.asking import AskFigure
from sweep.explorer.points import spelled_command
from sweep.explorer.watching import Watched
from sweep.figures.kinds import KINDS
from sweep.figures.marks import FigureMarks, MarkedAxis, MarkedPanel, thinned
from sweep.figures.planning import Choices, FigureKind
from sweep.figures.selection import has_scale, select
from sweep.tables.json_rows import json_rows
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown


def figure(watched: Watched, asked: AskFigure) -> dict[str, Any]:
    """The marks of a figure, see `sweep.figures.marks`, each panel with its `marks` as
    lists by column, and what the page may choose next.

    `kind` is the one that is shown and `kinds` has all, each with the reason why it
    does not suit, or "". `command` draws the same figure. Raises ChoiceError as `sweep
    plot`.
    """
    study, reasons, chosen, choices = _choose(watched, asked)
    offered = {name: KINDS[name] for name in reasons}
    marks = thinned(_marks(offered[chosen], study, choices))
    return {
        "kind": chosen,
        "kinds": {name: _about(name, reasons) for name in offered},
        "takes": offered[chosen].takes,
        "settings": [str(name) for name in select(study).points.columns],
        "form": marks.form,
        "panels": [_panel(panel) for panel in marks.panels],
        "by": marks.by,
        "values": marks.values,
        "colours": marks.colours,
        "note": marks.note,
        "thinned": marks.thinned,
        "metrics": marks.metrics,
        "command": figure_command(
            watched, asked, chosen, choices._replace(metrics=marks.metrics)
        ),
    }


def drawn(watched: Watched, asked: AskFigure) -> Figure:
    """The same figure as `sweep plot` draws it. Raises ChoiceError as `figure`."""
    study, _, chosen, choices = _choose(watched, asked)
    return KINDS[chosen].figures(study, choices)[0].draw()


class _Chosen(NamedTuple):
    """What a figure is of, and why other kinds do not suit, "" for those that do."""

    study: StoredStudy
    reasons: dict[str, str]
    kind: str
    choices: Choices


def _choose(watched: Watched, asked: AskFigure) -> _Chosen:
    offered = {name: kind for name, kind in KINDS.items() if kind.marks}
    if asked.kind and asked.kind not in offered:
        raise ChoiceError(unknown("kind", asked.kind, offered), asked.study)
    study = watched.narrow(asked.study, asked.metric).where(*asked.where)
    for setting in filter(None, (asked.x, asked.y, asked.by)):
        select(study).setting(setting)
    reasons = {name: _why_not(kind, study, asked) for name, kind in offered.items()}
    chosen = asked.kind or _suiting(study, reasons)
    choices = _choices(offered[chosen], asked)
    return _Chosen(study, reasons, chosen, choices)


def figure_command(
    watched: Watched, asked: AskFigure, kind: str, choices: Choices
) -> str:
    """The command that draws the figure."""
    options = {
        "--metric": choices.metrics,
        "--x": [choices.x] if choices.x else [],
        "--y": [choices.y] if choices.y else [],
        "--by": [choices.by] if choices.by else [],
        "--where": asked.where,
        "--over": ["half"] if asked.half else [],
    }
    return spelled_command("plot", [asked.study, kind], options, watched)


def _choices(kind: FigureKind, asked: AskFigure) -> Choices:
    """What is asked for, as far as the kind takes it."""
    taken = {
        name: getattr(asked, name) or None
        for name in ("by", "x", "y")
        if name in kind.takes
    }
    return Choices(metrics=asked.metric, half=asked.half, **taken)


def _marks(kind: FigureKind, study: StoredStudy, choices: Choices) -> FigureMarks:
    assert kind.marks
    return kind.marks(study, choices)


def _why_not(kind: FigureKind, study: StoredStudy, asked: AskFigure) -> str:
    return kind.suits(study, _choices(kind, asked))


def _about(name: str, reasons: dict[str, str]) -> dict[str, str]:
    return {"text": KINDS[name].text, "why_not": reasons[name]}


def _suiting(study: StoredStudy, reasons: dict[str, str]) -> str:
    """The kind that suits: the first of those of a search, else the one with as many
    axes of settings as there are settings with a scale and more than a few values. It
    shows numbers, not how well they are known. Raises ChoiceError where none suits.
    """
    numbers = [name for name in reasons if not KINDS[name].of_precision]
    suiting = [name for name in numbers if not reasons[name]]
    if not suiting:
        select(study)  # without a done trial that is the one reason
        why = "; ".join(f"{name}: {reason}" for name, reason in reasons.items())
        raise ChoiceError(f"no figure suits it: {why}", study.name)
    if of_search := [name for name in suiting if KINDS[name].of_search]:
        return of_search[0]
    points = select(study).points
    scaled = [name for name in points if has_scale(points[name])]
    axes = min(sum(points[name].nunique() > 2 for name in scaled) or len(scaled), 2)
    return min(suiting, key=lambda name: abs(_axes_of(KINDS[name]) - axes))


def _axes_of(kind: FigureKind) -> int:
    return sum(axis in kind.takes for axis in ("x", "y"))


def _panel(panel: MarkedPanel) -> dict[str, Any]:
    return {
        "title": panel.title,
        "x": _axis(panel.x),
        "y": _axis(panel.y),
        "edges": panel.edges,
        "line": panel.line._asdict(),
        "marks": _columns_and_data(panel.marks),
    }


def _columns_and_data(marks: pd.DataFrame) -> dict[str, Any]:
    rows = [[*row.values()] for row in json_rows(marks)]
    return {"columns": [*marks], "data": rows}


def _axis(axis: MarkedAxis) -> dict[str, Any]:
    return axis._asdict()
