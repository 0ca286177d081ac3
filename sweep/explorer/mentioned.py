"""Published numbers for a figure: those that hold at the very settings of its points.

They are asked for apart from the figure: to read them takes longer than to draw it.
"""

from typing import Any

from sweep.errors import ChoiceError
from sweep.explorer.asking import AskPublished
from sweep.explorer.watching import Watched
from sweep.figures.selection import recorded
from sweep.spec.built_in import EXPERIMENTS
from sweep.tables.stored_study import StoredStudy
from sweep.web.claimed import published


def published_at(watched: Watched, asked: AskPublished) -> dict[str, Any]:
    """The published means of a metric at the points of a study, as `published`: of each
    `point`, `value`, `where` and `says`. Each is about trials with all settings of that
    point, and about the last frame, or the last half, as is asked for.

    A number that is about points with several values of a setting, or about a map of
    their own, stands at no point. Raises ChoiceError for an unknown metric.
    """
    study = watched.counted(asked.study)[1]
    metric = recorded(study, asked.metric)
    origin = study.provenance
    numbers = published(origin.get("model", ""), origin.get("preset", ""), EXPERIMENTS)
    rows = [
        {"point": point} | {name: number[name] for name in ("value", "where", "says")}
        for name, number in numbers
        if name == metric and number["half"] == asked.half
        for point in _points(study, number)
    ]
    told = {(row["point"], row["value"], row["where"]): row for row in rows}
    return {"published": list(told.values())}


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
