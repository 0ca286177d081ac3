"""The table of a study: means of metrics with confidence intervals.

The table has one row per point, or per group of points that agree in some parameters.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import pandas as pd

from sweep.analysis import MeanKind, by_point, pooled
from sweep.errors import ChoiceError
from sweep.spec import Column
from sweep.tables.choosing import Refusals, as_names
from sweep.tables.kept_apart import keep_apart
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

DIRECTIONS = {"": True, "asc": True, "desc": False}
"""True if values ascend, by the text after the name of a column to sort by."""


@dataclass(frozen=True, eq=False)
class PointMeans:
    """A table of means.

    Attributes
    ----------
    rows : DataFrame
        One row per point or group of points. Columns: `headings`; `points`, the number
        of points, if rows pool points; the columns of `by_point` for each metric;
        `not_done`; and `trial_id`, an example, which is done if a trial is done.
    headings : list of str
        The parameters that distinguish the rows.
    metrics : list of str
        The columns of means.
    pooled : bool
        Whether a row has several points. A value is then the mean over the points, one
        per replicate.
    interval : str or None
        The requested kind of confidence interval; None for the kind of the
        distribution.
    """

    rows: pd.DataFrame
    headings: list[str]
    metrics: list[str]
    pooled: bool = False
    interval: MeanKind | None = None


def point_means(
    study: StoredStudy,
    metrics: str | Sequence[str] = (),
    *,
    by: str | Sequence[str] | None = None,
    sort: str | Sequence[str] = (),
    half: bool = False,
    interval: MeanKind | None = None,
) -> PointMeans:
    """Return the means of metrics with 95 % confidence intervals.

    The parameters of an axis that ablates a preset are one column, `detail`. A search
    has a row for each `phase` of a candidate.

    Parameters
    ----------
    study : StoredStudy
        `where` restricts its points.
    metrics : str or sequence of str, optional
        By default all recorded metrics.
    by : str or sequence of str, optional
        Parameters. One row pools all points with equal values of the parameters, see
        `sweep.analysis.pooled`. By default one row per point.
    sort : str or sequence of str, optional
        Parameters or metrics to sort by; `:desc` after a name puts large values first.
    half : bool, default False
        Means over the second half of each trial instead of the last frame.
    interval : {"t", "bootstrap", "bootstrap_t"}, optional
        Kind of confidence interval; by default the kind for the distribution of the
        metric.

    Returns
    -------
    PointMeans

    Raises
    ------
    ChoiceError
        If a metric is not recorded, a parameter does not vary, or a column to sort by
        is unknown. All mistakes are reported together.
    """
    study = keep_apart(study)
    refusals = Refusals()
    requested = as_names(metrics) or study.metrics
    chosen = _known("metric", requested, study.metrics, study, refusals=refusals)
    columns = [str(Column(name, half)) for name in chosen]
    varied = list(dict.fromkeys([*study.headings, *study.varied]))
    settings = study.headings if by is None else as_names(by)
    headings = _known("varied parameter", settings, varied, study, refusals=refusals)
    separate = [name for name in study.kept_apart if name in varied]
    headings = list(dict.fromkeys([*separate, *headings]))
    order = _order(study, as_names(sort), headings, columns, refusals=refusals)
    refusals.check()
    details = {
        name: study.trials["point"].map(study.points[name])
        for name in study.headings
        if name not in study.trials
    }
    trials = study.trials.assign(**details)
    together = by is not None and _several(trials, headings)
    if together:
        trials = pooled(trials, headings, columns)
    rows = by_point(
        trials,
        [*headings, *(["points"] if together else [])],
        columns,
        interval=interval,
        repeated={} if together else study.repeated,
        distributions=study.distributions,
    )
    rows = rows.assign(trial_id=_first_done(trials))
    if order:
        rows = rows.sort_values(
            list(order), ascending=list(order.values()), kind="stable"
        ).reset_index(drop=True)
    return PointMeans(rows, headings, columns, pooled=together, interval=interval)


def _known(
    noun: str,
    requested: Sequence[str],
    allowed: Collection[str],
    study: StoredStudy,
    refusals: Refusals,
) -> list[str]:
    """Return each of `requested` once, or all `allowed` names if a name is unknown.

    An unknown name is stored in `refusals` and causes no further errors.
    """
    wrong = [name for name in dict.fromkeys(requested) if name not in allowed]
    for name in wrong:
        with refusals.noted():
            if noun == "metric":
                study.check_metric(name)
            raise ChoiceError(unknown(noun, name, filter(None, allowed)), study.name)
    return list(allowed if wrong else dict.fromkeys(requested))


def _order(
    study: StoredStudy,
    sort: Sequence[str],
    headings: Sequence[str],
    metrics: Sequence[str],
    refusals: Refusals,
) -> dict[str, bool]:
    """Return the columns to sort by, with True for ascending columns."""
    plain = {Column.read(name).metric: name for name in metrics}
    columns = {name: name for name in (*headings, *metrics)} | plain
    order: dict[str, bool] = {}
    for text in sort:
        name, _, direction = text.partition(":")
        _known("direction", [direction], DIRECTIONS, study, refusals=refusals)
        _known("column of this table", [name], columns, study, refusals=refusals)
        order[columns.get(name, name)] = DIRECTIONS.get(direction, True)
    return order


def _several(trials: pd.DataFrame, by: Sequence[str]) -> bool:
    """Return whether several points agree in the parameters `by`."""
    points = trials.drop_duplicates("point")
    return bool(points.duplicated(list(by)).any() if by else len(points) > 1)


def _first_done(trials: pd.DataFrame) -> list[str]:
    """Return an example trial of each point, in the order of `by_point`."""
    done_first = trials.assign(later=trials["status"] != "done").sort_values(
        "later", kind="stable"
    )
    shown = done_first.groupby("point")["trial_id"].first()
    return [str(shown.get(point)) for point in trials["point"].unique()]
