"""The names of metrics in a spec, and of the columns that trials have of them."""

from collections.abc import Iterable
from typing import NamedTuple

from kernels.metrics import METRICS
from kernels.model import Model
from kernels.models import MODELS
from sweep.spec.document import Entry
from sweep.text import unknown

MEAN = "_mean"
ANY_METRIC = next(iter(METRICS))
"""For examples."""


class Column(NamedTuple):
    """A column of trials: a metric at the last frame, or its mean over the last half.

    >>> str(Column("speed", half=True))
    'speed_mean'
    """

    metric: str
    half: bool = False

    def __str__(self) -> str:
        return self.metric + (MEAN if self.half else "")

    @classmethod
    def read(cls, name: str) -> "Column":
        """The column of that name: `coverage`, or `coverage_mean`."""
        half = name.endswith(MEAN) and name not in METRICS
        return cls(name.removesuffix(MEAN) if half else name, half)


def columns_of(metrics: Iterable[str]) -> list[str]:
    """The names of both columns of each metric."""
    return [str(Column(name, half)) for name in metrics for half in (False, True)]


def check_metric(entry: Entry, name: str, model: Model) -> None:
    """Raise SpecError for a metric that `model` cannot have."""
    if METRICS[name].potential and not model.pair_potential:
        having = ", ".join(
            other.name for other in MODELS.values() if other.pair_potential
        )
        raise entry.error(
            f'metric "{name}" is for models with a pair potential: {having}'
        )


def read_column(entry: Entry, model: Model) -> str:
    """The column that is the key of `entry`: a metric, at the last frame, or
    `<metric>_mean`, over the last half.

    Raises SpecError where it is neither.
    """
    column = Column.read(entry.name)
    if column.metric not in METRICS:
        raise entry.error(unknown("metric", entry.name, columns_of(METRICS)))
    check_metric(entry, column.metric, model)
    return entry.name
