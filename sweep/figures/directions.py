"""Which way a metric is better: coverage+ is to be high, coverage_cv- low."""

from typing import NamedTuple

from kernels.metrics import METRICS
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
    """The direction that `coverage+`, `coverage_cv-` or a metric alone means. Raises
    ChoiceError for an unknown metric.
    """
    metric = recorded(study, text.rstrip("+-"))
    return Direction(
        metric,
        not text.endswith("-") if text[-1:] in ("+", "-") else more_is_better(metric),
    )


def more_is_better(column: str) -> bool:
    """Whether high values of a metric, or of its mean, are better where nothing else is
    said; those of a metric that only another version knows are.
    """
    about = METRICS.get(Column.read(column).metric)
    return about is None or about.better == "high"
