"""The trials of some points, those to look at first: the ones that are not done, then
the worst, the median and the best by a metric, then all others by that metric. Of a
metric without better values these are the lowest, the median and the highest.
"""

from typing import Any

import numpy as np
import pandas as pd

from sweep.errors import ChoiceError
from sweep.explorer.asking import MOST_ROWS, AskSpec, AskTrials
from sweep.explorer.watching import Watched
from sweep.figures.directions import better_values
from sweep.figures.selection import recorded
from sweep.spec.recorded import Column
from sweep.tables.json_rows import json_rows
from sweep.tables.stored_study import StoredStudy
from sweep.tables.stored_tables import command
from sweep.text import unknown
from sweep.web.state import from_job
from sweep.workers.failures import in_a_line

SHOWN = [
    *("trial_id", "point", "replicate", "status", "error", "value", "part", "replay"),
]
NOTABLE = {
    "high": ("worst", "median", "best"),
    "low": ("worst", "median", "best"),
    "neither": ("lowest", "median", "highest"),
}
"""By which values of the metric are better, the first, middle and last trial."""


def trials(watched: Watched, asked: AskTrials) -> dict[str, Any]:
    """A page of the trials: `rows` with `trial_id`, `point`, `replicate`, `status`,
    `error` in a line, `value` of the metric, `part`, which is one of NOTABLE or "",
    and `replay`, the command. `points` are the settings of the points.

    Raises ChoiceError for an unknown point or metric.
    """
    study = watched.narrow(asked.study, (asked.metric,) if asked.metric else ())
    study = study.where(*asked.where)
    metric = asked.metric or study.metrics[0]
    column = str(Column(recorded(study, metric), asked.half))
    found = _of_points(study, asked.point)
    ordered = looked_at(found, column, better_values(study, metric))
    start = asked.page * MOST_ROWS
    shown = ordered.iloc[start : start + MOST_ROWS]
    troubled = shown["error"].fillna("").astype(str).map(in_a_line)
    rows = shown.assign(
        error=troubled.where(shown["status"] != "done", ""),
        value=shown[column],
        replay=[command("replay", study.name, one) for one in shown["trial_id"]],
    )
    points = list(dict.fromkeys(shown["point"]))
    told = study.points.loc[points, study.headings]
    settings = dict(zip(told.index, json_rows(told), strict=True))
    return {
        "metric": column,
        "unit": study.units.get(column, ""),
        "total": len(ordered),
        "page": asked.page,
        "size": MOST_ROWS,
        "rows": json_rows(rows[SHOWN]),
        "settings": {point: settings.get(point, {}) for point in points},
    }


def spec(watched: Watched, asked: AskSpec) -> dict[str, Any]:
    """The YAML that launches a stored trial, its point and the number of its replicate:
    what the page of the simulator opens.

    Raises as StoredStudy.trial and StoredStudy.job.
    """
    study = StoredStudy(asked.study, watched.results, trust=watched.trust)
    state = from_job(study.job(study.trial(asked.trial)))
    point, replicate = state.job.point, state.replicate
    return {"yaml": state.as_text(), "point": point, "replicate": replicate}


def looked_at(found: pd.DataFrame, column: str, better: str) -> pd.DataFrame:
    """Trials in the order in which they are worth a look, with their `part`.

    The median is the trial in the middle: of an even number the lower one of two.
    """
    values = found[column].to_numpy(np.float64)
    known = (found["status"] == "done").to_numpy() & np.isfinite(values)
    places = np.flatnonzero(known)
    upwards = places[np.argsort(values[places], kind="stable")]
    from_worst = upwards[::-1] if better == "low" else upwards
    part, first = np.full(len(found), "", dtype=object), list[int]()
    if len(upwards):
        chosen = (from_worst[0], upwards[(len(upwards) - 1) // 2], from_worst[-1])
        for name, place in zip(NOTABLE[better], chosen, strict=True):
            if not part[place]:
                part[place] = name
                first.append(int(place))
    not_done = np.flatnonzero((found["status"] != "done").to_numpy())
    order = [*not_done, *first, *from_worst, *np.arange(len(found))]
    return found.assign(part=part).iloc[list(dict.fromkeys(order))]


def _of_points(study: StoredStudy, wanted: tuple[str, ...]) -> pd.DataFrame:
    if not wanted:
        return study.trials
    for point in wanted:
        if point not in study.points.index:
            raise ChoiceError(unknown("point", point, study.points.index), study.name)
    return study.trials[study.trials["point"].isin(wanted)]
