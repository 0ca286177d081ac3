"""The matching of points of two sides of a comparison, and their differences."""

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
from sweep.store import same_code

DIGITS = 9
"""Numbers that agree in so many digits are equal, so that 0.3 matches 3 * 0.1."""

PROPERTIES = ("model", "preset", "kernels", "shapes of the map", "every")
"""Properties in which two points may differ in addition to parameters."""


@dataclass(frozen=True, eq=False)
class Matching:
    """Points of two sides that agree in some parameters.

    Attributes
    ----------
    names : list of str
        The parameters.
    settings : DataFrame
        Values of the parameters, one row per pair.
    points : array of str
        Ids of the points of side A and of side B, (pairs, 2).
    alone : tuple of two DataFrames
        Values of the parameters of the points of either side without a partner.
    same : int
        Number of pairs that are left out because the two points are identical trials.
    differ : mapping
        Values of side A and of side B of all other columns in which points of a pair
        differ.
    """

    names: list[str]
    settings: pd.DataFrame
    points: NDArray[np.object_]
    alone: tuple[pd.DataFrame, pd.DataFrame]
    same: int
    differ: Mapping[str, tuple[list[Any], list[Any]]]


def match(side_a: Side, side_b: Side) -> Matching:
    """Match points on the parameters that vary on a side and share a value.

    Parameters that A and B name are not matched on.

    Raises
    ------
    ChoiceError
        Several points of a side agree in all matched parameters, no point has a
        partner, or the two sides are identical trials.
    """
    code_is_same = same_code(side_a.study.provenance, side_b.study.provenance)
    points_a = _points(side_a, code_is_same)
    points_b = _points(side_b, code_is_same)
    settings = _settings(side_a, side_b)
    matched = [
        name
        for name in settings
        if name not in side_a.named & side_b.named
        and _is_matched_on(name, points_a, points_b)
    ]
    keyed_a = points_a.set_axis(_keys(points_a[matched]), axis="index")
    keyed_b = points_b.set_axis(_keys(points_b[matched]), axis="index")
    _check_single(side_a, keyed_a, keyed_b, matched)
    _check_single(side_b, keyed_b, keyed_a, matched)
    common = [key for key in keyed_a.index if key in keyed_b.index]
    if not common:
        raise ChoiceError(
            f"no point of {side_a.text} agrees with a point of {side_b.text} in"
            f" {', '.join(matched)}"
        )
    first = keyed_a.loc[common]
    second = keyed_b.loc[common]
    same = (
        (first["candidate"] == second["candidate"])
        & first["candidate"].isin(_shared_candidates(side_a, side_b))
    ).to_numpy()
    if same.all():
        only = (
            "are identical trials"
            if len(common) == len(keyed_a)
            else "agree only in identical trials"
        )
        raise ChoiceError(
            f"{side_a.text} and {side_b.text} {only}: there is nothing to compare"
        )
    first = first[~same]
    second = second[~same]
    idle = side_a.study.idle | side_b.study.idle
    unmatched = [name for name in settings if name not in matched and name not in idle]
    return Matching(
        names=matched,
        settings=first[matched].reset_index(drop=True),
        points=np.column_stack([first["point"], second["point"]]),
        alone=(keyed_a.drop(common)[matched], keyed_b.drop(common)[matched]),
        same=int(same.sum()),
        differ=_differences(first, second, [*PROPERTIES, *unmatched]),
    )


def telling(settings: pd.DataFrame) -> list[str]:
    """Return the first columns that distinguish the rows as well as all columns do."""
    chosen: list[str] = []
    groups = 1
    for name in settings.columns:
        if (
            groups < len(settings)
            and (finer := settings.groupby([*chosen, name]).ngroups) > groups
        ):
            chosen = [*chosen, name]
            groups = finer
    return chosen


def _settings(side_a: Side, side_b: Side) -> list[str]:
    """Return the parameters that A and B share, varied parameters first, in spec order.

    A column that separates points of equal parameters, such as the direction of chains,
    is included if the values of the two sides are equal, or have none in common.
    """
    varied = [*side_a.study.varied, *side_b.study.varied]
    settings = dict.fromkeys([*varied, *side_a.study.settings])
    known_a, known_b = (
        {*side.study.settings, *side.study.kept_apart} & set(side.trials)
        for side in (side_a, side_b)
    )
    shared = [name for name in settings if name in known_a & known_b]
    apart = {*side_a.study.kept_apart, *side_b.study.kept_apart}
    return [
        name
        for name in shared
        if name not in apart or not _overlap(side_a.trials[name], side_b.trials[name])
    ]


def _overlap(first: "pd.Series[Any]", second: "pd.Series[Any]") -> bool:
    """Return whether columns have some values in common, but not all."""
    values_a = set(first)
    values_b = set(second)
    return values_a != values_b and not values_a.isdisjoint(values_b)


def _points(side: Side, code_is_same: bool) -> pd.DataFrame:
    """Return the first trial of each point, with its candidate, code and map."""
    points = side.trials.drop_duplicates("point")
    shapes = {name: json.dumps(shape) for name, shape in side.study.about.maps.items()}
    return points.assign(candidate=_candidates(side, points)).assign(
        **{
            "kernels": "" if code_is_same else side.kernels,
            "shapes of the map": [shapes.get(str(name), "") for name in points["map"]],
        }
    )


def _candidates(side: Side, rows: pd.DataFrame) -> "pd.Series[str]":
    """Return the ids of the candidates of points or trials of a side."""
    return rows["point"].map(side.study.undivided)


def _is_matched_on(name: str, first: pd.DataFrame, second: pd.DataFrame) -> bool:
    """Return whether a parameter varies on a side and the two sides share a value."""
    values = [set(_values(table[name])) for table in (first, second)]
    return max(map(len, values)) > 1 and bool(values[0] & values[1])


def _values(column: "pd.Series[Any]") -> list[Any]:
    """Return the values; numbers that differ only in the last digits become equal."""
    values = column.tolist()
    return (
        [float(f"{value:.{DIGITS}g}") for value in values]
        if column.dtype.kind in "if"
        else values
    )


def _keys(table: pd.DataFrame) -> list[str]:
    """Return one string per row, equal for rows with equal values."""
    columns = [_values(table[name]) for name in table]
    return (
        [repr(row) for row in zip(*columns, strict=True)]
        if columns
        else [""] * len(table)
    )


def _check_single(
    side: Side, table: pd.DataFrame, partner: pd.DataFrame, settings: Sequence[str]
) -> None:
    """Raise ChoiceError if a point has several partners, with the differences."""
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
    where = ", ".join(f"{name} = {group[name].iloc[0]}" for name in settings)
    mark = "," if ":" in side.text else ":"
    example = f"{side.text}{mark}{free[0]}={group[free[0]].iloc[0]}"
    raise ChoiceError(
        f"{side.text}: {len(group):,} points{f' where {where}' if where else ''} could"
        " match a single point of the opposite side; the points differ in"
        f" {', '.join(free)}: choose a value, for example {example}"
    )


def _shared_candidates(side_a: Side, side_b: Side) -> set[str]:
    """Return the ids of candidates with a trial that is equal on the two sides."""
    if not same_code(side_a.study.provenance, side_b.study.provenance):
        return set()
    candidates_a = _candidates(side_a, side_a.trials)
    candidates_b = _candidates(side_b, side_b.trials)
    both = set(candidates_a) & set(candidates_b)

    def keys(side: Side, names: "pd.Series[str]") -> set[tuple[Any, ...]]:
        chosen = names.isin(both)
        trials = side.trials[chosen]
        # Parameters and seeds do not tell two recordings apart, but ids of trials do.
        is_recorded = bool(side.study.known.models[side.model].events)
        content = trials["trial_id"] if is_recorded else [""] * len(trials)
        return set(
            zip(
                names[chosen],
                trials["streams"],
                replicates(trials),
                content,
                strict=True,
            )
        )

    shared = keys(side_a, candidates_a) & keys(side_b, candidates_b)
    return {candidate for candidate, *_ in shared}


def _differences(
    first: pd.DataFrame, second: pd.DataFrame, settings: Sequence[str]
) -> dict[str, tuple[list[Any], list[Any]]]:
    """Return the values of all columns `settings` in which paired rows differ."""
    apart = [name for name in settings if _values(first[name]) != _values(second[name])]
    return {
        name: (list(dict.fromkeys(first[name])), list(dict.fromkeys(second[name])))
        for name in apart
    }
