"""Hysteresis loops of a stored study whose chains go up and down.

A loop is the area between the means of the two directions, for a metric and a group of
chains.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import Loop, loop
from sweep.errors import ChoiceError
from sweep.spec import DIRECTION, DOWN, UP, Column, Over, is_half
from sweep.tables import StoredStudy, as_names

Floats = NDArray[np.float64]
LEAST = 2
"""Fewest values of the axis that enclose an area."""


class FoundLoop(NamedTuple):
    """The loop of a metric in a group of chains.

    Attributes
    ----------
    metric : str
        Name of the column.
    settings : dict
        Values of the parameters in which groups differ.
    values : array
        Values of the continued axis, (k,), ascending.
    up, down : array
        Metric of each chain at each value, (chains, k). NaN if a link is missing or is
        not done.
    loop : Loop
        Area and differences, over complete chains.
    incomplete : int
        Number of chains that lack a link and do not count.
    """

    metric: str
    settings: dict[str, object]
    values: Floats
    up: Floats
    down: Floats
    loop: Loop
    incomplete: int


def find_loops(
    study: StoredStudy,
    metrics: str | Sequence[str] = (),
    *,
    over: Over = "last",
    half: bool = False,
) -> list[FoundLoop]:
    """Return the loops of a study with an axis that is continued in two directions.

    Parameters
    ----------
    study : StoredStudy
        `where` chooses among the points.
    metrics : str or sequence of str, optional
        By default all metrics that are recorded.
    over : {"last", "half"}, default "last"
        The last frame of each link, or the mean over its second half.
    half : bool, default False
        The older form of `over="half"`.

    Returns
    -------
    list of FoundLoop
        For each metric, one loop per group of chains.

    Raises
    ------
    ChoiceError
        The study has no suitable axis, fewer than two of its values are chosen, or a
        metric is not recorded.
    """
    continued = study.about.continued
    if continued is None or continued["directions"] != [UP, DOWN]:
        message = 'no axis has "continue: both", so there is no loop'
        raise ChoiceError(message, study.name)
    for name in as_names(metrics):
        study.check_metric(name)
    half = is_half(over, half)
    columns = [str(Column(name, half)) for name in as_names(metrics) or study.metrics]
    axis = continued["axis"]
    return [group for name in columns for group in _loops(study, axis, name)]


def _loops(study: StoredStudy, axis: str, column: str) -> Iterator[FoundLoop]:
    points = study.points
    linked = {axis, DIRECTION} | _follow(study, axis)
    grouping = [str(name) for name in points.columns if name not in linked]
    trials = study.trials[study.trials["status"] == "done"]
    values = trials.set_index("trial_id")[column]
    plan: pd.DataFrame = study.plan.to_pandas()
    rows = plan.assign(metric=plan["trial_id"].map(values))
    groups = rows.groupby(grouping, sort=False) if grouping else [((), rows)]
    for key, group in groups:
        settings = dict(zip(grouping, key, strict=True))
        yield _loop(study, axis, column, settings, group=group)


def _follow(study: StoredStudy, axis: str) -> set[str]:
    """Return derived parameters, which no axis has: the values may depend on `axis`."""
    own = {name for entry in study.axes.values() for name in entry.settings}
    return {str(name) for name in study.points.columns} - own - {axis}


def _loop(
    study: StoredStudy,
    axis: str,
    column: str,
    settings: dict[str, object],
    *,
    group: pd.DataFrame,
) -> FoundLoop:
    """Return the loop of a column in a group of the plan's rows."""
    table = group.pivot_table(
        index="replicate",
        columns=[DIRECTION, axis],
        values="metric",
        aggfunc="first",
        dropna=False,
    )
    ways = {way: table.get(way, pd.DataFrame()) for way in (UP, DOWN)}
    shared = sorted(set(ways[UP].columns) & set(ways[DOWN].columns))
    if len(shared) < LEAST:
        reason = f"a loop needs {LEAST} values of {axis} in each direction"
        raise ChoiceError(f"{reason}, but has {len(shared)}", study.name)
    values = np.array(shared, np.float64)
    up, down = (ways[way][shared].to_numpy(np.float64) for way in (UP, DOWN))
    estimate = loop(values, up, down)
    return FoundLoop(
        metric=column,
        settings=settings,
        values=values,
        up=up,
        down=down,
        loop=estimate,
        incomplete=len(table) - estimate.chains,
    )


def loop_rows(loops: Sequence[FoundLoop]) -> pd.DataFrame:
    """Return one row per loop.

    Columns: parameters of the loop, `metric`, `area` with its 95 % confidence interval
    (`low`, `high`), and the numbers of complete `chains` and of `incomplete` chains.
    `from` and `to` are the ends of the range of values at which the directions differ,
    NaN without a difference. `width` is the length of this range.
    """
    rows = []
    for group in loops:
        estimate = group.loop
        apart = group.values[estimate.apart]
        ends = (apart.min(), apart.max()) if len(apart) else (np.nan, np.nan)
        rows.append(
            {
                **group.settings,
                "metric": group.metric,
                "area": estimate.area.value,
                "low": estimate.area.low,
                "high": estimate.area.high,
                "chains": estimate.chains,
                "incomplete": group.incomplete,
                "from": ends[0],
                "to": ends[1],
                "width": estimate.width,
            }
        )
    return pd.DataFrame(rows)
