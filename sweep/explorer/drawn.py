"""Figures for the page: the marks, the command, and the files of a figure."""

import base64
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.explorer.asking import AskFigure, AskFile
from sweep.explorer.points import spelled_command
from sweep.explorer.watching import Watched
from sweep.figures import (
    DRAWING,
    FORMATS,
    KINDS,
    Choices,
    FigureKind,
    FigureMarks,
    MarkedAxis,
    MarkedPanel,
    PrintSize,
    draw_figures,
    has_scale,
    plan_figures,
    select,
    thinned,
)
from sweep.tables import StoredStudy, json_rows
from sweep.text import unknown

WIDTHS = ("89", "183")
"""Widths in mm that the page offers: one and two columns of a journal."""


def figure(watched: Watched, question: AskFigure) -> dict[str, Any]:
    """Return the marks of a figure, and the choices that the page offers next.

    For the marks, see `sweep.figures.marks`; each panel has `marks` as lists by column.
    `kind` is the shown kind. `kinds` has all kinds, each with the reason why the kind
    does not suit, or ""; kinds for searches are left out for other studies. `settings`
    are the parameters that vary freely. `command` draws the figure. `refusal` is the
    reason why the figure cannot be drawn, or ""; choices can change a figure that
    cannot be drawn. ChoiceError is raised for an unknown name.
    """
    study, reasons, chosen, choices, trials_why_not = _choose(watched, question)
    selection = select(study)
    marks, refusal = _marks_or_reason(chosen, study, choices)
    return {
        "kind": chosen,
        "kinds": {
            name: _about(name, reasons)
            for name in reasons
            if name == chosen or not (KINDS[name].of_search and reasons[name])
        },
        "refusal": refusal,
        "takes": KINDS[chosen].takes,
        "trials_why_not": trials_why_not,
        "settings": [
            str(name) for name in selection.points if name not in selection.derived
        ],
        "form": marks.form,
        "panels": [_panel(panel) for panel in marks.panels],
        "by": marks.by,
        "values": marks.values,
        "colours": marks.colours,
        "note": marks.note,
        "thinned": marks.thinned,
        "linear": marks.linear,
        "metrics": marks.metrics,
        "formats": FORMATS,
        "widths": WIDTHS,
        "command": figure_command(
            watched, question, chosen, choices._replace(metrics=marks.metrics)
        ),
    }


def drawn(watched: Watched, question: AskFigure) -> Figure:
    """Return the figure that `sweep plot` draws.

    The exceptions of `figure` are raised.
    """
    study, _, chosen, choices, _ = _choose(watched, question)
    return KINDS[chosen].figures(study, choices)[0].draw()


def file(watched: Watched, question: AskFile) -> dict[str, str]:
    """Return the file that the command of a figure writes with `--format`.

    `name` is the name of the file, and `base64` the content. The exceptions of `figure`
    are raised. ChoiceError is also raised for an unknown format, and while another file
    is drawn.
    """
    if question.format not in FORMATS:
        raise ChoiceError(unknown("format", question.format, FORMATS))
    study, _, chosen, choices, _ = _choose(watched, question)
    shown = thinned(_marks(KINDS[chosen], study, choices)).metrics
    plot = plan_figures(study, [chosen], choices._replace(metrics=shown))
    size = PrintSize(float(question.width)) if question.width else None
    with _alone(), TemporaryDirectory() as folder:
        first = plot._replace(figures=plot.figures[:1])
        formats = [question.format]
        (path,) = draw_figures(study, first, Path(folder), formats, size=size)
        content = base64.b64encode(path.read_bytes()).decode()
    return {"name": path.name, "base64": content}


@contextmanager
def _alone() -> Iterator[None]:
    """Reject a drawing while another thread draws: a waiting thread answers no page."""
    if not DRAWING.acquire(blocking=False):
        raise ChoiceError("another file is drawn at the moment; repeat the request")
    try:
        yield
    finally:
        DRAWING.release()


class _Chosen(NamedTuple):
    """A kind of figure of a study, and the arguments.

    `reasons` has, per kind, the reason why the kind does not suit; "" for a suitable
    kind. `trials_why_not` is the reason why single trials cannot be drawn, or "".
    """

    study: StoredStudy
    reasons: dict[str, str]
    kind: str
    choices: Choices
    trials_why_not: str


def _choose(watched: Watched, question: AskFigure) -> _Chosen:
    offered = {name: kind for name, kind in KINDS.items() if kind.marks}
    if question.kind and question.kind not in offered:
        raise ChoiceError(unknown("kind", question.kind, offered), question.study)
    if question.width not in ("", *WIDTHS):
        raise ChoiceError(unknown("width in mm", question.width, WIDTHS))
    study = watched.narrow(question.study, question.metric).where(*question.where)
    for setting in filter(None, (question.x, question.y, question.by)):
        select(study).setting(setting)
    reasons = {name: _why_not(kind, study, question) for name, kind in offered.items()}
    chosen = question.kind or _suiting(study, reasons)
    choices = _choices(offered[chosen], question)
    why_not = _why_no_trials(chosen, study, choices)
    choices = choices._replace(trials=question.trials and not why_not)
    return _Chosen(study, reasons, chosen, choices, trials_why_not=why_not)


def figure_command(
    watched: Watched, question: AskFigure, kind: str, choices: Choices
) -> str:
    """Return the command that draws the figure.

    Parameters
    ----------
    watched : Watched
        The stored studies.
    question : AskFigure
        Names the study and the selection of points.
    kind : str
        Name of the kind of figure.
    choices : Choices
        Metrics, axes and colours of the figure.
    """
    options = {
        "--metric": choices.metrics,
        "--x": [choices.x] if choices.x else [],
        "--y": [choices.y] if choices.y else [],
        "--by": [choices.by] if choices.by else [],
        "--where": question.where,
        "--over": ["half"] if question.half else [],
        "--width": [question.width] if question.width else [],
    }
    names = [question.study, kind, *(["--trials"] if choices.trials else [])]
    return spelled_command("plot", names, options, watched)


def _choices(kind: FigureKind, question: AskFigure) -> Choices:
    """Return the arguments of the question that the kind takes."""
    taken: dict[str, Any] = {
        name: getattr(question, name) or None
        for name in ("by", "x", "y")
        if name in kind.takes
    }
    return Choices(metrics=question.metric, half=question.half, **taken)


def _marks_or_reason(
    name: str, study: StoredStudy, choices: Choices
) -> tuple[FigureMarks, str]:
    """Return the marks of a figure and "", or no marks and the reason."""
    try:
        return thinned(_marks(KINDS[name], study, choices)), ""
    except ChoiceError as error:
        return FigureMarks("points", choices.metrics, [], ""), error.reason


def _marks(kind: FigureKind, study: StoredStudy, choices: Choices) -> FigureMarks:
    assert kind.marks
    return kind.marks(study, choices)


def _why_not(kind: FigureKind, study: StoredStudy, question: AskFigure) -> str:
    return kind.suits(study, _choices(kind, question), as_marks=True)


def _why_no_trials(name: str, study: StoredStudy, choices: Choices) -> str:
    """Return why a figure of a kind cannot show single trials, or ""."""
    if "trials" in KINDS[name].takes:
        chosen = choices._replace(trials=True)
        return KINDS[name].suits(study, chosen, as_marks=True)
    taking = [kind for kind in KINDS if "trials" in KINDS[kind].takes]
    return f"for {', '.join(taking)}, not for {name}"


def _about(name: str, reasons: dict[str, str]) -> dict[str, str]:
    return {"text": KINDS[name].text, "why_not": reasons[name]}


def _suiting(study: StoredStudy, reasons: dict[str, str]) -> str:
    """Return the kind of figure that suits a study.

    For a search, the result is the first suitable kind for searches. Otherwise the
    result is the kind whose number of parameter axes is nearest to the number that the
    study can fill. Parameters with a scale and more than two values fill an axis. Kinds
    that show the precision of numbers are excluded. Raises ChoiceError if no kind
    suits.
    """
    numbers = [name for name in reasons if not KINDS[name].of_precision]
    suiting = [name for name in numbers if not reasons[name]]
    if not suiting:
        select(study)  # without a done trial, this error is the only reason
        why = "; ".join(f"{name}: {reason}" for name, reason in reasons.items())
        raise ChoiceError(f"no kind of figure suits the study: {why}", study.name)
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
        "span": panel.span,
        "line": panel.line._asdict(),
        "marks": _columns_and_data(panel.marks),
        "trials": None if panel.trials is None else _columns_and_data(panel.trials),
    }


def _columns_and_data(marks: pd.DataFrame) -> dict[str, Any]:
    rows = [[*row.values()] for row in json_rows(marks)]
    return {"columns": [*marks], "data": rows}


def _axis(axis: MarkedAxis) -> dict[str, Any]:
    return axis._asdict()
