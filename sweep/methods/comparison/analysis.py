"""The comparison of two sides: studies, presets or values of a parameter.

`sweep compare A B` prints the comparison. Every matched point and metric is a contrast,
B minus A. The contrast is paired if the trials of A and B share random numbers, else
between independent samples. All contrasts of a table are one family, so that the
verdicts can be read together.
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
from sweep.spec import Column
from sweep.store import stamps
from sweep.tables import as_names

Together = Literal["holm", "bonferroni", "max_t"]
Floats = NDArray[np.float64]

MOST_RESAMPLED = 2000
"""Rows that max_t accepts: thousands of resamples of all rows are in memory."""

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
    """The method by which contrasts are judged.

    Attributes
    ----------
    confidence : float, default 0.95
        Simultaneous confidence of all intervals, from 0.5 to below 1.
    together : {"holm", "bonferroni", "max_t"}, default "holm"
        Correction for multiple comparisons, see `sweep.analysis.jointly`.
    margin : float, optional
        Equivalence margin, in the unit of the metric: differences from -margin to
        margin do not matter. By default equivalence is not tested.
    """

    confidence: float = CONFIDENCE
    together: Together = "holm"
    margin: float | None = None


@dataclass(frozen=True, eq=False)
class Comparison:
    """Two sides, compared at their matched points.

    Attributes
    ----------
    side_a, side_b : Side
    matching : Matching
        The points that are compared.
    method : Inference
    half : bool
        True for means over the second half of each trial, False for the last frame.
    streams : tuple of str
        Random streams that the two sides have in common.
    rows : DataFrame
        Metric by metric, one row per point. Columns:

        - The parameters that points are matched on; metric and unit.
        - a and b: means of the values that count.
        - difference, b - a, with the bounds low and high of its simultaneous interval.
        - p: adjusted for all rows.
        - paired; n_a and n_b: numbers of values that count, equal for pairs.
        - variance_reduction: independent samples need this many times as many trials.
        - hedges_g, hedges_g_low and hedges_g_high: the interval is for its row alone.
        - p_equivalent, with a margin only: adjusted too.
        - verdict: of B, an entry of VERDICTS.
        - trials_a, trials_b, not_done_a and not_done_b: numbers of trials.
        - undefined_a and undefined_b: fractions of the done trials without a value.
    """

    side_a: Side
    side_b: Side
    matching: Matching
    method: Inference
    half: bool
    streams: tuple[str, ...]
    rows: pd.DataFrame

    @property
    def tests(self) -> int:
        """The number of contrasts with a p-value, which are judged together."""
        return int(self.rows["p"].notna().sum())

    @property
    def other_units(self) -> dict[str, tuple[str, str]]:
        """Units of side A and of side B by metric, where only the units differ."""
        recorded = self.side_b.study.metrics
        shared = [name for name in self.side_a.study.metrics if name in recorded]
        units = {
            name: (_unit(self.side_a, name), _unit(self.side_b, name))
            for name in shared
        }
        return {name: pair for name, pair in units.items() if pair[0] != pair[1]}

    @property
    def differ(self) -> dict[str, tuple[list[Any], list[Any]]]:
        """Values of side A and of side B by name, where the sides differ.

        The number of steps between frames, `every`, counts only for means over frames.
        """
        differ = self.matching.differ
        return {
            name: values
            for name, values in differ.items()
            if name != "every" or self.half
        }

    def verdicts(self, metric: str) -> Mapping[str, int]:
        """Return numbers of rows of a metric by verdict, in the order of VERDICTS."""
        counts = Counter(self.rows.loc[self.rows["metric"] == metric, "verdict"])
        return {verdict: counts[verdict] for verdict in VERDICTS if counts[verdict]}


def compare_sides(
    side_a: Side,
    side_b: Side,
    metrics: str | Sequence[str] = (),
    *,
    half: bool = False,
    method: Inference | None = None,
) -> Comparison:
    """Compare two sides at their matched points, metric by metric, b - a.

    Trials with equal seed and replicate are paired if the two sides have a stream in
    common: start, world or noise. Initial conditions from a table have nothing in
    common with different initial conditions. Pairing needs no further agreement: whole
    pairs are independent of each other, whatever the two trials do with equal numbers.
    Trials that share numbers are not independent (coverage of aziel_chen2025 at n = 50
    and 100: correlations from -0.03 to 0.19). Only the gain depends on further
    agreement.

    If fewer than half of the trials of the smaller side have a partner, the samples are
    compared as independent samples, without the trials of B that have a partner.

    Parameters
    ----------
    side_a, side_b : Side
    metrics : str or sequence of str, optional
        By default all metrics that the two sides recorded in equal units.
    half : bool, default False
        Compare means over the second half of each trial, not the last frame.
    method : Inference, optional
        By default `Inference()`. A margin needs a single metric, and has its unit.

    Returns
    -------
    Comparison

    Raises
    ------
    ChoiceError
        The sides have no metric or no point in common, a point has several partners,
        the two sides are identical trials, or `method` is not possible.

    Notes
    -----
    Intervals and p-values are simultaneous, see `sweep.analysis.jointly`. The intervals
    follow the distribution that the metric declares, see `sweep.analysis.MeanEstimate`.
    "max_t" resamples instead.

    Measured rate of false differences, in per cent at level 5. Two samples have equal
    means; the first is lognormal with sigma 1, the second normal with a standard
    deviation of 0.1. For 3, 10 and 40 values each: 5, 7 and 6 if the metric is declared
    "skewed"; 9, 8 and 6 if the samples are also paired, with nothing in common; 15, 15
    and 10 by Welch's test if the metric is "normal".

    Equivalence is by two one-sided tests, whose p-values are adjusted for each other
    (by Holm for "max_t"). With "holm" the probability of any wrong verdict is at most
    1 minus `confidence`, for differences and for equivalence each. With "bonferroni"
    the bound is for all verdicts together.
    """
    method = method or Inference()
    shared = shared_metrics(side_a, side_b, as_names(metrics))
    _check(method, shared)
    matching = match(side_a, side_b)
    streams = streams_in_common(side_a, side_b)
    compared = places_of(side_a, side_b, matching.points, sharing=bool(streams))
    columns = {str(Column(name, half)): _unit(side_a, name) for name in shared}
    contrasts = [
        contrast
        for column in columns
        for contrast in contrasts_of(side_a, side_b, column, compared)
    ]
    pairs = len(matching.settings)
    undefined = [
        row
        for column in columns
        for row in _undefined(side_a, side_b, column, matching)
    ]
    rows = pd.concat([matching.settings] * len(columns), ignore_index=True)
    rows["metric"] = np.repeat(list(columns), pairs)
    rows["unit"] = np.repeat(list(columns.values()), pairs)
    counts = pd.DataFrame([trials.counts for trials in compared] * len(columns))
    rows = pd.concat(
        [rows, judge(contrasts, method), counts, pd.DataFrame(undefined)],
        axis="columns",
    )
    return Comparison(
        side_a=side_a,
        side_b=side_b,
        matching=matching,
        method=method,
        half=half,
        streams=streams,
        rows=rows,
    )


class _Counts(NamedTuple):
    """Numbers of all trials, and of unfinished trials, at a point of each side."""

    trials_a: int
    trials_b: int
    not_done_a: int
    not_done_b: int


class _Undefined(NamedTuple):
    """Fractions of the done trials without a value, at a point of each side."""

    undefined_a: float
    undefined_b: float


class ComparedTrials(NamedTuple):
    """The trials that are compared at a pair of points.

    Attributes
    ----------
    first, second : Series of int
        Row numbers in the trials of either side. The index has a number that is equal
        for equal random numbers, which pairs the trials.
    paired : bool
    counts : _Counts
    """

    first: "pd.Series[int]"
    second: "pd.Series[int]"
    paired: bool
    counts: _Counts


def shared_metrics(side_a: Side, side_b: Side, metrics: Sequence[str]) -> list[str]:
    """Return the metrics to compare.

    Parameters
    ----------
    side_a, side_b : Side
    metrics : sequence of str
        If empty, all metrics that the two sides recorded in equal units.

    Returns
    -------
    list of str

    Raises
    ------
    ChoiceError
        A side has not recorded a metric, units differ, or no metric is shared.
    """
    for name in metrics:
        for side in (side_a, side_b):
            side.study.check_metric(name)
        if _unit(side_a, name) != _unit(side_b, name):
            units = (
                f"{_unit(side_a, name)} in {side_a.model} and {_unit(side_b, name)} in"
                f" {side_b.model}"
            )
            raise ChoiceError(f"metric {name} cannot be compared: the unit is {units}")
    recorded_a = side_a.study.metrics
    recorded_b = side_b.study.metrics
    shared = [name for name in recorded_a if name in recorded_b]
    names = [
        name
        for name in dict.fromkeys(metrics or shared)
        if _unit(side_a, name) == _unit(side_b, name)
    ]
    if not names:
        raise ChoiceError(
            f"no metric in common: {side_a.study.name} has {', '.join(recorded_a)};"
            f" {side_b.study.name} has {', '.join(recorded_b)}"
        )
    return names


def _unit(side: Side, metric: str) -> str:
    return side.study.units.get(metric, "")


def _check(method: Inference, metrics: Sequence[str]) -> None:
    """Raise ChoiceError for an impossible confidence or margin."""
    if not 0.5 <= method.confidence < 1.0:
        raise ChoiceError(
            f"confidence: {method.confidence:g}; allowed: from 0.5 to below 1, such as"
            " 0.95"
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
            "a margin is in the unit of a single metric: choose a metric"
            f" from {', '.join(metrics)}"
        )


def streams_in_common(side_a: Side, side_b: Side) -> tuple[str, ...]:
    """Return the random streams that two sides have in common.

    The stream of worlds counts only if worlds are random. The stream of starts counts
    only if the two sides have equal kinds of initial conditions. A recording has
    streams in common only with the same recording, where trials are paired by event.
    """
    if _events(side_a) != _events(side_b):
        return ()
    common = common_streams(side_a.trials) & common_streams(side_b.trials)
    drawn = all(
        any(
            name in side.study.known.maps and side.study.known.maps[name].random
            for name in side.trials["map"].unique()
        )
        for side in (side_a, side_b)
    )
    return tuple(
        name
        for name in ("start", "world", "noise")
        if name in common
        and (name != "world" or drawn)
        and (name != "start" or _starts(side_a) == _starts(side_b))
    )


def _events(side: Side) -> set[str]:
    """Return the hashes of the recorded events; none for a study of a model."""
    models = side.study.known.models
    models_of_trials = side.trials["model"].unique()
    return {event.sha for name in models_of_trials for event in models[name].events}


def _starts(side: Side) -> set[str]:
    """Return the code hashes of the fixed initial conditions, and "" if any are random.

    An initial condition without a hash has its name instead.
    """
    starts = side.study.known.starts
    code = stamps(side.study.provenance)
    draws = {str(name) for name in side.trials["start_draws"].unique()}
    fixed = {name for name in draws if name in starts and not starts[name].random}
    hashes = {code.starts.get(name, name) if code else name for name in fixed}
    return hashes | ({""} if draws - fixed else set())


def places_of(
    side_a: Side, side_b: Side, points: NDArray[np.object_], *, sharing: bool
) -> list[ComparedTrials]:
    """Return the trials that are compared at each pair of points.

    Parameters
    ----------
    side_a, side_b : Side
    points : array of str
        Ids of the points of side A and of side B, (pairs, 2).
    sharing : bool
        True if the sides have random streams in common, see `streams_in_common`.

    Returns
    -------
    list of ComparedTrials
        One per pair of points.
    """
    sides = (side_a, side_b)
    codes = _codes(side_a.trials, side_b.trials)
    rows_by_point = [side.trials.groupby("point", sort=False).indices for side in sides]
    not_done = [(side.trials["status"] != "done").to_numpy() for side in sides]
    compared = []
    for pair in points:
        rows = [
            indices[point] for indices, point in zip(rows_by_point, pair, strict=True)
        ]
        counts = _Counts(
            *map(len, rows),
            *(int(lost[at].sum()) for lost, at in zip(not_done, rows, strict=True)),
        )
        first, second = (
            pd.Series(at, index=code[at]) for code, at in zip(codes, rows, strict=True)
        )
        # A point has the same random numbers as itself, even if no stream is common to
        # all points.
        if sharing or pair[0] == pair[1]:
            pairs = first.index.isin(second.index)
            if paired := 2 * int(pairs.sum()) >= min(len(first), len(second)):
                first = first[pairs]
            second = second[second.index.isin(first.index) == paired]
        else:
            paired = False
        compared.append(ComparedTrials(first, second, paired, counts))
    return compared


def _codes(
    first: pd.DataFrame, second: pd.DataFrame
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return a number for each trial of two tables; equal for equal random numbers."""
    codes, _ = replicates(first).append(replicates(second)).factorize(sort=True)
    return codes[: len(first)], codes[len(first) :]


def _values(side: Side, column: str) -> Floats:
    return (
        side.trials[column].where(side.trials["status"] == "done").to_numpy(np.float64)
    )


def _undefined(
    side_a: Side, side_b: Side, column: str, matching: Matching
) -> Iterator[_Undefined]:
    """Yield the fractions of undefined values at each pair of points."""
    of_a = undefined_shares(side_a.trials, column)
    of_b = undefined_shares(side_b.trials, column)
    for point_a, point_b in matching.points:
        yield _Undefined(float(of_a[point_a]), float(of_b[point_b]))


def contrasts_of(
    side_a: Side, side_b: Side, column: str, compared: Sequence[ComparedTrials]
) -> Iterator[Contrast]:
    """Yield the contrast B minus A in a column of the trials at each pair of points.

    Parameters
    ----------
    side_a, side_b : Side
    column : str
        Column of the trials; the distribution is as declared in the study of side A.
    compared : sequence of ComparedTrials
        The trials of each pair of points, from `places_of`.

    Yields
    ------
    Contrast
    """
    values_a = _values(side_a, column)
    values_b = _values(side_b, column)
    distribution = side_a.study.distributions[column]
    for first, second, paired, _ in compared:
        sample_a = values_a[first.to_numpy()]
        sample_b = values_b[second.to_numpy()]
        if paired:
            yield paired_contrast(
                pd.Series(sample_a, index=first.index),
                pd.Series(sample_b, index=second.index),
                distribution=distribution,
            )
        else:
            yield independent_contrast(
                sample_a[~np.isnan(sample_a)],
                sample_b[~np.isnan(sample_b)],
                distribution=distribution,
            )


def _family(contrasts: Sequence[Contrast], method: Inference) -> Family:
    """Return contrasts with simultaneous intervals. ChoiceError if max_t has none."""
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
    """Return the columns from a to verdict of `Comparison.rows`.

    The contrasts are one family. ChoiceError if max_t cannot judge the contrasts.
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
    values = (side.value for side in sides)
    columns["verdict"] = [
        _verdict(difference, p, p_equivalent, level)
        for difference, p, p_equivalent in zip(values, family.p, within, strict=True)
    ]
    return pd.DataFrame(columns)


def _verdict(difference: float, p: float, p_equivalent: float, level: float) -> str:
    """Return the verdict of B, an entry of VERDICTS."""
    if np.isnan(p):
        return "too few distinct values"
    verdicts = ["higher" if difference > 0.0 else "lower"] if p < level else []
    verdicts += ["equivalent"] if p_equivalent < level else []
    return ", ".join(verdicts) or "no difference shown"
