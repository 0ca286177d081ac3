"""How many replicates a study needs, from the stored trials of a pilot: `sweep power`.

A trial without a value, as one that diverged or in which the metric is undefined, is
made up for by more trials: as often as in the pilot.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import (
    CONFIDENCE,
    Contrast,
    by_point,
    simultaneous_confidence,
)
from sweep.analysis.mean_bounds import ANYWHERE, in_full
from sweep.analysis.replication import (
    CHANCE,
    FEWEST,
    Needed,
    values_for_difference,
    values_for_width,
)
from sweep.analysis.sequential import Width
from sweep.errors import ChoiceError
from sweep.methods.comparison import (
    Side,
    contrasts_of,
    match,
    places_of,
    shared_metrics,
    streams_in_common,
)
from sweep.spec.contents import share
from sweep.spec.recorded import Column
from sweep.tables.choosing import Refusals
from sweep.tables.stored_study import StoredStudy
from sweep.text import so_many

Floats = NDArray[np.float64]
Goal = Literal["half width", "difference"]

NOTHING: Mapping[str, float | str] = MappingProxyType({})
FORM = 'METRIC=SIZE, as "speed=0.05" or, as a share of the mean, "speed=5%"'


@dataclass(frozen=True, eq=False)
class Power:
    """The replicates that points, or pairs of points, need.

    `rows` has a row a goal, metric and point: the settings of `headings`, of B of a
    pair; goal, "half width" or "difference"; metric and unit; asked, as text; mean, of
    A of a pair, with its interval now, low and high; values, how many the pilot has, of
    a pair the fewer; paired, whether these are pairs; replicates, how many reach the
    goal with the `chance`; replicates_low and replicates_high, their 95 % range; and
    caveat, one of `sweep.analysis.replication.CAVEATS` or "". Replicates are NaN where
    unknown and infinite above a million. `tests` is the number of differences, which
    are judged together, and `against` says in words which point A of all of them is, or
    is "". `title` names the pilot.
    """

    title: str
    rows: pd.DataFrame
    headings: list[str]
    chance: float
    tests: int
    against: str

    def worst(self) -> Iterator["pd.Series[Any]"]:
        """Of each goal and metric the row that needs most, where one is known."""
        for _, rows in self.rows.groupby(["goal", "asked", "metric"], sort=False):
            known = rows.dropna(subset="replicates")
            if len(known):
                yield known.iloc[int(known["replicates"].argmax())]


def needed_replicates(
    one: Side | StoredStudy,
    other: Side | StoredStudy | None = None,
    *,
    half_widths: Sequence[str] = (),
    differences: Sequence[str] = (),
    half: bool = False,
    chance: float = CHANCE,
) -> Power:
    """How many replicates each point needs for intervals that are so narrow, and each
    pair of points for a comparison that notices so large a difference.

        one, other   the pilot, A and B of `sweep.methods.comparison`; without B the
                     first point of A is compared with each of its others
        half_widths  texts as "speed=0.05", and "speed=5%" for a share of the mean
        differences  the same, of the mean of A
        half         of means over the last half of a trial, or of the last frame
        chance       with which the goal is to be reached

    The interval is the one of `sweep table`, and the comparison that of `sweep compare`
    with its default: 95 %, one family, pairs where trials share random numbers. So a
    difference is to be noticed at 5 % over the number of all of them. Raises
    ChoiceError for what cannot be compared, for a metric that is not recorded, for what
    is no size or chance, all such mistakes together, and where no point has FEWEST
    values.
    """
    first = _side(one)
    second = None if other is None else _side(other)
    refusals = Refusals()
    with refusals.noted():
        if not (half_widths or differences):
            raise ChoiceError(
                f"no half width and no difference is given; allowed: {FORM}",
                first.study.name,
            )
    widths = _sizes(half_widths, "half width", first, refusals)
    sizes = _sizes(differences, "difference", first, refusals)
    _check(widths, sizes, first, second, chance, refusals)
    pairs = None
    with refusals.noted():
        pairs = _pairs(first, second, sizes) if sizes else None
    refusals.check()
    tables = [_of_widths(first, half, chance, widths)] if widths else []
    if pairs:
        tables.append(_of_differences(pairs, half, chance, sizes))
    rows = pd.concat(tables, ignore_index=True)
    _check_pilot(rows, first.study.name)
    headings = list(rows.columns[: rows.columns.get_loc("goal")])
    tests = int((rows["goal"] == "difference").sum())
    title = f"{second.text} against {first.text}" if second else first.text
    against = pairs.against if pairs else ""
    return Power(title, rows, headings, chance, tests, against)


class _Pairs(NamedTuple):
    """Points that are compared, (pairs, 2) ids, and the settings that tell them apart;
    `against` is what the first of all pairs is in words, or "".
    """

    one: Side
    other: Side
    points: NDArray[np.object_]
    settings: pd.DataFrame
    against: str


def _side(given: Side | StoredStudy) -> Side:
    if isinstance(given, Side):
        return given
    return Side(given.name, given, given.trials, frozenset(given.chosen))


def _sizes(
    texts: Iterable[str], goal: Goal, side: Side, refusals: Refusals
) -> dict[str, Width]:
    """What is asked for, by the metrics."""
    found: dict[str, Width] = {}
    for text in texts:
        name, _, size = (part.strip() for part in text.partition("="))
        with refusals.noted():
            side.study.check_metric(name)
        with refusals.noted():
            if name in found:
                raise ChoiceError(f"{name} stands twice; allowed: one {goal} of it")
            found[name] = _size(text, size, goal)
    return found


def _size(text: str, size: str, goal: Goal) -> Width:
    part = share(size)
    try:
        number = float(size) if part is None else float(part)
    except ValueError:
        number = np.nan
    if not (number > 0.0 and isfinite(number)):
        raise ChoiceError(f'"{text}" is no {goal}; allowed: {FORM}, a number above 0')
    return Width(number, relative=part is not None)


def _check(
    widths: Mapping[str, Width],
    sizes: Mapping[str, Width],
    one: Side,
    other: Side | None,
    chance: float,
    refusals: Refusals,
) -> None:
    """Note what cannot be asked for."""
    with refusals.noted():
        if widths and other is not None:
            raise ChoiceError(
                "a half width is that of one study: name one, or ask for differences"
            )
    with refusals.noted():
        if not 0.5 <= chance <= 0.99:
            raise ChoiceError(f"chance: {chance:g}; allowed: from 0.5 to 0.99, as 0.8")
    for name, size in sizes.items():
        declared = one.study.distributions.get(name)
        low, high = in_full(declared).support if declared else ANYWHERE
        with refusals.noted():
            if not size.relative and size.half >= high - low:
                raise ChoiceError(
                    f"{name} has values from {low:g} to {high:g}; allowed: a difference"
                    f" below {high - low:g}"
                )


def _pairs(one: Side, other: Side | None, metrics: Iterable[str]) -> _Pairs:
    """The points that are compared. ChoiceError where there are none."""
    if other is not None:
        shared_metrics(one, other, [*metrics])
        matching = match(one, other)
        return _Pairs(one, other, matching.points, matching.settings, "")
    settings = _settings(one)
    points = settings.index.to_numpy(dtype=object)
    if len(points) < 2:
        raise ChoiceError(
            "it has one point, and a difference needs two: name another study, or"
            " another point as STUDY:setting=value",
            one.study.name,
        )
    first = ", ".join(f"{name} = {value}" for name, value in settings.iloc[0].items())
    both = np.column_stack([np.full(len(points) - 1, points[0], object), points[1:]])
    return _Pairs(one, one, both, settings.iloc[1:].reset_index(drop=True), first)


def _settings(side: Side) -> pd.DataFrame:
    """What tells its points apart, a row a point by its id, in the order of trials."""
    study, points = side.study, side.trials["point"].unique()
    trials = side.trials.drop_duplicates("point").set_index("point")
    columns = {
        name: (trials if name in trials else study.points)[name].loc[points]
        for name in study.headings
    }
    found = pd.DataFrame(columns, index=points)
    return found[[name for name in found if found[name].nunique() > 1]]


def _of_widths(
    side: Side, half: bool, chance: float, widths: Mapping[str, Width]
) -> pd.DataFrame:
    """The rows of half widths, metric by metric."""
    study, settings = side.study, _settings(side)
    groups = side.trials.groupby("point", sort=False)
    tables = []
    for name, width in widths.items():
        column = str(Column(name, half))
        values = [_known(part) for _, part in groups[column]]
        needed = values_for_width(
            values,
            width,
            study.distributions[column],
            confidence=study.repeated.get(column, CONFIDENCE),
            chance=chance,
        )
        now = _now(side, column).reset_index(drop=True)
        counts = np.array([len(one) for one in values])
        table = settings.reset_index(drop=True).assign(
            **_goal("half width", column, study, width),
            **now,
            values=counts,
            paired=False,
        )
        valued = counts / groups.size().to_numpy()
        tables.append(table.assign(**_replicates(needed, valued)))
    return pd.concat(tables, ignore_index=True)


def _of_differences(
    pairs: _Pairs, half: bool, chance: float, sizes: Mapping[str, Width]
) -> pd.DataFrame:
    """The rows of differences, metric by metric."""
    one, other = pairs.one, pairs.other
    sharing = bool(streams_in_common(one, other))
    places = places_of(one, other, pairs.points, sharing=sharing)
    trials = np.array([min(len(at.first), len(at.second)) for at in places])
    confidence = simultaneous_confidence(len(sizes) * len(places), CONFIDENCE)
    tables = []
    for name, size in sizes.items():
        column = str(Column(name, half))
        contrasts = list(contrasts_of(one, other, column, places))
        now = _now(one, column).loc[pairs.points[:, 0].tolist()].reset_index(drop=True)
        values = np.array([min(len(each.a), len(each.b)) for each in contrasts])
        needed = _noticed(
            contrasts, size.allowed(now["mean"].to_numpy()), confidence, chance
        )
        table = pairs.settings.assign(
            **_goal("difference", column, one.study, size),
            **now,
            values=values,
            paired=[each.paired for each in contrasts],
        )
        tables.append(table.assign(**_replicates(needed, values / trials)))
    return pd.concat(tables, ignore_index=True)


def _noticed(
    contrasts: Sequence[Contrast], sizes: Floats, confidence: float, chance: float
) -> Needed:
    """What pairs need, and what independent samples need, in the order of contrasts."""
    paired = np.array([each.paired for each in contrasts])
    n, low, high = np.full((3, len(contrasts)), np.nan)
    found = Needed(n, low, high, np.full(len(contrasts), "", object))
    for kind in np.unique(paired):
        rows = np.flatnonzero(paired == kind).tolist()
        part = values_for_difference(
            [contrasts[row] for row in rows],
            sizes[rows],
            confidence=confidence,
            chance=chance,
        )
        for whole, few in zip(found, part, strict=True):
            whole[rows] = few
    return found


def _known(values: "pd.Series[float]") -> Floats:
    array = np.asarray(values, np.float64)
    return array[np.isfinite(array)]


def _now(side: Side, column: str) -> pd.DataFrame:
    """The mean of each point with its interval, by its id."""
    study, trials = side.study, side.trials
    found = by_point(
        trials,
        [],
        [column],
        repeated=study.repeated,
        distributions=study.distributions,
    )
    names = {column: "mean", f"{column}_low": "low", f"{column}_high": "high"}
    return found.set_axis(trials["point"].unique())[[*names]].rename(columns=names)


def _goal(goal: Goal, column: str, study: StoredStudy, size: Width) -> dict[str, str]:
    return {
        "goal": goal,
        "metric": column,
        "unit": study.units.get(column, ""),
        "asked": str(size.as_json()) if size.relative else f"{size.half:g}",
    }


def _replicates(needed: Needed, valued: Floats) -> dict[str, NDArray[Any]]:
    """The columns of what is needed, where this part of the trials has a value."""
    with np.errstate(divide="ignore", invalid="ignore"):
        numbers = {
            f"replicates{end}": np.ceil(one / valued)
            for end, one in zip(("", "_low", "_high"), needed[:3], strict=True)
        }
    return {**numbers, "caveat": needed.caveat}


def _check_pilot(rows: pd.DataFrame, study: str) -> None:
    """Raise ChoiceError where no row has enough values."""
    if not (rows["values"] >= FEWEST).any():
        most = int(rows["values"].max()) if len(rows) else 0
        raise ChoiceError(
            f"its points have at most {so_many(most, 'value')}, too few for a pilot;"
            f' write "replicates: {2 * FEWEST}" (at least {FEWEST}) into its spec and'
            " launch it again: only what is missing runs",
            study,
        )
