"""What differs between two sides: studies, presets or values of a setting. `sweep
compare A B`.

Every matched point and metric is one contrast, B minus A: paired where the trials of
both sides share random numbers, else between independent samples. All of a table are
one family, so that its verdicts can be read together.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import (
    CONFIDENCE,
    Contrast,
    Family,
    adjusted,
    common_streams,
    equivalence,
    hedges_g,
    independent_contrast,
    jointly,
    mean_estimate,
    paired_contrast,
    replicates,
    undefined_shares,
)
from sweep.errors import ChoiceError
from sweep.methods.comparison.matching import Matching, match
from sweep.methods.comparison.sides import Side
from sweep.spec.recorded import Column
from sweep.store.origin import stamps
from sweep.tables.choosing import as_names

Together = Literal["holm", "bonferroni", "max_t"]
Floats = NDArray[np.float64]

MOST_RESAMPLED = 2000
"""Rows that max_t takes: it keeps thousands of resamples of all of them in memory."""

VERDICTS = (
    "higher",
    "lower",
    "higher, equivalent",
    "lower, equivalent",
    "equivalent",
    "no difference shown",
    "too few distinct values",
)


class Inference(NamedTuple):
    """How contrasts are judged; `margin` is half the range within which a difference
    does not matter, or None.
    """

    confidence: float = CONFIDENCE
    together: Together = "holm"
    margin: float | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two sides, their matched points, and `rows`: metric by metric, one row a point.

    Columns: the settings matched on; metric and unit; a and b, the means of the values
    that count; difference, b - a, with low and high, which hold together; p, adjusted;
    paired; n_a and n_b, the values that count, of pairs the same; variance_reduction,
    how many times as many independent trials would be needed; hedges_g with its own
    interval, for itself alone; with a margin p_equivalent, adjusted too; the verdict,
    of B; and trials_a, trials_b, not_done_a and not_done_b, and undefined_a and
    undefined_b, the shares of the done trials without a value. `streams` are the random
    streams that both sides have in common.
    """

    one: Side
    other: Side
    matching: Matching
    method: Inference
    half: bool
    streams: tuple[str, ...]
    rows: pd.DataFrame

    @property
    def tests(self) -> int:
        """How many contrasts are looked at together."""
        return int(self.rows["p"].notna().sum())

    @property
    def differ(self) -> dict[str, tuple[list[Any], list[Any]]]:
        """The settings in which the sides differ. The number of steps between frames is
        one of them only for means over frames.
        """
        differ = self.matching.differ
        return {
            name: values
            for name, values in differ.items()
            if name != "every" or self.half
        }

    def verdicts(self, metric: str) -> Mapping[str, int]:
        """How many rows of a metric have which verdict, in the order of VERDICTS."""
        counts = Counter(self.rows.loc[self.rows["metric"] == metric, "verdict"])
        return {verdict: counts[verdict] for verdict in VERDICTS if counts[verdict]}


def compare_sides(
    one: Side,
    other: Side,
    metrics: str | Sequence[str] = (),
    *,
    half: bool = False,
    method: Inference | None = None,
) -> Comparison:
    """`other` against `one` at the points that `match` finds; `half` takes means over
    the last half of a trial.

    Trials are paired that have the same seed and replicate, where both sides take one
    of the streams start, world and noise in common. Flocks that are given, by a table,
    have nothing in common with others. Nothing else is needed: whole pairs
    are independent of each other whatever the two trials do with the same numbers, and
    trials that share them are not (coverage of aziel_chen2025 at n = 50 and 100:
    correlations from -0.03 to 0.19). Only the gain depends on what else is alike. Where
    fewer than half of the trials of the smaller side have a partner, the samples are
    compared as independent ones, without the trials of B that have one. A margin is in
    the unit of the one metric that then must be named.

    Intervals and p-values hold together, see `sweep.analysis.jointly`. They are those
    of the distribution that the metric declares, see `sweep.analysis.MeanEstimate`, but
    for "max_t", which resamples. Measured chance, in per cent, of a difference between
    two samples with equal means of which one is lognormal with sigma 1 and the other
    normal with a standard deviation of 0.1, at level 5: 5, 7 and 6 for 3, 10 and 40
    values each where the metric is declared "skewed", and 9, 8 and 6 where they are
    paired and have nothing in common; 15, 15 and 10 by Welch's test where it is
    "normal". Equivalence is by two one-sided tests, whose p-values are adjusted for
    each other (by Holm for "max_t"). So with "holm" the chance of a wrong word is at
    most 1 - `confidence` for differences and for equivalence each, and with
    "bonferroni" for both. Raises ChoiceError for what cannot be compared.
    """
    method = method or Inference()
    names = shared_metrics(one, other, as_names(metrics))
    _check(method, names)
    matching = match(one, other)
    streams = streams_in_common(one, other)
    places = places_of(one, other, matching.points, sharing=bool(streams))
    columns = {str(Column(name, half)): _unit(one, name) for name in names}
    contrasts = [
        contrast
        for column in columns
        for contrast in contrasts_of(one, other, column, places)
    ]
    pairs = len(matching.settings)
    undefined = [
        row for column in columns for row in _undefined(one, other, column, matching)
    ]
    rows = pd.concat([matching.settings] * len(columns), ignore_index=True)
    rows["metric"], rows["unit"] = (
        np.repeat(list(columns), pairs),
        np.repeat(list(columns.values()), pairs),
    )
    counts = pd.DataFrame([place.counts for place in places] * len(columns))
    rows = pd.concat(
        [rows, judge(contrasts, method), counts, pd.DataFrame(undefined)],
        axis="columns",
    )
    return Comparison(one, other, matching, method, half, streams, rows)


class _Counts(NamedTuple):
    """Trials of both sides at a point, and those of them that are not done."""

    trials_a: int
    trials_b: int
    not_done_a: int
    not_done_b: int


class _Undefined(NamedTuple):
    """The share of the done trials of both sides at a point without a value."""

    undefined_a: float
    undefined_b: float


class ComparedTrials(NamedTuple):
    """Which rows of the trials of either side are compared at a point, by what pairs
    them, and whether they pair.
    """

    first: "pd.Series[int]"
    second: "pd.Series[int]"
    paired: bool
    counts: _Counts


def shared_metrics(one: Side, other: Side, asked: Sequence[str]) -> list[str]:
    """The metrics to compare. Raises ChoiceError where a side has not recorded one, or
    in another unit.
    """
    for name in asked:
        for side in (one, other):
            side.study.check_metric(name)
        if _unit(one, name) != _unit(other, name):
            units = (
                f"{_unit(one, name)} in {one.model} and {_unit(other, name)} in"
                f" {other.model}"
            )
            raise ChoiceError(f"metric {name} cannot be compared: it is in {units}")
    shared = [name for name in one.study.metrics if name in other.study.metrics]
    names = [
        name
        for name in dict.fromkeys(asked or shared)
        if _unit(one, name) == _unit(other, name)
    ]
    if not names:
        raise ChoiceError(
            f"no metric in common: {one.study.name} has {', '.join(one.study.metrics)};"
            f" {other.study.name} has {', '.join(other.study.metrics)}"
        )
    return names


def _unit(side: Side, metric: str) -> str:
    return side.study.units.get(metric, "")


def _check(method: Inference, metrics: Sequence[str]) -> None:
    """Raise ChoiceError for a confidence or a margin that cannot be."""
    if not 0.5 <= method.confidence < 1.0:
        raise ChoiceError(
            f"confidence: {method.confidence:g}; allowed: from 0.5 to below 1, as 0.95"
        )
    if method.margin is None:
        return
    if not 0.0 < method.margin < np.inf:
        raise ChoiceError(
            f"margin: {method.margin:g}; allowed: a number above 0,"
            " in the unit of the metric"
        )
    if len(metrics) > 1:
        raise ChoiceError(
            "a margin is in the unit of one metric: name it,"
            f" one of {', '.join(metrics)}"
        )


def streams_in_common(one: Side, other: Side) -> tuple[str, ...]:
    """The random streams in common; that of worlds only where worlds are drawn, and
    that of starts not where one side begins with given flocks and the other with
    others.
    """
    common = common_streams(one.trials) & common_streams(other.trials)
    drawn = all(
        any(
            name in side.study.known.maps and side.study.known.maps[name].random
            for name in side.trials["map"].unique()
        )
        for side in (one, other)
    )
    return tuple(
        name
        for name in ("start", "world", "noise")
        if name in common
        and (name != "world" or drawn)
        and (name != "start" or _starts(one) == _starts(other))
    )


def _starts(side: Side) -> set[str]:
    """The stamps of the given flocks with which trials start; "" for random ones."""
    known, code = side.study.known.starts, stamps(side.study.provenance)
    names = {str(name) for name in side.trials["start_draws"].unique()}
    given = {name for name in names if name in known and not known[name].random}
    stamped = {code.starts.get(name, name) if code else name for name in given}
    return stamped | ({""} if names - given else set())


def places_of(
    one: Side, other: Side, points: NDArray[np.object_], *, sharing: bool
) -> list[ComparedTrials]:
    """What is compared with what at each pair of `points` (pairs, 2), ids; `sharing`
    says that streams are common to all points.
    """
    codes = _codes(one.trials, other.trials)
    rows = [side.trials.groupby("point", sort=False).indices for side in (one, other)]
    lost = [(side.trials["status"] != "done").to_numpy() for side in (one, other)]
    places = []
    for pair in points:
        found = [each[point] for each, point in zip(rows, pair, strict=True)]
        counts = _Counts(
            *map(len, found),
            *(int(each[where].sum()) for each, where in zip(lost, found, strict=True)),
        )
        first, second = (
            pd.Series(where, index=code[where])
            for code, where in zip(codes, found, strict=True)
        )
        # The same point has the same random numbers, whatever streams are common to
        # others.
        if sharing or pair[0] == pair[1]:
            pairs = first.index.isin(second.index)
            if paired := 2 * int(pairs.sum()) >= min(len(first), len(second)):
                first = first[pairs]
            second = second[second.index.isin(first.index) == paired]
        else:
            paired = False
        places.append(ComparedTrials(first, second, paired, counts))
    return places


def _codes(
    first: pd.DataFrame, second: pd.DataFrame
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """A number for each trial of two tables; equal for equal random numbers."""
    codes, _ = replicates(first).append(replicates(second)).factorize(sort=True)
    return codes[: len(first)], codes[len(first) :]


def _values(side: Side, column: str) -> Floats:
    return (
        side.trials[column].where(side.trials["status"] == "done").to_numpy(np.float64)
    )


def _undefined(
    one: Side, other: Side, column: str, matching: Matching
) -> Iterator[_Undefined]:
    """Of each pair of points."""
    shares = [undefined_shares(side.trials, column) for side in (one, other)]
    for points in matching.points:
        yield _Undefined(
            *(float(share[point]) for share, point in zip(shares, points, strict=True))
        )


def contrasts_of(
    one: Side, other: Side, column: str, places: Sequence[ComparedTrials]
) -> Iterator[Contrast]:
    """B minus A in a column of the trials at each pair of points."""
    values = [_values(side, column) for side in (one, other)]
    distribution = one.study.distributions[column]
    for first, second, paired, _ in places:
        before, after = values[0][first.to_numpy()], values[1][second.to_numpy()]
        if paired:
            yield paired_contrast(
                pd.Series(before, index=first.index),
                pd.Series(after, index=second.index),
                distribution=distribution,
            )
        else:
            yield independent_contrast(
                before[~np.isnan(before)],
                after[~np.isnan(after)],
                distribution=distribution,
            )


def _family(contrasts: Sequence[Contrast], method: Inference) -> Family:
    """The contrasts with simultaneous intervals. ChoiceError if max_t has none."""
    if method.together == "max_t":
        if not all(contrast.paired for contrast in contrasts):
            raise ChoiceError(
                "max_t resamples pairs of trials,"
                " and not all trials share random numbers; use holm"
            )
        if len(contrasts) > MOST_RESAMPLED:
            raise ChoiceError(
                f"max_t: {len(contrasts):,} comparisons;"
                f" allowed: {MOST_RESAMPLED:,}; use holm"
            )
    try:
        return jointly(contrasts, method.confidence, method.together)
    except ValueError as error:
        raise ChoiceError(f"{error}; use holm") from None


def judge(contrasts: Sequence[Contrast], method: Inference) -> pd.DataFrame:
    """The columns of a comparison from a to the verdict, of contrasts that are one
    family.

    Raises ChoiceError where max_t cannot judge them.
    """
    family = _family(contrasts, method)
    sides = family.contrasts
    level = 1.0 - method.confidence
    sizes = [
        hedges_g(side.a, side.b, method.confidence, paired=side.paired)
        for side in sides
    ]
    columns: dict[str, object] = {
        "a": [mean_estimate(side.a).value for side in sides],
        "b": [mean_estimate(side.b).value for side in sides],
        "difference": [side.value for side in sides],
        "low": family.low,
        "high": family.high,
        "p": family.p,
        "paired": [side.paired for side in sides],
        "n_a": [len(side.a) for side in sides],
        "n_b": [len(side.b) for side in sides],
        "variance_reduction": [side.variance_reduction for side in sides],
        "hedges_g": [size.value for size in sizes],
        "hedges_g_low": [size.low for size in sizes],
        "hedges_g_high": [size.high for size in sizes],
    }
    within = np.full(len(sides), np.nan)
    if method.margin is not None:
        tests = [
            equivalence(side.estimate, -method.margin, method.margin, level).p
            for side in sides
        ]
        within = adjusted(
            tests, "bonferroni" if method.together == "bonferroni" else "holm"
        )
        columns["p_equivalent"] = within
    judged = zip((side.value for side in sides), family.p, within, strict=True)
    return pd.DataFrame(
        columns | {"verdict": [_verdict(*one, level) for one in judged]}
    )


def _verdict(difference: float, p: float, p_equivalent: float, level: float) -> str:
    """One of VERDICTS, of B."""
    if np.isnan(p):
        return "too few distinct values"
    words = ["higher" if difference > 0.0 else "lower"] if p < level else []
    words += ["equivalent"] if p_equivalent < level else []
    return ", ".join(words) or "no difference shown"
