"""Which values of a metric are better: `coverage+` asks for high ones, `coverage_cv-`
for low ones.
"""

from typing import NamedTuple

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
    and a metric alone for those that are usually better.

    Raises ChoiceError for an unknown metric.
    """
    metric = recorded(study, text.rstrip("+-"))
    return Direction(
        metric,
        not text.endswith("-")
        if text[-1:] in ("+", "-")
        else more_is_better(study, metric),
    )


def more_is_better(study: StoredStudy, column: str) -> bool:
    """Whether high values of a metric of a study, or of its mean over the last half,
    are the better ones where nobody says it.

    They are for a metric that this version does not know.
    """
    about = study.known.metrics.get(Column.read(column).metric)
    return about is None or about.better == "high"
