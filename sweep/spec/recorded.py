"""The names of metrics in a spec, and of the columns that trials have of them."""

from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.settings import Model
from sweep.spec.document import Entry
from sweep.text import unknown

MEAN = "_mean"
"""The ending of the column that holds the mean over the last half of a trial."""


def check_metric(entry: Entry, name: str, model: Model) -> None:
    """Raise SpecError for a metric that `model` cannot have."""
    if METRICS[name].potential and not model.pair_potential:
        having = ", ".join(
            other.name for other in MODELS.values() if other.pair_potential
        )
        raise entry.error(
            f'metric "{name}" is for models with a pair potential: {having}'
        )


def metric_of(column: str) -> str:
    """The metric that a column of trials is of: `coverage` of coverage, and of
    coverage_mean.
    """
    return column if column in METRICS else column.removesuffix(MEAN)


def read_column(entry: Entry, model: Model) -> str:
    """The column that is the key of `entry`: a metric, at the last frame, or
    `<metric>_mean`, over the last half.

    Raises SpecError where it is neither.
    """
    column = entry.name
    if metric_of(column) not in METRICS:
        raise entry.error(
            unknown("metric", column, [*METRICS, *(name + MEAN for name in METRICS)])
        )
    check_metric(entry, metric_of(column), model)
    return column
