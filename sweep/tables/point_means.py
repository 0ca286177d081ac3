"""The table of a study: means of its metrics with intervals, a row a point, or a row
for all points that agree in some settings; chosen, sorted and counted.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import pandas as pd

from sweep.analysis import MeanKind, by_point, pooled
from sweep.errors import ChoiceError
from sweep.spec.recorded import Column
from sweep.tables.choosing import Refusals, as_names
from sweep.tables.search_phases import by_phase
from sweep.tables.stored_study import StoredStudy
from sweep.text import unknown

DIRECTIONS = {"": True, "asc": True, "desc": False}
"""Whether values ascend, by what follows the name of a column to sort by."""


@dataclass(frozen=True, eq=False)
class PointMeans:
    """A table of means.

    `rows` has the columns of `headings`, which tell the rows apart; where rows pool
    several points `points`, how many; what `by_point` has of each of `metrics`;
    `not_done`; and `trial_id`, a trial of the row to look at, one that is done if there
    is one. `pooled` says whether a row has several points, whose values are means over
    them, one a replicate. `interval` is the kind that was asked for.
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
    """The means of metrics with 95 % intervals.

        study     the stored study; `where` chooses among its points
        metrics   names of metrics; () for all that are recorded
        by        settings: one row for all points that agree in them, see `pooled`;
                  None for a row a point
        sort      columns to sort by, each a setting or a metric, with `:desc` after it
                  where the largest come first
        half      means over the last half of a trial, or the last frame
        interval  which interval of a mean; None for that of its distribution

    A list of one name may be this name. The settings of an axis that ablates a preset
    are one column, `detail`, which says what is changed. A search has a row for each
    `phase` of a candidate. Raises ChoiceError for a metric that the study has not
    recorded, a setting that does not vary, and a column that the table has not: all
    together.
    """
    study = by_phase(study)
    refusals = Refusals()
    wanted = as_names(metrics) or study.metrics
    chosen = _known("metric", wanted, study.metrics, study, refusals)
    names = [str(Column(name, half)) for name in chosen]
    varied = list(dict.fromkeys([*study.headings, *study.varied]))
    settings = study.headings if by is None else as_names(by)
    headings = _known("varied setting", settings, varied, study, refusals)
    kept = [name for name in study.kept_apart if name in varied]
    headings = list(dict.fromkeys([*kept, *headings]))
    order = _order(study, as_names(sort), headings, names, refusals)
    refusals.check()
    details = {
        name: study.trials["point"].map(study.points[name])
        for name in study.headings
        if name not in study.trials
    }
    trials = study.trials.assign(**details)
    together = by is not None and _several(trials, headings)
    if together:
        trials = pooled(trials, headings, names)
    rows = by_point(
        trials,
        [*headings, *(["points"] if together else [])],
        names,
        interval=interval,
        repeated={} if together else study.repeated,
        distributions=study.distributions,
    )
    rows = rows.assign(trial_id=_first_done(trials))
    if order:
        rows = rows.sort_values(
            list(order), ascending=list(order.values()), kind="stable"
        ).reset_index(drop=True)
    return PointMeans(rows, headings, names, together, interval)


def _known(
    what: str,
    names: Sequence[str],
    allowed: Collection[str],
    study: StoredStudy,
    refusals: Refusals,
) -> list[str]:
    """Each of `names` once; all that are `allowed` where one is unknown, which is
    noted, so that nothing else is refused for it.
    """
    wrong = [name for name in dict.fromkeys(names) if name not in allowed]
    for name in wrong:
        with refusals.noted():
            if what == "metric":
                study.check_metric(name)
            listed = [one for one in allowed if one]
            raise ChoiceError(unknown(what, name, listed), study.name)
    return list(allowed if wrong else dict.fromkeys(names))


def _order(
    study: StoredStudy,
    sort: Sequence[str],
    headings: Sequence[str],
    metrics: Sequence[str],
    refusals: Refusals,
) -> dict[str, bool]:
    """The columns to sort by, each with whether it ascends."""
    plain = {Column.read(name).metric: name for name in metrics}
    columns = {name: name for name in (*headings, *metrics)} | plain
    order: dict[str, bool] = {}
    for text in sort:
        name, _, direction = text.partition(":")
        _known("direction", [direction], DIRECTIONS, study, refusals)
        _known("column of this table", [name], columns, study, refusals)
        order[columns.get(name, name)] = DIRECTIONS.get(direction, True)
    return order


def _several(trials: pd.DataFrame, by: Sequence[str]) -> bool:
    """Whether several points agree in the settings `by`."""
    points = trials.drop_duplicates("point")
    return bool(points.duplicated(list(by)).any() if by else len(points) > 1)


def _first_done(trials: pd.DataFrame) -> list[str]:
    """The trial to look at, for each point, in the order of `by_point`."""
    done_first = trials.assign(later=trials["status"] != "done").sort_values(
        "later", kind="stable"
    )
    shown = done_first.groupby("point")["trial_id"].first()
    return [str(shown.get(point)) for point in trials["point"].unique()]
