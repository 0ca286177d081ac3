"""The names of metrics in a spec, and of the columns that trials have of them."""

from collections.abc import Collection, Iterable
from typing import Literal, NamedTuple, get_args

from kernels.catalogue import Catalogue
from kernels.metrics import METRICS, Metric
from kernels.metrics.parts import OF, has_parts
from kernels.model import WORKING, Model
from sweep.analysis.mean_bounds import Declaration
from sweep.errors import ChoiceError
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
        half = name.endswith(MEAN)
        return cls(name.removesuffix(MEAN) if half else name, half)


def columns_of(metrics: Iterable[str]) -> list[str]:
    """The names of both columns of each metric."""
    return [str(Column(name, half)) for name in metrics for half in (False, True)]


Over = Literal["last", "half"]
"""The last frame of a trial, or the mean over its last half."""


def is_half(over: str, half: bool = False) -> bool:
    """Whether means over the last half are asked for, by `over`, or by `half`, the form
    of up to 0.18. Raises ChoiceError for an `over` that is none.
    """
    if over not in (allowed := get_args(Over)):
        raise ChoiceError(unknown("value of over", over, allowed))
    return half or over == "half"


def column_over(metric: str, over: str) -> str:
    """The column of a metric: over "half" that of its mean over the last half, and over
    "last" the one of that name, as `speed_mean` names such a mean too. A direction, as
    in `coverage+`, stays.
    """
    if not is_half(over):
        return metric
    name = metric.rstrip("+-")
    return f"{Column.read(name)._replace(half=True)}{metric[len(name) :]}"


def check_recorded(
    entry: Entry, column: str, recorded: Iterable[str], metrics: Collection[str]
) -> None:
    """Raise SpecError unless `column` is one of the columns of the `recorded` ones of
    these `metrics`.
    """
    columns = columns_of(recorded)
    if column in metrics and column not in columns:
        raise entry.error(
            f'metric "{column}" is not recorded: list it under "metrics" of "record"'
        )
    if column not in columns:
        raise entry.error(unknown("recorded metric", column, columns))


def declaration_of(metric: Metric) -> Declaration:
    """What a metric declares of its values: about normal ones, where it declares no
    distribution. A mean over frames lies where they lie.
    """
    return Declaration.of(metric.distribution or "normal", metric.low, metric.high)


class KnownMetrics(NamedTuple):
    """The metrics that a spec may name: those that its model can have, and those that
    it derives.

    The methods raise SpecError for any other.
    """

    model: str
    known: Catalogue
    derived: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All of them; those of parts of the boids are the last."""
        model = self.known.models[self.model]
        parts = names_of_parts(model, self.known)
        return (*self.known.metrics, *self.derived, *parts)

    def read(self, entry: Entry) -> str:
        """The metric whose name is the value of `entry`."""
        name = entry.text()
        if name not in self.known.metrics:
            name = entry.one_of("metric", self.names)
        self.check(entry, name)
        return name

    def column(self, entry: Entry) -> str:
        """The column that is the key of `entry`: a metric, at the last frame, or
        `<metric>_mean`, over the last half.
        """
        column, metrics = Column.read(entry.name), self.known.metrics
        if column.metric not in metrics and column.metric not in self.derived:
            raise entry.error(unknown("metric", entry.name, columns_of(self.names)))
        self.check(entry, column.metric)
        return entry.name

    def check(self, entry: Entry, name: str) -> None:
        """Raise SpecError for a metric that the model cannot have."""
        metric, models = self.known.metrics.get(name), self.known.models
        if metric and (lacking := lacks(models[self.model], metric)):
            having = [one.name for one in models.values() if not lacks(one, metric)]
            raise entry.error(
                f'metric "{name}" is for models with {lacking}:'
                f" {', '.join(having) or 'there is none'}"
            )


def names_of_parts(model: Model, known: Catalogue) -> list[str]:
    """The names of the metrics of each part of the boids of a model."""
    whole = [name for name, metric in known.metrics.items() if has_parts(metric)]
    parts = (*model.kinds, WORKING)
    return [f"{name}{OF}{part}" for part in parts for name in whole]


def lacks(model: Model, metric: Metric) -> str:
    """What a model would need for a metric, in words; "" where it has all of it."""
    if metric.potential and not model.pair_potential:
        return "a pair potential"
    return lacks_boids(model, metric)


def lacks_boids(model: Model, metric: Metric) -> str:
    """The state or the kinds of boids that a metric reads and a model has not, in
    words; "" where it has them.
    """
    if tuple(model.state)[: len(metric.state)] != metric.state:
        return f"the state {', '.join(metric.state)}"
    if metric.part not in ("", WORKING, *model.kinds):
        return f"the kind {metric.part}"
    if tuple(model.kinds)[: len(metric.kinds)] != metric.kinds:
        return f"the kinds {', '.join(metric.kinds)}"
    return ""
