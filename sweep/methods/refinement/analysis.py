"""The boundary in a stored study whose grid was refined.

At the boundary, the mean of a metric crosses a level or changes most.
"""

from collections.abc import Iterable
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from sweep.errors import ChoiceError
from sweep.methods.refinement import steepest
from sweep.methods.refinement.rule import (
    Cell,
    Counts,
    Place,
    Refinement,
    SeenPoints,
    crossings,
    from_json,
    leaves,
    look,
    sides_of,
)
from sweep.tables import StoredStudy

STATES = ("above", "below", "outside", "boundary", "unresolved")
COLUMNS = ["group", "estimate", "low", "high", "direction", "resolved"]
"""Columns of `Boundary.crossings`, without the parameters of groups."""

# Reasons why a cell is unresolved.
BUDGET = "the budget is spent"
FEW = "points have fewer than two values"
MORE = "trials are missing"
NOISE = "max trials do not tell on which side the points are"
NO_POINTS = "launch the study again; if it stays so, require leaves points out"
SEVERAL = "the mean changes most at several values, or changes too little to tell"
SLOPES = "max trials do not tell where the slope grows and falls"


class Boundary(NamedTuple):
    """The boundary of a refined study.

    Attributes
    ----------
    rule : Refinement
        The rule by which the study was refined.
    points : DataFrame
        One row per point, in the order of the plan. Columns: the group; the parameters
        by which groups differ; the refined parameters; the number of values; the mean;
        low and high, the bounds of the confidence interval, simultaneous for all looks;
        the side of the level, which is -1 below, 1 above, and 0 if the interval
        includes the level.
    cells : DataFrame
        One row per cell of the grid. Columns: the group; the parameters by which groups
        differ; `<axis>_low` and `<axis>_high` of each refined axis; the state, an entry
        of `STATES`; the reason of an unresolved state.
    crossings : DataFrame or None
        With one refined axis, one row per crossing of a group. Columns: low and high,
        the nearest points that are known to be on either side; estimate, the estimated
        position; direction, up or down; resolved, True if the grid between low and high
        is as fine as the rule demands. With `at: steepest` there
        is one row per group, whose direction is unknown if the ends do not differ. None
        for several axes.
    """

    rule: Refinement
    points: pd.DataFrame
    cells: pd.DataFrame
    crossings: pd.DataFrame | None

    @property
    def settings(self) -> list[str]:
        """The parameters by which groups differ."""
        columns = list(self.points.columns)
        return columns[1 : columns.index(next(iter(self.rule.scales)))]

    @property
    def crossed(self) -> frozenset[int]:
        """The groups in which the mean is known to cross the level somewhere."""
        if self.crossings is not None:
            return frozenset(self.crossings["group"])
        cells = self.cells
        return frozenset(cells["group"][cells["state"] == "boundary"])

    @property
    def rows(self) -> pd.DataFrame:
        """The crossings of one axis, or the cells at the boundary or unresolved."""
        if self.crossings is not None:
            return self.crossings.drop(columns="group")
        decided = self.cells["state"].isin(["above", "below"])
        return self.cells[~decided].drop(columns="group").reset_index(drop=True)


def find_boundary(study: StoredStudy) -> Boundary:
    """Return the boundary of a study whose spec has `refine`.

    With one axis, a crossing is between `low` and `high` with the confidence of the
    rule, if the mean crosses the level once. All looks at all points of the axis are
    simultaneous. With several axes the statement holds along each line through the
    points. Raises ChoiceError if the spec has no `refine`.
    """
    record = study.about.sections.get("refine")
    if record is None:
        raise ChoiceError(
            'the spec has no "refine", so there is no boundary;'
            " see sweep guide phase-boundaries",
            study.name,
        )
    rule = from_json(record)
    groups, places = _places(study, rule)
    trials, values = _values(study, rule, list(places))
    observed = look(rule, trials, values, study.distributions[rule.metric])
    at = [*places.values()]
    crossing: pd.DataFrame | None = None
    if rule.steepest:
        cells, crossing = _steepest(study, rule, at, observed, trials=trials)
    else:
        cells = _cells(study, rule, len(groups), at, observed=observed, trials=trials)
        if len(rule.scales) == 1:
            crossing = _crossings(rule, at, observed, cells)
    settings = {str(name): list(column) for name, column in groups.items()}
    return Boundary(
        rule=rule,
        points=_points(rule, groups, places, observed),
        cells=_named(cells, settings),
        crossings=None if crossing is None else _named(crossing, settings),
    )


def _places(
    study: StoredStudy, rule: Refinement
) -> tuple[pd.DataFrame, dict[str, Place]]:
    """Return the parameters of groups, one row per group, and positions of points.

    Positions are by id of the point. A point without a position is left out.
    """
    fields = dict.fromkeys(
        name for axis in study.axes.values() for name in axis.settings
    )
    settings = [name for name in fields if name not in rule.scales]
    points = study.points
    rows = [tuple(row) for row in points[settings].itertuples(index=False)]
    groups = list(dict.fromkeys(rows))
    numbers = {group: number for number, group in enumerate(groups)}
    along = [
        [scale.place(float(value)) for value in points[name]]
        for name, scale in rule.scales.items()
    ]
    places = {
        str(point): (numbers[row], *at)
        for point, row, *at in zip(points.index, rows, *along, strict=True)
        if None not in at
    }
    return pd.DataFrame(groups, columns=settings), places


def _values(
    study: StoredStudy, rule: Refinement, points: list[str]
) -> tuple[Counts, Any]:
    """Return the number of trials of each point in the plan, and values of all trials.

    Values are in the order of points; NaN if a trial is missing or has no value.
    """
    plan = study.plan.select(["trial_id", "point"]).to_pandas()
    order = pd.CategoricalDtype(points, ordered=True)
    plan["point"] = plan["point"].astype(order)
    plan = plan[plan["point"].notna()].sort_values("point", kind="stable")
    stored = study.trials.set_index("trial_id")[rule.metric]
    trials = plan["point"].value_counts(sort=False).reindex(points).to_numpy(np.int64)
    return trials, stored.reindex(plan["trial_id"]).to_numpy(np.float64)


def _points(
    rule: Refinement,
    groups: pd.DataFrame,
    places: dict[str, Place],
    observed: SeenPoints,
) -> pd.DataFrame:
    at = np.array([*places.values()], np.int64)
    columns: dict[str, Any] = {"group": at[:, 0]}
    for name, column in groups.items():
        columns[str(name)] = column.to_numpy()[at[:, 0]]
    for number, (name, scale) in enumerate(rule.scales.items(), 1):
        columns[name] = [scale.at(place) for place in at[:, number].tolist()]
    for name in ("values", "mean", "low", "high", "side"):
        columns[name] = getattr(observed, name)
    return pd.DataFrame(columns, index=pd.Index([*places], name="point"))


def _cells(
    study: StoredStudy,
    rule: Refinement,
    groups: int,
    places: list[Place],
    observed: SeenPoints,
    trials: Counts,
) -> pd.DataFrame:
    present = {*places}
    cells = leaves(rule, groups, present)
    sides = sides_of(cells, places, observed, trials)
    left = rule.budget - int(trials.sum())
    new = [_new(rule, cell, present) for cell in cells]
    finest = np.array([not cell.parts(rule) for cell in cells], np.bool_)
    dear = np.array([len(corners) * rule.least > left for corners in new], np.bool_)
    crossed = sides.crossed
    state = np.select(
        [
            crossed & finest,
            crossed | sides.open | sides.lacking | sides.unsure,
            sides.above,
        ],
        ["boundary", "unresolved", "above"],
        "below",
    )
    why = np.select(
        [
            state != "unresolved",
            np.full(len(cells), study.missing > 0),
            sides.lacking,
            sides.unsure & ~crossed & ~sides.open,
            np.where(crossed, dear, left < rule.least),
        ],
        ["", MORE, FEW, NOISE, BUDGET],
        NO_POINTS,
    )
    ends = _ends(rule, cells)
    return pd.DataFrame({"group": [cell.low[0] for cell in cells]} | ends).assign(
        state=state, why=why
    )


def _new(rule: Refinement, cell: Cell, present: Iterable[Place]) -> set[Place]:
    """Return the new points that halving a cell needs."""
    return {corner for part in cell.parts(rule) for corner in part.corners} - {*present}


def _ends(rule: Refinement, cells: list[Cell]) -> dict[str, list[float]]:
    return {
        f"{name}_{end}": [scale.at(getattr(cell, end)[number]) for cell in cells]
        for number, (name, scale) in enumerate(rule.scales.items(), 1)
        for end in ("low", "high")
    }


def _crossings(
    rule: Refinement, places: list[Place], observed: SeenPoints, cells: pd.DataFrame
) -> pd.DataFrame:
    ((name, scale),) = rule.scales.items()
    rows = []
    for crossing in crossings(rule, places, observed):
        low = scale.at(crossing.low)
        high = scale.at(crossing.high)
        between = cells[
            (cells["group"] == crossing.group)
            & (cells[f"{name}_low"] >= low)
            & (cells[f"{name}_high"] <= high)
        ]
        rows.append(
            {
                "group": crossing.group,
                "estimate": crossing.estimate,
                "low": low,
                "high": high,
                "direction": "up" if crossing.rises else "down",
                "resolved": bool((between["state"] == "boundary").all()),
            }
        )
    return pd.DataFrame(rows, columns=COLUMNS)


def _steepest(
    study: StoredStudy,
    rule: Refinement,
    places: list[Place],
    observed: SeenPoints,
    trials: Counts,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Return the cells between neighbouring points, and a row per group.

    The row has the interval with the position at which the mean changes most.
    """
    ((_, scale),) = rule.scales.items()
    parts = list[pd.DataFrame]()
    rows = list[dict[str, Any]]()
    for peak in steepest.peaks(rule, places, observed):
        line = sorted(place for place in places if place[0] == peak.group)
        cells = [Cell(*pair) for pair in pairwise(line)]
        inside = [peak.low <= cell.low[1] < peak.high for cell in cells]
        within = [cell for cell, is_in in zip(cells, inside, strict=True) if is_in]
        why = _why_unresolved(study, rule, peak, within, trials=trials)
        state = "unresolved" if why else "boundary"
        columns = {"group": [peak.group] * len(cells)} | _ends(rule, cells)
        part = pd.DataFrame(columns).assign(
            state=[state if is_in else "outside" for is_in in inside],
            why=[why if is_in else "" for is_in in inside],
        )
        parts.append(part)
        rows.append(
            {
                "group": peak.group,
                "estimate": peak.estimate,
                "low": scale.at(peak.low),
                "high": scale.at(peak.high),
                "direction": {True: "up", False: "down", None: "unknown"}[peak.rises],
                "resolved": not why,
            }
        )
    empty = pd.DataFrame({"group": [], **_ends(rule, []), "state": [], "why": []})
    return pd.concat(parts) if parts else empty, pd.DataFrame(rows, columns=COLUMNS)


def _why_unresolved(
    study: StoredStudy,
    rule: Refinement,
    peak: steepest.Peak,
    cells: list[Cell],
    trials: Counts,
) -> str:
    """Return why a peak is less precise than the rule demands; "" if precise enough."""
    finest = not any(cell.parts(rule) for cell in cells)
    if finest and len(cells) <= steepest.WIDE and peak.rises is not None:
        return SEVERAL if peak.several else ""
    if study.missing:
        return MORE
    if peak.several or peak.rises is None:
        return SEVERAL
    left = rule.budget - int(trials.sum())
    return BUDGET if left < rule.least * len(cells) else SLOPES


def _named(table: pd.DataFrame, settings: dict[str, list[Any]]) -> pd.DataFrame:
    """Return a table with the parameters of each group after its number."""
    named = table.copy()
    for name, values in [*settings.items()][::-1]:
        named.insert(1, name, [values[number] for number in table["group"]])
    return named
