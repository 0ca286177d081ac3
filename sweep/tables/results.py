"""Results that tables and figures show: of one stored study, or of several as one."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
from numpy.typing import ArrayLike, NDArray

from kernels.metrics import Metric
from sweep.analysis import Declaration, Interval, by_point, mean_interval
from sweep.errors import ChoiceError
from sweep.spec import Column, Over, column_over
from sweep.store import AxisAbout
from sweep.tables.choosing import Choice, as_names
from sweep.text import unknown


class Looks(NamedTuple):
    """The metrics that decided the number of trials of a point, and two confidences.

    `confidence` is simultaneous for the confidence intervals of all looks at a point.
    `nominal` is the confidence of each interval.
    """

    metrics: tuple[str, ...]
    confidence: float
    nominal: float


class Results(ABC):
    """Trials of points with metrics, and the properties of points, trials and metrics.

    Attributes
    ----------
    name : str
        The name of the study, or the names of all studies.
    plan : pyarrow.Table
        One row per planned trial: at least `trial_id` and `point`.
    chosen : dict
        The parameters by which `where` has restricted the study.
    conditions : tuple of str
        The conditions by which `where` has restricted the results.

    Examples
    --------
    >>> part = sweep.load("my/first").where("separation_weight >= 1", n=30)
    >>> part.name, part.chosen, part.conditions
    ('my/first', {'n': 30}, ('separation_weight >= 1',))
    """

    name: str
    plan: pa.Table
    chosen: Mapping[str, Choice] = MappingProxyType({})
    conditions: tuple[str, ...] = ()

    @property
    @abstractmethod
    def points(self) -> pd.DataFrame:
        """One row per point, by the id: the parameters that differ between points."""

    @property
    @abstractmethod
    def trials(self) -> pd.DataFrame:
        """One row per stored trial, with every shared metric."""

    @property
    @abstractmethod
    def series(self) -> pd.DataFrame:
        """One row per recorded frame of a trial."""

    @property
    @abstractmethod
    def varied(self) -> list[str]:
        """The parameters that differ between points."""

    @property
    @abstractmethod
    def headings(self) -> list[str]:
        """The columns that distinguish points in tables and figures."""

    @property
    @abstractmethod
    def averaged(self) -> str:
        """The frames that means of a trial cover: "the second half" unless recorded."""

    @property
    @abstractmethod
    def kept_apart(self) -> list[str]:
        """The columns whose values are never averaged or shown as one."""

    @property
    @abstractmethod
    def apart_notes(self) -> list[str]:
        """Sentences about the parts that are kept apart."""

    @property
    @abstractmethod
    def metrics(self) -> list[str]:
        """The metrics that every study has recorded."""

    @property
    @abstractmethod
    def left_out(self) -> Mapping[str, str]:
        """The metrics that are not shown, each with the reason."""

    @property
    @abstractmethod
    def known_metrics(self) -> Mapping[str, Metric]:
        """The metrics that this version or the custom code defines, by name."""

    @property
    @abstractmethod
    def series_metrics(self) -> list[str]:
        """The metrics that are stored frame by frame."""

    @property
    @abstractmethod
    def axes(self) -> Mapping[str, AxisAbout]:
        """The axes by name."""

    @property
    @abstractmethod
    def units(self) -> Mapping[str, str]:
        """The unit of every column that has one."""

    @property
    @abstractmethod
    def distributions(self) -> Mapping[str, Declaration]:
        """The declared distribution and range of the values of each metric column."""

    @property
    @abstractmethod
    def looks(self) -> Looks | None:
        """The metrics that decided the number of trials of a point, or None."""

    @property
    def differ(self) -> Mapping[str, list[Any]]:
        """The fixed parameters in which the studies differ, with each value: empty.

        Examples
        --------
        >>> sweep.load("my/first").differ
        {}
        """
        return {}

    @property
    def restricted(self) -> bool:
        """True if `where` has restricted the study.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.restricted, study.where(separation_weight=1).restricted
        (False, True)
        """
        return bool(self.chosen or self.conditions)

    @cached_property
    def tried(self) -> NDArray[np.bool_]:
        """True for each of the `points` that has a stored trial, (points,).

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.tried.tolist()
        [True, True, True]
        """
        stored = pd.Index(self.trials["point"].unique())
        tried: NDArray[np.bool_] = stored.get_indexer(self.points.index) >= 0
        return tried

    @property
    def done(self) -> NDArray[np.bool_]:
        """True for each of the `trials` that is done, (trials,).

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> int(study.done.sum())
        30
        """
        return (self.trials["status"] == "done").to_numpy(np.bool_)

    def check_metric(self, name: str) -> None:
        """Raise ChoiceError unless a metric of that name is recorded.

        Parameters
        ----------
        name : str
            The name of the metric.

        Raises
        ------
        ChoiceError
            If no such metric is recorded.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.check_metric("coverage")
        Traceback (most recent call last):
        ...
        sweep.errors.ChoiceError: study my/first: unknown metric "coverage". ...
        """
        if name in self.metrics:
            return
        column = Column.read(name)
        if column.half and column.metric in self.metrics:
            raise ChoiceError(
                f'"{name}" is the mean of {column.metric} over {self.averaged}; use'
                f' {column.metric} with over="half", in a command --over half',
                self.name,
            )
        raise ChoiceError(unknown("metric", name, self.metrics), self.name)

    @property
    def missing(self) -> int:
        """The number of trials of the spec that are not stored.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.missing
        0
        """
        return int(self.plan.num_rows) - len(self.trials)

    @property
    def untried(self) -> int:
        """The number of points of the spec without a stored trial.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> study.untried
        0
        """
        return int((~self.tried).sum())

    def means(
        self,
        metrics: str | Sequence[str],
        varied: str | Sequence[str] | None = None,
        *,
        over: Over = "last",
    ) -> pd.DataFrame:
        """Return the mean of each metric with its 95 % confidence interval.

        The kind of each interval depends on the distribution of the metric. A metric
        that decided the number of trials of a point has a repeated confidence interval.

        Parameters
        ----------
        metrics : str or sequence of str
        varied : str or sequence of str, optional
            Parameters that become columns; by default those of the spec.
        over : {"last", "half"}, default "last"
            The last frame of a trial, or the second half. The means over the second
            half are also the metrics `<metric>_mean`.

        Returns
        -------
        DataFrame
            One row per point, with the columns of `by_point`.

        Examples
        --------
        >>> study = sweep.load("my/first")
        >>> means = study.means("polarization", over="half")
        >>> means[["separation_weight", "polarization_mean"]].round(2)
           separation_weight  polarization_mean
        0                0.5               0.49
        1                1.0               0.38
        2                2.0               0.50
        """
        return by_point(
            self.trials,
            self.varied if varied is None else as_names(varied),
            [column_over(name, over) for name in as_names(metrics)],
            repeated=self.repeated,
            distributions=self.distributions,
        )

    def mean_of(self, metric: str, values: ArrayLike) -> Interval:
        """Return the mean of values of a metric with its 95 % confidence interval.

        The kind of the interval depends on the distribution of the metric. The interval
        is not valid for differences, which have the declaration
        `distributions[metric].of_differences`.

        Parameters
        ----------
        metric : str
        values : array_like
            One value per trial, (n,), for example the mean over some frames.

        Returns
        -------
        Interval
            With `value`, `low`, `high` and `n`.

        Examples
        --------
        >>> mean = sweep.load("my/first").mean_of("speed", [1.0, 1.2, 1.4])
        >>> round(mean.value, 2), round(mean.low, 2), round(mean.high, 2)
        (1.2, 0.7, 1.7)
        """
        return mean_interval(values, distribution=self.distributions[metric])

    @property
    def repeated(self) -> dict[str, float]:
        """The confidence of the interval at each look, by metric.

        The metrics decided the number of trials of a point. Empty if the number of
        trials is fixed. `means` uses the confidences.

        Examples
        --------
        >>> study = sweep.load("my/until")
        >>> study.repeated
        {'speed': 0.98...}
        """
        looks = self.looks
        return dict.fromkeys(looks.metrics, looks.nominal) if looks else {}
