"""Which points of two sides of a comparison belong together, and how they differ."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import replicates
from sweep.errors import ChoiceError
from sweep.methods.comparison.sides import Side
from sweep.store.origin import same_code

DIGITS = 9
"""Numbers that agree in so many figures are the same, so that 0.3 finds 3 * 0.1."""

ABOUT = ("model", "preset", "kernels", "shapes of the map", "every")
"""What two points may differ in beside settings."""

Two = tuple[pd.DataFrame, pd.DataFrame]


@dataclass(frozen=True, eq=False)
class Matching:
    """Points of two sides that agree in the settings `names`.

    `settings` has the values of those, a row a pair, and `points` (pairs, 2) the ids.
    `alone` has the settings of the points of either side that have no partner, and
    `same` counts the pairs that are left out because both are the same trials. `differ`
    holds the values on either side of all else in which the points of some pair differ.
    """

    names: list[str]
    settings: pd.DataFrame
    points: NDArray[np.object_]
    alone: Two
    same: int
    differ: Mapping[str, tuple[list[Any], list[Any]]]


def match(one: Side, other: Side) -> Matching:
    """The points of two sides, matched on the settings that vary on either and have a
    value in common.

    Settings that both sides name are not matched on. Raises ChoiceError where several
    points of a side agree in all that is matched on, where no point has a partner, and
    where the two sides are the same trials.
    """
    alike = same_code(one.study.provenance, other.study.provenance)
    tables = _points(one, alike), _points(other, alike)
    settings = _settings(one, other)
    names = [
        name
        for name in settings
        if name not in one.named & other.named and _is_matched_on(name, *tables)
    ]
    keyed = [table.set_axis(_keys(table[names]), axis="index") for table in tables]
    for side, partner, table in (
        (one, keyed[1], keyed[0]),
        (other, keyed[0], keyed[1]),
    ):
        _check_single(side, table, partner, names)
    common = [key for key in keyed[0].index if key in keyed[1].index]
    if not common:
        raise ChoiceError(
            f"no point of {one.text} agrees with one of {other.text} in"
            f" {', '.join(names)}"
        )
    first, second = (table.loc[common] for table in keyed)
    same = (
        (first["candidate"] == second["candidate"])
        & first["candidate"].isin(_shared_candidates(one, other))
    ).to_numpy()
    if same.all():
        only = (
            "are the same trials"
            if len(common) == len(keyed[0])
            else "agree only where both are the same trials"
        )
        raise ChoiceError(
            f"{one.text} and {other.text} {only}: there is nothing to compare"
        )
    first, second = first[~same], second[~same]
    return Matching(
        names,
        first[names].reset_index(drop=True),
        np.column_stack([first["point"], second["point"]]),
        (keyed[0].drop(common)[names], keyed[1].drop(common)[names]),
        int(same.sum()),
        _differences(
            first, second, [*ABOUT, *(name for name in settings if name not in names)]
        ),
    )


def telling(settings: pd.DataFrame) -> list[str]:
    """The first columns that are enough to tell the rows apart as well as all do."""
    chosen: list[str] = []
    groups = 1
    for name in settings.columns:
        if (
            groups < len(settings)
            and (finer := settings.groupby([*chosen, name]).ngroups) > groups
        ):
            chosen, groups = [*chosen, name], finer
    return chosen


def _settings(one: Side, other: Side) -> list[str]:
    """The settings of both sides, varied ones first, in the order of the specs. What
    keeps points of the same settings apart is as one of them, as the direction of
    chains, where both sides have all of the same values or none.
    """
    names = dict.fromkeys([*one.study.varied, *other.study.varied, *one.study.settings])
    known = [
        {*side.study.settings, *side.study.kept_apart} & set(side.trials)
        for side in (one, other)
    ]
    shared = [name for name in names if name in known[0] & known[1]]
    apart = {*one.study.kept_apart, *other.study.kept_apart}
    return [
        name
        for name in shared
        if name not in apart or not _overlap(one.trials[name], other.trials[name])
    ]


def _overlap(one: "pd.Series[Any]", other: "pd.Series[Any]") -> bool:
    """Whether columns have some values in common, and others not."""
    values, others = set(one), set(other)
    return values != others and not values.isdisjoint(others)


def _points(side: Side, alike: bool) -> pd.DataFrame:
    """One row a point: its id, its settings, and what else it is; `alike` says that
    both sides have the same code.
    """
    points = side.trials.drop_duplicates("point")
    own = {name: json.dumps(about) for name, about in side.study.about.maps.items()}
    return points.assign(candidate=_candidates(side, points)).assign(
        **{
            "kernels": "" if alike else side.kernels,
            "shapes of the map": [own.get(str(name), "") for name in points["map"]],
        }
    )


def _candidates(side: Side, rows: pd.DataFrame) -> "pd.Series[str]":
    """The ids of the candidates of points or trials of a side."""
    return rows["point"].map(side.study.candidate)


def _is_matched_on(name: str, first: pd.DataFrame, second: pd.DataFrame) -> bool:
    """Whether a setting varies on either side and both have a value in common."""
    values = [set(_values(table[name])) for table in (first, second)]
    return max(map(len, values)) > 1 and bool(values[0] & values[1])


def _values(column: "pd.Series[Any]") -> list[Any]:
    """A column's values; numbers that differ only in their last digits become equal."""
    values = column.tolist()
    return (
        [float(f"{value:.{DIGITS}g}") for value in values]
        if column.dtype.kind in "if"
        else values
    )


def _keys(table: pd.DataFrame) -> list[str]:
    """One text a row that is the same where all values are."""
    columns = [_values(table[name]) for name in table]
    return (
        [repr(row) for row in zip(*columns, strict=True)]
        if columns
        else [""] * len(table)
    )


def _check_single(
    side: Side, table: pd.DataFrame, partner: pd.DataFrame, names: Sequence[str]
) -> None:
    """Raise ChoiceError where a point has several partners, with their differences."""
    several = table[
        table.index.isin(partner.index) & table.index.duplicated(keep=False)
    ]
    if several.empty:
        return
    group = several.loc[[several.index[0]]]
    free = [
        name
        for name in (*side.study.kept_apart, *side.study.settings)
        if name in group and group[name].nunique() > 1
    ]
    where = ", ".join(f"{name} = {group[name].iloc[0]}" for name in names)
    mark = "," if ":" in side.text else ":"
    example = f"{side.text}{mark}{free[0]}={group[free[0]].iloc[0]}"
    raise ChoiceError(
        f"{side.text}: {len(group):,} points{f' where {where}' if where else ''} could"
        " be compared with one point of the other side; they differ in"
        f" {', '.join(free)}: choose one, as in {example}"
    )


def _shared_candidates(one: Side, other: Side) -> set[str]:
    """The ids of candidates of which both sides have the same trial."""
    if not same_code(one.study.provenance, other.study.provenance):
        return set()
    candidates = [_candidates(side, side.trials) for side in (one, other)]
    both = set(candidates[0]) & set(candidates[1])

    def keys(side: Side, names: "pd.Series[str]") -> set[tuple[Any, ...]]:
        chosen = names.isin(both)
        trials = side.trials[chosen]
        return set(
            zip(names[chosen], trials["streams"], replicates(trials), strict=True)
        )

    shared = keys(one, candidates[0]) & keys(other, candidates[1])
    return {candidate for candidate, *_ in shared}


def _differences(
    first: pd.DataFrame, second: pd.DataFrame, names: Sequence[str]
) -> dict[str, tuple[list[Any], list[Any]]]:
    """The values of those `names` in which two rows of the same place differ."""
    apart = [name for name in names if _values(first[name]) != _values(second[name])]
    return {
        name: (list(dict.fromkeys(first[name])), list(dict.fromkeys(second[name])))
        for name in apart
    }
