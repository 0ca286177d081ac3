"""Number of replicates that a study needs, from a stored pilot: `sweep power`.

Some trials have no value, such as a trial that diverged or in which the metric is
undefined. More replicates make up for the missing values, at the rate of the pilot.
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
    ANYWHERE,
    CHANCE,
    CONFIDENCE,
    FEWEST,
    Contrast,
    Needed,
    Width,
    by_point,
    in_full,
    simultaneous_confidence,
    values_for_difference,
    values_for_width,
)
from sweep.errors import ChoiceError
from sweep.methods.comparison import (
    Side,
    contrasts_of,
    match,
    places_of,
    shared_metrics,
    streams_in_common,
)
from sweep.spec import Column, share
from sweep.tables import Refusals, StoredStudy
from sweep.text import so_many

Floats = NDArray[np.float64]
Goal = Literal["half width", "difference"]

NOTHING: Mapping[str, float | str] = MappingProxyType({})
FORM = 'METRIC=SIZE, such as "speed=0.05", or "speed=5%" for a fraction of the mean'


@dataclass(frozen=True, eq=False)
class Power:
    """The replicates that points, or pairs of points, need.

    Attributes
    ----------
    title : str
        Name of the pilot.
    rows : DataFrame
        One row per goal, metric and point. Columns: the parameters of `headings`, of B
        of a pair; goal, "half width" or "difference"; metric and unit; asked, the goal
        as a string; mean, of A of a pair, with the bounds low and high of the present
        confidence interval; values, the number of values of the pilot, the smaller
        number for a pair; paired, True for pairs; replicates, the number that reaches
        the goal with the probability `chance`; replicates_low and replicates_high, the
        95 % range of that number, NaN if unknown and infinite above a million; caveat,
        an entry of `sweep.analysis.replication.CAVEATS` or "".
    headings : list of str
    chance : float
    tests : int
        Number of differences, which are simultaneous.
    against : str
        Point A of all differences in words, or "".
    """

    title: str
    rows: pd.DataFrame
    headings: list[str]
    chance: float
    tests: int
    against: str

    def worst(self) -> Iterator["pd.Series[Any]"]:
        """Yield the known row that needs most replicates, per goal and metric."""
        for _, rows in self.rows.groupby(["goal", "asked", "metric"], sort=False):
            finite = rows.dropna(subset="replicates")
            if len(finite):
                yield finite.iloc[int(finite["replicates"].argmax())]


def needed_replicates(
    pilot: Side | StoredStudy,
    against: Side | StoredStudy | None = None,
    *,
    half_widths: Sequence[str] = (),
    differences: Sequence[str] = (),
    half: bool = False,
    chance: float = CHANCE,
) -> Power:
    """Return the replicates that reach goals for each point, or each pair of points.

    A half-width is half of the confidence interval of `sweep table`. A difference is to
    be detected by `sweep compare` with its defaults: 95 %, one family, pairs if trials
    share random numbers. So each of k differences is tested at 5 % / k.

    Parameters
    ----------
    pilot : Side or StoredStudy
        Side A of `sweep.methods.comparison`.
    against : Side or StoredStudy, optional
        Side B of differences. By default the first point of A is compared with each
        further point of A.
    half_widths : sequence of str, optional
        Goals such as "speed=0.05", or "speed=5%" for a fraction of the mean.
    differences : sequence of str, optional
        Goals in the form of `half_widths`; a fraction is relative to the mean of A.
    half : bool, default False
        Means over the second half of each trial, instead of the last frame.
    chance : float, default 0.8
        Probability of reaching a goal, from 0.5 to 0.99.

    Returns
    -------
    Power

    Raises
    ------
    ChoiceError
        The sides cannot be compared, a metric is not recorded, or a goal or `chance` is
        not valid; all mistakes are reported together. Also if no point has FEWEST
        values.
    """
    first = _side(pilot)
    second = None if against is None else _side(against)
    refusals = Refusals()
    with refusals.noted():
        if not (half_widths or differences):
            raise ChoiceError(
                f"neither half-width nor difference is given; allowed: {FORM}",
                first.study.name,
            )
    widths = _sizes(half_widths, "half width", first, refusals)
    sizes = _sizes(differences, "difference", first, refusals)
    _check(widths, sizes, first, second, chance=chance, refusals=refusals)
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
    return Power(
        title=f"{second.text} against {first.text}" if second else first.text,
        rows=rows,
        headings=headings,
        chance=chance,
        tests=int((rows["goal"] == "difference").sum()),
        against=pairs.against if pairs else "",
    )


class _Pairs(NamedTuple):
    """Points that are compared: ids, (pairs, 2), and the parameters that differ.

    `against` describes the first point of all pairs in words, or is "".
    """

    side_a: Side
    side_b: Side
    points: NDArray[np.object_]
    settings: pd.DataFrame
    against: str


def _side(source: Side | StoredStudy) -> Side:
    if isinstance(source, Side):
        return source
    return Side(source.name, source, source.trials, frozenset(source.chosen))


def _sizes(
    texts: Iterable[str], goal: Goal, side: Side, refusals: Refusals
) -> dict[str, Width]:
    """Return the goal of each metric in strings such as "speed=5%"."""
    sizes: dict[str, Width] = {}
    for text in texts:
        name, _, size = (part.strip() for part in text.partition("="))
        with refusals.noted():
            side.study.check_metric(name)
        with refusals.noted():
            if name in sizes:
                raise ChoiceError(f"{name} is given twice; allowed: one {goal} each")
            sizes[name] = _size(text, size, goal)
    return sizes


def _size(text: str, size: str, goal: Goal) -> Width:
    part = share(size)
    try:
        number = float(size) if part is None else float(part)
    except ValueError:
        number = np.nan
    if not (number > 0.0 and isfinite(number)):
        raise ChoiceError(
            f'"{text}" is no {goal}; allowed: {FORM}; the number must be above 0'
        )
    return Width(number, relative=part is not None)


def _check(
    widths: Mapping[str, Width],
    sizes: Mapping[str, Width],
    side_a: Side,
    side_b: Side | None,
    *,
    chance: float,
    refusals: Refusals,
) -> None:
    """Note goals that do not fit the sides, and a probability that is not allowed."""
    with refusals.noted():
        if widths and side_b is not None:
            raise ChoiceError(
                "a half-width needs a single study: give A alone, or ask for"
                " differences"
            )
    with refusals.noted():
        if not 0.5 <= chance <= 0.99:
            raise ChoiceError(
                f"chance: {chance:g}; allowed: from 0.5 to 0.99, such as 0.8"
            )
    for name, size in sizes.items():
        declared = side_a.study.distributions.get(name)
        low, high = in_full(declared).support if declared else ANYWHERE
        with refusals.noted():
            if not size.relative and size.half >= high - low:
                raise ChoiceError(
                    f"{name} has values from {low:g} to {high:g}; allowed: a difference"
                    f" below {high - low:g}"
                )


def _pairs(side_a: Side, side_b: Side | None, metrics: Iterable[str]) -> _Pairs:
    """Return the points that are compared. ChoiceError without such points."""
    if side_b is not None:
        shared_metrics(side_a, side_b, [*metrics])
        matching = match(side_a, side_b)
        return _Pairs(side_a, side_b, matching.points, matching.settings, against="")
    settings = _settings(side_a)
    points = settings.index.to_numpy(dtype=object)
    if len(points) < 2:
        raise ChoiceError(
            "a difference needs two points, but the study has one: name another study,"
            " or another point as STUDY:parameter=value",
            side_a.study.name,
        )
    first = ", ".join(f"{name} = {value}" for name, value in settings.iloc[0].items())
    both = np.column_stack([np.full(len(points) - 1, points[0], object), points[1:]])
    following = settings.iloc[1:].reset_index(drop=True)
    return _Pairs(side_a, side_a, both, following, against=first)


def _settings(side: Side) -> pd.DataFrame:
    """Return the parameters in which points differ, one row per point, by id.

    The rows have the order of trials.
    """
    study = side.study
    points = side.trials["point"].unique()
    trials = side.trials.drop_duplicates("point").set_index("point")
    columns = {
        name: (trials if name in trials else study.points)[name].loc[points]
        for name in study.headings
    }
    table = pd.DataFrame(columns, index=points)
    return table[[name for name in table if table[name].nunique() > 1]]


def _of_widths(
    side: Side, half: bool, chance: float, widths: Mapping[str, Width]
) -> pd.DataFrame:
    """Return the rows of half-widths, metric by metric."""
    study = side.study
    settings = _settings(side)
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
        counts = np.array([len(sample) for sample in values])
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
    """Return the rows of differences, metric by metric."""
    side_a = pairs.side_a
    side_b = pairs.side_b
    sharing = bool(streams_in_common(side_a, side_b))
    places = places_of(side_a, side_b, pairs.points, sharing=sharing)
    trials = np.array([min(len(at.first), len(at.second)) for at in places])
    confidence = simultaneous_confidence(len(sizes) * len(places), CONFIDENCE)
    tables = []
    for name, size in sizes.items():
        column = str(Column(name, half))
        contrasts = list(contrasts_of(side_a, side_b, column, places))
        now = _now(side_a, column).loc[pairs.points[:, 0].tolist()]
        now = now.reset_index(drop=True)
        values = np.array([min(len(pair.a), len(pair.b)) for pair in contrasts])
        needed = _noticed(
            contrasts, size.allowed(now["mean"].to_numpy()), confidence, chance
        )
        table = pairs.settings.assign(
            **_goal("difference", column, side_a.study, size),
            **now,
            values=values,
            paired=[pair.paired for pair in contrasts],
        )
        tables.append(table.assign(**_replicates(needed, values / trials)))
    return pd.concat(tables, ignore_index=True)


def _noticed(
    contrasts: Sequence[Contrast], sizes: Floats, confidence: float, chance: float
) -> Needed:
    """Return the numbers that detect differences, in the order of contrasts.

    Pairs and independent samples are computed separately.
    """
    paired = np.array([contrast.paired for contrast in contrasts])
    n, low, high = np.full((3, len(contrasts)), np.nan)
    needed = Needed(n, low, high, np.full(len(contrasts), "", object))
    for kind in np.unique(paired):
        rows = np.flatnonzero(paired == kind).tolist()
        part = values_for_difference(
            [contrasts[row] for row in rows],
            sizes[rows],
            confidence=confidence,
            chance=chance,
        )
        for column, numbers in zip(needed, part, strict=True):
            column[rows] = numbers
    return needed


def _known(values: "pd.Series[float]") -> Floats:
    array = np.asarray(values, np.float64)
    return array[np.isfinite(array)]


def _now(side: Side, column: str) -> pd.DataFrame:
    """Return the mean of each point with its confidence interval, by id."""
    study = side.study
    trials = side.trials
    means = by_point(
        trials,
        [],
        [column],
        repeated=study.repeated,
        distributions=study.distributions,
    )
    new_names = {column: "mean", f"{column}_low": "low", f"{column}_high": "high"}
    return means.set_axis(trials["point"].unique())[[*new_names]].rename(
        columns=new_names
    )


def _goal(goal: Goal, column: str, study: StoredStudy, size: Width) -> dict[str, str]:
    return {
        "goal": goal,
        "metric": column,
        "unit": study.units.get(column, ""),
        "asked": str(size.as_json()) if size.relative else f"{size.half:g}",
    }


def _replicates(needed: Needed, valued: Floats) -> dict[str, NDArray[Any]]:
    """Return the columns of replicates, for a fraction of trials with a value."""
    with np.errstate(divide="ignore", invalid="ignore"):
        numbers = {
            f"replicates{end}": np.ceil(values / valued)
            for end, values in zip(("", "_low", "_high"), needed[:3], strict=True)
        }
    return {**numbers, "caveat": needed.caveat}


def _check_pilot(rows: pd.DataFrame, study: str) -> None:
    """Raise ChoiceError if no row has enough values."""
    if not (rows["values"] >= FEWEST).any():
        most = int(rows["values"].max()) if len(rows) else 0
        raise ChoiceError(
            f"the points have at most {so_many(most, 'value')}, too few for a pilot;"
            f' write "replicates: {2 * FEWEST}" (at least {FEWEST}) into the spec and'
            " launch the study again: only missing trials run",
            study,
        )
