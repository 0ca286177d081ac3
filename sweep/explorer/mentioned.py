"""Published numbers for a figure, at the parameters of the points of the figure.

The page asks for the numbers separately, since reading takes longer than drawing the
figure.
"""

from typing import Any

from sweep.errors import ChoiceError
from sweep.explorer.asking import AskPublished
from sweep.explorer.watching import Watched
from sweep.figures import recorded
from sweep.spec import EXPERIMENTS
from sweep.tables import StoredStudy
from sweep.web import published


def published_at(watched: Watched, question: AskPublished) -> dict[str, Any]:
    """Return the published means of a metric at the points of a study.

    `published` has an entry per number and point: `point`, `value`, `where` and `says`.
    Each number is about trials with all parameters of the point. The number is about
    the last frame, or the second half of a trial with `half`.

    A number about points with several values of a parameter, or about a custom map,
    belongs to no point. Raises ChoiceError for an unknown metric.
    """
    study = watched.counted(question.study)[1]
    metric = recorded(study, question.metric)
    origin = study.provenance
    numbers = published(origin.get("model", ""), origin.get("preset", ""), EXPERIMENTS)
    rows = [
        {"point": point} | {name: number[name] for name in ("value", "where", "says")}
        for name, number in numbers
        if name == metric and number["half"] == question.half
        for point in _points(study, number)
    ]
    by_place = {(row["point"], row["value"], row["where"]): row for row in rows}
    return {"published": list(by_place.values())}


def _points(study: StoredStudy, number: dict[str, Any]) -> list[str]:
    """Return the ids of the points with all the parameters of a number."""
    settings = number["settings"]
    frame = number["frame"]
    if None in settings.values() or frame not in (None, settings["steps"]):
        return []
    try:
        having = study.chooser.having(settings)
    except ChoiceError:  # a value that no point has
        return []
    return [str(point) for point in study.points.index[having]]
