"""The trials of some points, the notable trials first.

Trials that are not done come first. Then come the worst, the median and the best by a
metric, and then all other trials by that metric. For a metric without better values
the notable trials are the lowest, the median and the highest.
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.errors import ChoiceError
from sweep.explorer.asking import MOST_ROWS, AskSpec, AskTrials
from sweep.explorer.watching import Watched
from sweep.figures import better_values, recorded, select
from sweep.spec import Column
from sweep.tables import StoredStudy, command, json_rows
from sweep.text import unknown
from sweep.web import from_stored
from sweep.workers import in_a_line

SHOWN = [
    *("trial_id", "point", "replicate", "status", "error", "value", "part", "replay"),
]
NOTABLE = {
    "high": ("worst", "median", "best"),
    "low": ("worst", "median", "best"),
    "neither": ("lowest", "median", "highest"),
}
"""Names of the first, middle and last trial, by the direction of the metric."""


def trials(watched: Watched, question: AskTrials) -> dict[str, Any]:
    """Return a page of the trials of some points.

    `rows` have `trial_id`, `point`, `replicate` and `status`, the `error` in a single
    line, and the `value` of the metric. `part` of a row is a name of NOTABLE or "", and
    `replay` is the command. `settings` has the parameters of each point of the page,
    without those that follow from others. `median` is the id of the trial in the middle
    by the metric, "" if no trial is done.

    Raises ChoiceError for an unknown point or metric.
    """
    study = watched.narrow(
        question.study, (question.metric,) if question.metric else ()
    )
    study = study.where(*question.where)
    metric = question.metric or study.metrics[0]
    column = str(Column(recorded(study, metric), question.half))
    candidates = _of_points(study, question.point)
    ordered = looked_at(candidates, column, better_values(study, metric))
    start = question.page * MOST_ROWS
    shown = ordered.iloc[start : start + MOST_ROWS]
    troubled = shown["error"].fillna("").astype(str).map(in_a_line)
    rows = shown.assign(
        error=troubled.where(shown["status"] != "done", ""),
        value=shown[column],
        replay=[command("replay", study.name, trial) for trial in shown["trial_id"]],
    )
    points = list(dict.fromkeys(shown["point"]))
    derived = select(study).derived if study.done.any() else []
    free = [name for name in study.headings if name not in derived]
    parameters = study.points.loc[points, free]
    settings = dict(zip(parameters.index, json_rows(parameters), strict=True))
    return {
        "metric": column,
        "unit": study.units.get(column, ""),
        "total": len(ordered),
        "page": question.page,
        "size": MOST_ROWS,
        "rows": json_rows(rows[SHOWN]),
        "settings": {point: settings.get(point, {}) for point in points},
        "median": median_trial(candidates, column),
    }


def spec(watched: Watched, question: AskSpec) -> dict[str, Any]:
    """Return the YAML of the study of a stored trial, with point and replicate.

    The page of the simulator opens this YAML. The exceptions of StoredStudy.trial and
    StoredStudy.job are raised.
    """
    study = StoredStudy(question.study, watched.results, trust=watched.trust)
    return from_stored(study, study.job(study.trial(question.trial))).as_trial()


def median_trial(trials: pd.DataFrame, column: str) -> str:
    """Return the id of the done trial in the middle by a column; "" for none.

    For an even number of trials the lower of the two middle trials counts.

    Parameters
    ----------
    trials : DataFrame
    column : str
        Column of the metric.
    """
    upwards = _upwards(trials, column)
    if not len(upwards):
        return ""
    return str(trials["trial_id"].iloc[_middle(upwards)])


def looked_at(trials: pd.DataFrame, column: str, better: str) -> pd.DataFrame:
    """Return trials, the notable trials first, with a column `part`.

    The median is the trial in the middle; for an even number, the lower of the two
    middle trials.

    Parameters
    ----------
    trials : DataFrame, shape (T, ...)
    column : str
        Column of the metric.
    better : {"high", "low", "neither"}
        Which values of the metric are better.

    Returns
    -------
    DataFrame, shape (T, ...)
        The trials with a column `part`, which has names of NOTABLE or "".
    """
    upwards = _upwards(trials, column)
    from_worst = upwards[::-1] if better == "low" else upwards
    part = np.full(len(trials), "", dtype=object)
    first: list[int] = []
    if len(upwards):
        chosen = (from_worst[0], _middle(upwards), from_worst[-1])
        for name, place in zip(NOTABLE[better], chosen, strict=True):
            if not part[place]:
                part[place] = name
                first.append(int(place))
    not_done = np.flatnonzero((trials["status"] != "done").to_numpy())
    order = [*not_done, *first, *from_worst, *np.arange(len(trials))]
    return trials.assign(part=part).iloc[list(dict.fromkeys(order))]


def _upwards(trials: pd.DataFrame, column: str) -> NDArray[np.int64]:
    """Return the rows of the done trials with a value, by rising value."""
    values = trials[column].to_numpy(np.float64)
    measured = (trials["status"] == "done").to_numpy() & np.isfinite(values)
    rows = np.flatnonzero(measured)
    return rows[np.argsort(values[rows], kind="stable")]


def _middle(upwards: NDArray[np.int64]) -> int:
    """Return the row in the middle; of an even number, the lower of the middle rows."""
    return int(upwards[(len(upwards) - 1) // 2])


def _of_points(study: StoredStudy, points: tuple[str, ...]) -> pd.DataFrame:
    if not points:
        return study.trials
    for point in points:
        if point not in study.points.index:
            raise ChoiceError(unknown("point", point, study.points.index), study.name)
    return study.trials[study.trials["point"].isin(points)]
