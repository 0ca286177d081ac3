"""Directions of metrics: `coverage+` prefers high values, `coverage_cv-` low values.

A column that a method optimizes, such as an objective of a search, has a direction.
"""

from typing import NamedTuple

from kernels.metrics import Better
from sweep.figures.selection import recorded
from sweep.method import methods
from sweep.spec import Column
from sweep.tables import Results, stored_parts


class Direction(NamedTuple):
    """A metric; `high` is true if high values are better."""

    metric: str
    high: bool

    def __str__(self) -> str:
        return f"{'high' if self.high else 'low'} {self.metric.replace('_', ' ')}"


def direction(study: Results, text: str) -> Direction:
    """Read a direction, such as `coverage+` for high values or `coverage_cv-` for low.

    Without a sign, the better values of the metric determine the direction. Raises
    ChoiceError for an unknown metric.
    """
    metric = recorded(study, text.rstrip("+-"))
    return Direction(
        metric,
        not text.endswith("-")
        if text[-1:] in ("+", "-")
        else _more_is_better(study, metric),
    )


def shown_metrics(study: Results) -> list[str]:
    """Return the metrics that figures show by default.

    The metrics are the objectives of a search, or else all recorded metrics.
    """
    return [*_optimized(study)] or study.metrics


def opposed_metrics(study: Results) -> list[str]:
    """Return two metrics to trade off against each other, or an empty list.

    The metrics are the first two objectives of a search. Otherwise the metrics are the
    first metric with better high values, and the first with better low values.
    """
    aims = [*_optimized(study)]
    if len(aims) > 1:
        return aims[:2]
    better, worse = (
        [name for name in study.metrics if _more_is_better(study, name) is high]
        for high in (True, False)
    )
    return [better[0], worse[0]] if better and worse else []


def better_values(study: Results, column: str) -> Better:
    """Return which values of a metric, or of the mean over the second half, are better.

    An objective of a search on this column decides first, then an objective on the
    metric, then the metric. For a metric that this version does not know, the result is
    "neither".
    """
    metric = Column.read(column).metric
    high = _optimized(study)
    exact = [column] if column in high else []
    for optimized in exact or high:
        if Column.read(optimized).metric == metric:
            return "high" if high[optimized] else "low"
    known_metric = study.known_metrics.get(metric)
    return known_metric.better if known_metric else "neither"


def _more_is_better(study: Results, column: str) -> bool:
    """Return True if high values are better, or if no direction is better."""
    return better_values(study, column) != "low"


def _optimized(study: Results) -> dict[str, bool]:
    """Return the columns that methods optimize, True if high values are better."""
    return {
        column: is_high
        for part in stored_parts(study)
        for method in methods().values()
        for column, is_high in method.directions(part).items()
    }
