"""Names of metrics in a spec, and of the columns of trials with metrics."""

from collections.abc import Collection, Iterable
from typing import Literal, NamedTuple, get_args

from kernels.catalogue import Catalogue
from kernels.metrics import METRICS, Metric
from kernels.metrics.parts import OF, has_parts
from kernels.model import WORKING, Model
from sweep.analysis import Declaration
from sweep.errors import ChoiceError
from sweep.spec.document import Entry
from sweep.text import unknown

MEAN = "_mean"
ANY_METRIC = next(iter(METRICS))
"""A metric for examples."""


class Column(NamedTuple):
    """A column of trials: a metric at the last frame, or its mean over the second half.

    >>> str(Column("speed", half=True))
    'speed_mean'
    """

    metric: str
    half: bool = False

    def __str__(self) -> str:
        return self.metric + (MEAN if self.half else "")

    @classmethod
    def read(cls, name: str) -> "Column":
        """Return the column of a name, such as `coverage` or `coverage_mean`."""
        half = name.endswith(MEAN)
        return cls(name.removesuffix(MEAN) if half else name, half)


def columns_of(metrics: Iterable[str]) -> list[str]:
    """Return the names of the two columns of each metric."""
    return [str(Column(name, half)) for name in metrics for half in (False, True)]


def averaged_frames(model: Model) -> str:
    """Return in words the frames of a trial that its means cover.

    An event of a recording has no transient that a mean would have to leave out.
    """
    return "the whole event" if model.events else "the second half"


Over = Literal["last", "half"]
"""The last frame of a trial, or the mean over its second half.

The means of a recording are over all frames of the event.
"""


def is_half(over: str, half: bool = False) -> bool:
    """Return whether means over the second half are selected.

    `over` selects the means, and so does `half`, the argument of versions up to 0.18.
    Raises ChoiceError for an unknown `over`.
    """
    if over not in (allowed := get_args(Over)):
        raise ChoiceError(unknown("value of over", over, allowed))
    return half or over == "half"


def column_over(metric: str, over: str) -> str:
    """Return the column of a metric.

    With `over` "half" the result is the column of the mean over the second half. With
    "last" the result is `metric`, so `speed_mean` is unchanged. A direction, such as
    the sign in `coverage+`, is kept.
    """
    if not is_half(over):
        return metric
    name = metric.rstrip("+-")
    return f"{Column.read(name)._replace(half=True)}{metric[len(name) :]}"


def check_recorded(
    entry: Entry, column: str, recorded: Iterable[str], metrics: Collection[str]
) -> None:
    """Raise SpecError unless a column is recorded.

    Parameters
    ----------
    entry : Entry
        The error has the line of this entry.
    column : str
    recorded : iterable of str
        Recorded metrics.
    metrics : collection of str
        All known metrics, for a message about the key that records a metric.
    """
    columns = columns_of(recorded)
    if column in metrics and column not in columns:
        raise entry.error(
            f'metric "{column}" is not recorded: list it under "metrics" of "record"'
        )
    if column not in columns:
        raise entry.error(unknown("recorded metric", column, columns))


def declaration_of(metric: Metric) -> Declaration:
    """Return the declaration of the values of a metric.

    A metric without a distribution is treated as normal. A mean over frames has the
    range of the values at frames.
    """
    return Declaration.of(metric.distribution or "normal", metric.low, metric.high)


class KnownMetrics(NamedTuple):
    """The metrics that a spec may name.

    The methods raise SpecError for unknown metrics.

    Attributes
    ----------
    model : str
        Name of the model.
    catalogue : Catalogue
        Models and metrics by name.
    derived : tuple of str
        Names of the metrics that the spec derives.
    """

    model: str
    catalogue: Catalogue
    derived: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All names, with metrics of parts of the boids at the end."""
        model = self.catalogue.models[self.model]
        parts = names_of_parts(model, self.catalogue)
        return (*self.catalogue.metrics, *self.derived, *parts)

    def read(self, entry: Entry) -> str:
        """Return the metric whose name is the value of an entry."""
        name = entry.text()
        if name in self.catalogue.profiles and name not in self.derived:
            raise entry.error(f'"{name}" has an axis: list it under "profiles"')
        if name not in self.catalogue.metrics:
            name = entry.one_of("metric", self.names)
        self.check(entry, name)
        return name

    def column(self, entry: Entry) -> str:
        """Return the column that is the key of an entry.

        The column is a metric, at the last frame, or `<metric>_mean`, over the second
        half.
        """
        column = Column.read(entry.name)
        metrics = self.catalogue.metrics
        if column.metric not in metrics and column.metric not in self.derived:
            raise entry.error(unknown("metric", entry.name, columns_of(self.names)))
        self.check(entry, column.metric)
        return entry.name

    def check(self, entry: Entry, name: str) -> None:
        """Raise SpecError for a metric that the model cannot have.

        Parameters
        ----------
        entry : Entry
            The error has the line of this entry.
        name : str
            Name of the metric.
        """
        metric = self.catalogue.metrics.get(name)
        models = self.catalogue.models
        if metric and (lacking := lacks(models[self.model], metric)):
            model = models[self.model]
            has_kinds = metric.kinds and set(metric.kinds) <= set(model.kinds)
            if model.events and has_kinds and not (metric.state or metric.potential):
                message = (
                    f'metric "{name}" needs {lacking}, in this order, and no others'
                )
                kinds = ", ".join(metric.kinds)
                message += f"; write `kinds: [{kinds}]` under `recording`"
                raise entry.error(message)
            having = [each.name for each in models.values() if not lacks(each, metric)]
            raise entry.error(
                f'metric "{name}" needs a model with {lacking}. Allowed:'
                f" {', '.join(having) or 'no known model'}"
            )


def names_of_parts(model: Model, catalogue: Catalogue) -> list[str]:
    """Return the names of the metrics of each part of the boids of a model."""
    names = [name for name, metric in catalogue.metrics.items() if has_parts(metric)]
    parts = (*model.kinds, WORKING)
    return [f"{name}{OF}{part}" for part in parts for name in names]


def lacks(model: Model, metric: Metric) -> str:
    """Return in words the property that a model lacks for a metric; "" for a match."""
    if metric.potential and not model.pair_potential:
        return "a pair potential"
    return lacks_boids(model, metric)


def lacks_boids(model: Model, metric: Metric) -> str:
    """Return in words the state or kinds of boids that a model lacks for a metric.

    "" if the model has all.
    """
    if tuple(model.state)[: len(metric.state)] != metric.state:
        return f"the state {', '.join(metric.state)}"
    if metric.part not in ("", WORKING, *model.kinds):
        return f"the kind {metric.part}"
    # A metric may count on it that the last boid is of the last kind.
    own = model.kinds if model.events else model.kinds[: len(metric.kinds)]
    if metric.kinds and tuple(own) != metric.kinds:
        return f"the kinds {', '.join(metric.kinds)}"
    return ""
