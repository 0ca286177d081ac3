"""Published numbers in a figure: those that hold at the very settings of its points."""

from typing import Any

from sweep.errors import ChoiceError
from sweep.figures.marks import FigureMarks
from sweep.spec.built_in import EXPERIMENTS
from sweep.tables.stored_study import StoredStudy
from sweep.web.claimed import published


def published_in(
    study: StoredStudy, marks: FigureMarks, *, half: bool
) -> list[dict[str, Any]]:
    """The published means of the metric of a figure: `point`, `value`, `where` and
    `says`. Each is about trials with all settings of that point, and about the frame,
    or the last half, that the figure shows.

    A number that is about points with several values of a setting, or about a map of
    their own, stands at no point. A figure of two metrics, or of frames, has none.
    """
    if len(marks.metrics) != 1 or marks.panels[0].x.name == "frame":
        return []
    origin = study.provenance
    numbers = published(origin.get("model", ""), origin.get("preset", ""), EXPERIMENTS)
    found = [
        (point, number)
        for metric, number in numbers
        if metric == marks.metrics[0] and number["half"] == half
        for point in _points(study, number)
    ]
    rows = [
        {"point": point} | {name: number[name] for name in ("value", "where", "says")}
        for point, number in found
    ]
    told = {(row["point"], row["value"], row["where"]): row for row in rows}
    return list(told.values())


def _points(study: StoredStudy, number: dict[str, Any]) -> list[str]:
    """The ids of the points with all the settings of a number."""
    settings = number["settings"]
    frame = number["frame"]
    if None in settings.values() or frame not in (None, settings["steps"]):
        return []
    try:
        having = study.chooser.having(settings)
    except ChoiceError:  # a value that no point has
        return []
    return [str(point) for point in study.points.index[having]]
