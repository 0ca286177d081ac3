"""The loops of a stored study whose chains go up and down: between the means of both
directions, for each metric and each group of chains.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis.hysteresis import Loop, loop
from sweep.errors import ChoiceError
from sweep.spec.continuing import DIRECTION, DOWN, UP
from sweep.spec.recorded import Column, Over, is_half
from sweep.tables.choosing import as_names
from sweep.tables.stored_study import StoredStudy

Floats = NDArray[np.float64]
LEAST = 2
"""Values without which there is no area."""


class FoundLoop(NamedTuple):
    """The loop of one metric in one group of chains.

    `settings` are those in which groups differ, with their values; `values` (k,) of the
    continued axis; `up` and `down` (chains, k) the metric, NaN where a link is missing
    or did not come to its end. `incomplete` chains lack a link, and take no part.
    """

    metric: str
    settings: dict[str, object]
    values: Floats
    up: Floats
    down: Floats
    found: Loop
    incomplete: int


def find_loops(
    study: StoredStudy,
    metrics: str | Sequence[str] = (),
    *,
    over: Over = "last",
    half: bool = False,
) -> list[FoundLoop]:
    """The loops of a study with an axis that is continued in both directions.

    study    the stored study; `where` chooses among its points
    metrics  names of metrics; () for all that are recorded
    over     "last" or "half": the last frame of each link, or its last half
    half     True is the older form of over="half"

    Raises ChoiceError for a study without such an axis, where fewer than two of its
    values are chosen, and for a metric that is not recorded.
    """
    continued = study.about.continued
    if continued is None or continued["directions"] != [UP, DOWN]:
        words = 'no axis of it has "continue: both", so that there is no loop'
        raise ChoiceError(words, study.name)
    for name in as_names(metrics):
        study.check_metric(name)
    half = is_half(over, half)
    names = [str(Column(name, half)) for name in as_names(metrics) or study.metrics]
    return [one for name in names for one in _loops(study, continued["axis"], name)]


def _loops(study: StoredStudy, axis: str, column: str) -> Iterator[FoundLoop]:
    points = study.points
    linked = {axis, DIRECTION} | _follow(study, axis)
    others = [str(name) for name in points.columns if name not in linked]
    trials = study.trials[study.trials["status"] == "done"]
    known = trials.set_index("trial_id")[column]
    plan: pd.DataFrame = study.plan.to_pandas()
    rows = plan.assign(metric=plan["trial_id"].map(known))
    groups = rows.groupby(others, sort=False) if others else [((), rows)]
    for key, group in groups:
        yield _loop(study, axis, column, dict(zip(others, key, strict=True)), group)


def _follow(study: StoredStudy, axis: str) -> set[str]:
    """The settings that are derived, and so no axis: they may follow from `axis`."""
    own = {name for one in study.axes.values() for name in one.settings}
    return {str(name) for name in study.points.columns} - own - {axis}


def _loop(
    study: StoredStudy,
    axis: str,
    column: str,
    settings: dict[str, object],
    group: pd.DataFrame,
) -> FoundLoop:
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
        words = f"a loop needs {LEAST} values of {axis} in both directions"
        raise ChoiceError(f"{words}, and has {len(shared)}", study.name)
    values = np.array(shared, np.float64)
    up, down = (ways[way][shared].to_numpy(np.float64) for way in (UP, DOWN))
    found = loop(values, up, down)
    return FoundLoop(
        column, settings, values, up, down, found, len(table) - found.chains
    )


def loop_rows(loops: Sequence[FoundLoop]) -> pd.DataFrame:
    """A row a loop: its settings, `metric`, `area` with its 95 % interval (`low`,
    `high`), the number of `chains`, how many are `incomplete`, and between which values
    of the continued axis both directions differ (`from`, `to`, `width`).
    """
    rows = []
    for one in loops:
        found, apart = one.found, one.values[one.found.apart]
        ends = (apart.min(), apart.max()) if len(apart) else (np.nan, np.nan)
        rows.append(
            {
                **one.settings,
                "metric": one.metric,
                "area": found.area.value,
                "low": found.area.low,
                "high": found.area.high,
                "chains": found.chains,
                "incomplete": one.incomplete,
                "from": ends[0],
                "to": ends[1],
                "width": found.width,
            }
        )
    return pd.DataFrame(rows)
