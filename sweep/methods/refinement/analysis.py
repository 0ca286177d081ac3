"""Where the mean of a metric crosses a level, or changes most, in a stored study whose
grid was refined there.
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
from sweep.tables.stored_study import StoredStudy

STATES = ("above", "below", "outside", "boundary", "unresolved")
BUDGET, FEW, MORE, NOISE, NO_POINTS, SEVERAL, SLOPES = (
    "the budget is spent",
    "points have fewer than two values",
    "trials are missing",
    "max trials do not tell on which side the points are",
    "launch the study again; if it stays so, require leaves points out",
    "the mean changes most in several places, or changes too little to tell",
    "max trials do not tell where the slope grows and falls",
)
"""Why a cell is unresolved."""


class Boundary(NamedTuple):
    """What a refined study knows of its boundary.

    rule        the rule by which it was refined
    points      a row a point, in the order of the plan: its `group`, the settings by
                which groups differ and the refined ones; the number of `values`, the
                mean, its interval at all looks (low, high), and its side of the level:
                -1 below, 1 above, 0 where the interval includes it
    cells       a row a cell of the grid: its group, those settings, `<axis>_low` and
                `<axis>_high` of each refined axis, its `state`, one of STATES, and why
                it is unresolved
    crossings   of a rule with one axis, a row for each crossing of a group: between
                `low` and `high`, the nearest points that surely lie on either side, at
                about `estimate`; `direction` is up or down, and `resolved` says whether
                all between is as fine as was asked for. None for several axes. Where
                the place is sought at which the mean changes most, a row for each
                group, whose `direction` is unknown where the ends do not differ
    """

    rule: Refinement
    points: pd.DataFrame
    cells: pd.DataFrame
    crossings: pd.DataFrame | None

    @property
    def settings(self) -> list[str]:
        """The settings by which groups differ."""
        names = list(self.points.columns)
        return names[1 : names.index(next(iter(self.rule.scales)))]

    @property
    def crossed(self) -> frozenset[int]:
        """The groups in which the mean is known to cross the level somewhere."""
        if self.crossings is not None:
            return frozenset(self.crossings["group"])
        cells = self.cells
        return frozenset(cells["group"][cells["state"] == "boundary"])

    @property
    def rows(self) -> pd.DataFrame:
        """What tells where the boundary is: the crossings of one axis, else the cells
        that it goes through, or that are not resolved.
        """
        if self.crossings is not None:
            return self.crossings.drop(columns="group")
        known = self.cells["state"].isin(["above", "below"])
        return self.cells[~known].drop(columns="group").reset_index(drop=True)


def find_boundary(study: StoredStudy) -> Boundary:
    """The boundary of a study whose spec has `refine`. Raises ChoiceError for another.

    A crossing of one axis lies within `low` and `high` with the confidence of the rule,
    where the mean crosses the level once: all looks at all points of the axis hold
    together. Of several axes that is so along each line through the points.
    """
    about = study.about.sections.get("refine")
    if about is None:
        raise ChoiceError('its grid is fixed; the spec has no "refine"', study.name)
    rule = from_json(about)
    groups, places = _places(study, rule)
    trials, values = _values(study, rule, list(places))
    seen = look(rule, trials, values, study.distributions[rule.metric])
    where, at = _where(groups), [*places.values()]
    found: pd.DataFrame | None
    if rule.steepest:
        cells, found = _steepest(study, rule, at, seen, trials)
    else:
        cells = _cells(study, rule, len(groups), at, seen, trials)
        found = _crossings(rule, at, seen, cells) if _alone(rule) else None
    return Boundary(
        rule,
        _points(rule, groups, places, seen),
        _named(cells, where),
        None if found is None else _named(found, where),
    )


def _where(groups: pd.DataFrame) -> dict[str, list[Any]]:
    """The settings of each group."""
    return {str(name): list(column) for name, column in groups.items()}


def _alone(rule: Refinement) -> bool:
    return len(rule.scales) == 1


def _places(
    study: StoredStudy, rule: Refinement
) -> tuple[pd.DataFrame, dict[str, Place]]:
    """The settings by which groups differ, a row a group, and the place of each point,
    by its id.
    """
    fields = dict.fromkeys(name for one in study.axes.values() for name in one.settings)
    others = [name for name in fields if name not in rule.scales]
    points = study.points
    rows = [tuple(row) for row in points[others].itertuples(index=False)]
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
    return pd.DataFrame(groups, columns=others), places


def _values(
    study: StoredStudy, rule: Refinement, points: list[str]
) -> tuple[Counts, Any]:
    """How many trials each point has in the plan, and their values, point after point;
    NaN where a trial is missing or has none.
    """
    plan = study.plan.select(["trial_id", "point"]).to_pandas()
    order = pd.CategoricalDtype(points, ordered=True)
    plan["point"] = plan["point"].astype(order)
    plan = plan[plan["point"].notna()].sort_values("point", kind="stable")
    stored = study.trials.set_index("trial_id")[rule.metric]
    trials = plan["point"].value_counts(sort=False).reindex(points).to_numpy(np.int64)
    return trials, stored.reindex(plan["trial_id"]).to_numpy(np.float64)


def _points(
    rule: Refinement, groups: pd.DataFrame, places: dict[str, Place], seen: SeenPoints
) -> pd.DataFrame:
    at = np.array([*places.values()], np.int64)
    columns: dict[str, Any] = {"group": at[:, 0]}
    for name, column in groups.items():
        columns[str(name)] = column.to_numpy()[at[:, 0]]
    for number, (name, scale) in enumerate(rule.scales.items(), 1):
        columns[name] = [scale.at(place) for place in at[:, number].tolist()]
    for name in ("values", "mean", "low", "high", "side"):
        columns[name] = getattr(seen, name)
    return pd.DataFrame(columns, index=pd.Index([*places], name="point"))


def _cells(
    study: StoredStudy,
    rule: Refinement,
    groups: int,
    places: list[Place],
    seen: SeenPoints,
    trials: Counts,
) -> pd.DataFrame:
    present = {*places}
    cells = leaves(rule, groups, present)
    sides = sides_of(cells, places, seen, trials)
    left = rule.budget - int(trials.sum())
    parted = [[*_new(rule, cell, present)] for cell in cells]
    whole = np.array([not cell.parts(rule) for cell in cells], np.bool_)
    dear = np.array([len(new) * rule.least > left for new in parted], np.bool_)
    crossed = sides.crossed
    state = np.select(
        [
            crossed & whole,
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
    """The points that halving a cell would ask for."""
    return {corner for part in cell.parts(rule) for corner in part.corners} - {*present}


def _ends(rule: Refinement, cells: list[Cell]) -> dict[str, list[float]]:
    return {
        f"{name}_{end}": [scale.at(getattr(cell, end)[number]) for cell in cells]
        for number, (name, scale) in enumerate(rule.scales.items(), 1)
        for end in ("low", "high")
    }


def _crossings(
    rule: Refinement, places: list[Place], seen: SeenPoints, cells: pd.DataFrame
) -> pd.DataFrame:
    ((name, scale),) = rule.scales.items()
    rows = []
    for one in crossings(rule, places, seen):
        low, high = scale.at(one.low), scale.at(one.high)
        between = cells[
            (cells["group"] == one.group)
            & (cells[f"{name}_low"] >= low)
            & (cells[f"{name}_high"] <= high)
        ]
        rows.append(
            {
                "group": one.group,
                "estimate": one.estimate,
                "low": low,
                "high": high,
                "direction": "up" if one.rises else "down",
                "resolved": bool((between["state"] == "boundary").all()),
            }
        )
    columns = ["group", "estimate", "low", "high", "direction", "resolved"]
    return pd.DataFrame(rows, columns=columns)


def _steepest(
    study: StoredStudy,
    rule: Refinement,
    places: list[Place],
    seen: SeenPoints,
    trials: Counts,
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The cells between neighbouring points, and of each group the interval that has
    the place where the mean changes most.
    """
    ((_, scale),) = rule.scales.items()
    parts, rows = list[pd.DataFrame](), list[dict[str, Any]]()
    for one in steepest.peaks(rule, places, seen):
        line = sorted(place for place in places if place[0] == one.group)
        cells = [Cell(*pair) for pair in pairwise(line)]
        inside = [one.low <= cell.low[1] < one.high for cell in cells]
        kept = [cell for cell, within in zip(cells, inside, strict=True) if within]
        why = _unsettled(study, rule, one, kept, trials)
        within = "unresolved" if why else "boundary"
        columns = {"group": [one.group] * len(cells)} | _ends(rule, cells)
        state = [within if one_is else "outside" for one_is in inside]
        whys = [why if one_is else "" for one_is in inside]
        parts.append(pd.DataFrame(columns).assign(state=state, why=whys))
        direction = {True: "up", False: "down", None: "unknown"}[one.rises]
        ends = {"low": scale.at(one.low), "high": scale.at(one.high)}
        about = {"group": one.group, "estimate": one.estimate}
        rows.append(about | ends | {"direction": direction, "resolved": not why})
    columns_of = ["group", "estimate", "low", "high", "direction", "resolved"]
    empty = pd.DataFrame({"group": [], **_ends(rule, []), "state": [], "why": []})
    return pd.concat(parts) if parts else empty, pd.DataFrame(rows, columns=columns_of)


def _unsettled(
    study: StoredStudy,
    rule: Refinement,
    one: steepest.Peak,
    cells: list[Cell],
    trials: Counts,
) -> str:
    """Why the place is not known as well as it is asked for; "" where it is."""
    whole = not any(cell.parts(rule) for cell in cells)
    if whole and len(cells) <= steepest.WIDE and one.rises is not None:
        return SEVERAL if one.several else ""
    if study.missing:
        return MORE
    if one.several or one.rises is None:
        return SEVERAL
    left = rule.budget - int(trials.sum())
    return BUDGET if left < rule.least * len(cells) else SLOPES


def _named(table: pd.DataFrame, where: dict[str, list[Any]]) -> pd.DataFrame:
    """The table with the settings of each group behind its number."""
    named = table.copy()
    for name, values in [*where.items()][::-1]:
        named.insert(1, name, [values[number] for number in table["group"]])
    return named
