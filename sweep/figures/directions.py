"""Which values of a metric are better: `coverage+` asks for high ones, `coverage_cv-`
for low ones. Of a search its objectives say it.
"""

from typing import NamedTuple

from kernels.metrics import Better
from sweep.campaigns.search.asked_trials import asked_objectives
from sweep.figures.selection import recorded
from sweep.spec.recorded import Column
from sweep.tables.stored_study import StoredStudy


class Direction(NamedTuple):
    """A metric, and whether high values of it are better."""

    metric: str
    high: bool

    def __str__(self) -> str:
        return f"{'high' if self.high else 'low'} {self.metric.replace('_', ' ')}"


def direction(study: StoredStudy, text: str) -> Direction:
    """Read a direction: `coverage+` asks for high values, `coverage_cv-` for low ones,
    and a metric alone for those that are better.

    Raises ChoiceError for an unknown metric.
    """
    metric = recorded(study, text.rstrip("+-"))
    return Direction(
        metric,
        not text.endswith("-")
        if text[-1:] in ("+", "-")
        else _more_is_better(study, metric),
    )


def shown_metrics(study: StoredStudy) -> list[str]:
    """The metrics of a study that figures show where none are chosen: the objectives of
    a search, or else all that are recorded.
    """
    return [one.column for one in asked_objectives(study)] or study.metrics


def opposed_metrics(study: StoredStudy) -> list[str]:
    """Two metrics that are good together: the first two objectives of a search, or else
    the first metric of which more is better and the first of which less is.
    """
    aims = asked_objectives(study)
    if len(aims) > 1:
        return [one.column for one in aims[:2]]
    better, worse = (
        [name for name in study.metrics if _more_is_better(study, name) is high]
        for high in (True, False)
    )
    return [better[0], worse[0]] if better and worse else []


def better_values(study: StoredStudy, column: str) -> Better:
    """Return which values of a metric, or of its mean over the last half, are better.

    An objective of a search says it of its own column first, and then of its metric.
    Else the metric does. It is "neither" of one that this version does not know.
    """
    metric = Column.read(column).metric
    aims = asked_objectives(study)
    exact = [one for one in aims if one.column == column]
    for one in exact or aims:
        if Column.read(one.column).metric == metric:
            return "high" if one.maximize else "low"
    about = study.known.metrics.get(metric)
    return about.better if about else "neither"


def _more_is_better(study: StoredStudy, column: str) -> bool:
    """Whether high values count as the better ones, as where nothing says it."""
    return better_values(study, column) != "low"
