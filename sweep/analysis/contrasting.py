"""Differences between two selections of trials, paired by common random numbers.

With common random numbers the variance of the difference is var(first) + var(second) -
2 cov(first, second) (Law 2015, Simulation Modeling and Analysis, section 11.2).
Therefore two selections with equal initial conditions differ less by chance than
independent selections. Each contrast reports the pairing and the variance reduction.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, Protocol, get_args

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis.estimate import (
    CONFIDENCE,
    MeanEstimate,
    mean_estimate,
    paired_estimate,
)
from sweep.analysis.intervals import NONE_DECLARED
from sweep.analysis.mean_bounds import Declared
from sweep.analysis.pairing import Unit, Units, agrees, chosen, pairable, units
from sweep.analysis.simultaneous import adjusted, max_t, simultaneous_confidence
from sweep.text import unknown

Floats = NDArray[np.float64]
Together = Literal["holm", "bonferroni", "sidak", "max_t"]


class TrialTables(Protocol):
    """The part of a stored study that a contrast needs."""

    @property
    def trials(self) -> pd.DataFrame:
        """The table of trials."""

    @property
    def varied(self) -> list[str]:
        """Names of the parameters that differ between points."""

    @property
    def distributions(self) -> Mapping[str, Declared]:
        """Distribution of the values over trials, by the name of the column."""


@dataclass(frozen=True, eq=False)
class Contrast:
    """The difference between two group means, b - a, with the sign of `sweep compare`.

    Attributes
    ----------
    estimate : MeanEstimate
        The difference, in the unit of the metric.
    a, b : array
        Independent values of each group, in the same unit. Paired values are (n,)
        each, in the order of `pairs`. Otherwise the lengths may differ.
    pairs : Index or None
        Keys of the pairs; None if the groups are not paired.
    left_out : int
        Number of trials without a result.
    """

    estimate: MeanEstimate
    a: Floats
    b: Floats
    pairs: pd.Index | None
    left_out: int

    @property
    def paired(self) -> bool:
        """True if the value is the mean of differences within pairs."""
        return self.pairs is not None

    @property
    def value(self) -> float:
        """The difference, b - a."""
        return self.estimate.value

    @property
    def correlation(self) -> float:
        """Pearson's correlation within pairs.

        NaN if not paired, if a side does not vary, and for fewer than 2 pairs.
        """
        if (
            not self.paired
            or len(self.a) < 2
            or np.ptp(self.a) == 0.0
            or np.ptp(self.b) == 0.0
        ):
            return np.nan
        return float(np.corrcoef(self.a, self.b)[0, 1])

    @property
    def variance_reduction(self) -> float:
        """Ratio of variances without and with pairing, var(unpaired)/var(paired).

        Independent groups need this many times as many trials for an equal error. For
        equal variances the ratio is 1/(1 - correlation). The ratio is infinite if all
        differences are equal, below 1 for a negative correlation, and NaN if not paired
        or for fewer than 2 pairs.
        """
        if not self.paired or len(self.a) < 2:
            return np.nan
        unpaired = self.a.var(ddof=1) + self.b.var(ddof=1)
        change = self.b - self.a
        paired = change.var(ddof=1) if np.ptp(change) > 0.0 else 0.0
        return float(unpaired / paired) if paired > 0.0 else np.inf

    def interval(self, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """Return the bounds of the confidence interval of the difference.

        The distribution of the values determines the interval, see `MeanEstimate`.
        Normal values have Student's interval of the mean difference if paired, else
        Welch's. The bounds are NaN if unknown, for example for constant samples.
        """
        return (
            self.estimate.interval(confidence)
            if self.estimate.testable
            else (np.nan, np.nan)
        )

    def p_value(self) -> float:
        """Return the two-sided p-value of no difference, by the declared distribution.

        NaN if unknown. `contrasts` adjusts p-values of several contrasts.
        """
        return self.estimate.p_value()


class Family(NamedTuple):
    """Contrasts with simultaneous confidence intervals and adjusted p-values.

    Attributes
    ----------
    contrasts : sequence of Contrast
        The k contrasts.
    low, high : array
        Bounds of the simultaneous confidence intervals, in the unit of the metric, (k,)
        each; NaN if unknown.
    p : array
        Adjusted p-values of no difference, (k,); NaN if not testable.
    """

    contrasts: Sequence[Contrast]
    low: Floats
    high: Floats
    p: Floats


class Equivalence(NamedTuple):
    """Two one-sided tests of equivalence.

    Attributes
    ----------
    p : float
        The larger of the two p-values; NaN if the estimate is not testable.
    low, high : float
        Bounds of the confidence interval at 1 - 2 `level`, in the unit of the estimate;
        NaN if not testable.
    equivalent : bool
        True if p is below `level`.
    """

    p: float
    low: float
    high: float
    equivalent: bool


def compare(a: Units, b: Units, distribution: Declared = "normal") -> Contrast:
    """Contrast two groups of units, b - a.

    Parameters
    ----------
    a, b : Units
        Paired if each unit has a partner, else treated as independent samples.
    distribution : Declared, default "normal"
        Distribution of the values.

    Returns
    -------
    Contrast
        The difference b - a, in the unit of the values.

    Examples
    --------
    >>> trials = sweep.load("my/first").trials
    >>> sides = [chosen(trials, {"separation_weight": weight}) for weight in (1, 2)]
    >>> a, b = (units(side, side["speed"], "trial", []) for side in sides)
    >>> difference = compare(a, b)
    >>> round(difference.value, 1), difference.paired, len(difference.pairs)
    (2.2, True, 10)
    """
    left_out = a.left_out + b.left_out
    if pairable(a, b):
        return paired_contrast(a.values, b.values, left_out, distribution)
    known_a, known_b = (values[~np.isnan(values)] for values in (a.array(), b.array()))
    return independent_contrast(known_a, known_b, left_out, distribution)


def independent_contrast(
    a: Floats,
    b: Floats,
    left_out: int = 0,
    distribution: Declared = "normal",
) -> Contrast:
    """Contrast the means of two independent samples, b - a.

    Parameters
    ----------
    a, b : array
        Values without NaN, of any two lengths.
    left_out : int, default 0
        Number of trials without a result.
    distribution : Declared, default "normal"
        Distribution of the values.

    Returns
    -------
    Contrast
        The difference b - a, in the unit of the values.

    Examples
    --------
    >>> a = np.array([0.61, 0.58, 0.66, 0.63, 0.6])
    >>> b = np.array([0.65, 0.7, 0.62, 0.67])
    >>> difference = independent_contrast(a, b)
    >>> round(difference.value, 3), round(difference.p_value(), 2), difference.paired
    (0.044, 0.09, False)
    """
    estimate = mean_estimate(a, b, distribution=distribution)
    return Contrast(estimate, a, b, pairs=None, left_out=left_out)


def paired_contrast(
    a: "pd.Series[float]",
    b: "pd.Series[float]",
    left_out: int = 0,
    distribution: Declared = "normal",
) -> Contrast:
    """Contrast two columns by the mean of the differences within pairs, b - a.

    Parameters
    ----------
    a, b : Series
        Values with equal index are pairs. A pair that lacks a value does not count.
    left_out : int, default 0
        Number of trials without a result.
    distribution : Declared, default "normal"
        Distribution of the values.

    Returns
    -------
    Contrast
        The difference b - a, in the unit of the values.

    Raises
    ------
    ValueError
        If an index has a duplicate entry.

    Examples
    --------
    >>> a = pd.Series({"seed 0": 0.61, "seed 1": 0.58, "seed 2": 0.66})
    >>> b = pd.Series({"seed 2": 0.71, "seed 0": 0.65, "seed 1": 0.64})
    >>> difference = paired_contrast(a, b)
    >>> round(difference.value, 3), round(difference.variance_reduction, 1)
    (0.05, 30.7)
    """
    if not (a.index.is_unique and b.index.is_unique):
        raise ValueError(
            "values cannot be paired: several have equal seed, replicate and parameters"
        )
    partners = b.index.get_indexer(a.index)
    first, column = (np.asarray(side, np.float64) for side in (a, b))
    # The index of a missing partner is -1, which takes the NaN at the end.
    second = np.append(column, np.nan)[partners]
    complete = np.flatnonzero(~(np.isnan(first) | np.isnan(second)))
    pairs = a.index[complete]
    order = pairs.argsort()
    first = first[complete][order]
    second = second[complete][order]
    estimate = paired_estimate(first, second, distribution)
    return Contrast(estimate, first, second, pairs=pairs[order], left_out=left_out)


def contrast(
    source: TrialTables | pd.DataFrame,
    metric: str,
    *,
    a: Mapping[str, Any],
    b: Mapping[str, Any],
    unit: Unit | None = None,
) -> Contrast:
    """Estimate the difference in a metric between two groups of trials, b - a.

    Trials are paired by seed, replicate and the varied parameters that neither group
    names. This needs common random numbers for the initial conditions (the spec's
    `streams: {start: common}`) and equal keys in the two groups. Otherwise the groups
    are treated as independent samples.

    Parameters
    ----------
    source : study or DataFrame
        A stored study, or a table of trials. In a DataFrame, values are assumed to be
        normal, and only the named parameters to vary.
    metric : str
        Column of the trials.
    a, b : mapping
        Parameter values of each group, such as `{"separation_weight": 2}`. The sign of
        the difference is as in `sweep compare A B`.
    unit : {"trial", "point", "replicate"}, optional
        The independent values if a group has several points: trials, means of points or
        means of replicates. Use "replicate" with common random numbers.

    Returns
    -------
    Contrast
        The difference b - a, in the unit of the values.

    Raises
    ------
    ValueError
        If a name is unknown, a group is empty, the groups overlap, or `unit` is
        missing.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> weights = [{"separation_weight": weight} for weight in (1, 2)]
    >>> difference = contrast(study, "speed", a=weights[0], b=weights[1])
    >>> round(difference.value, 1), [round(x, 1) for x in difference.interval()]
    (2.2, [1.8, 2.6])
    >>> difference.paired, len(difference.a)
    (True, 10)
    """
    trials, varied, distributions = _table(source)
    for name in (metric, *a, *b):
        _check_column(trials, name)
    sides = [chosen(trials, settings) for settings in (a, b)]
    for side, settings in zip(sides, (a, b), strict=True):
        if side.empty:
            raise ValueError(f"no trial has {_words(settings)}")
    if set(sides[0]["trial_id"]) & set(sides[1]["trial_id"]):
        raise ValueError(
            f"{_words(a)} and {_words(b)} share trials;"
            " a contrast needs two groups without common trials"
        )
    free = [name for name in varied if name not in {*a, *b}]
    units_a, units_b = (_units(side, metric, unit, free) for side in sides)
    return compare(units_a, units_b, distributions.get(metric, "normal"))


def contrasts(
    source: TrialTables | pd.DataFrame,
    metric: str,
    by: str,
    reference: object,
    settings: Mapping[str, Any] | None = None,
    unit: Unit | None = None,
    confidence: float = CONFIDENCE,
    together: Together = "holm",
) -> pd.DataFrame:
    """Contrast every value of a parameter with a reference value, value - reference.

    `contrast` describes the pairing of trials, and the errors.

    Parameters
    ----------
    source : study or DataFrame
        A stored study, or a table of trials.
    metric : str
        Column of the trials.
    by : str
        Parameter whose values are compared.
    reference : object
        Value of `by` that is subtracted.
    settings : mapping, optional
        Values of further parameters, common to all trials.
    unit : {"trial", "point", "replicate"}, optional
        The independent values if several points remain.
    confidence : float, default 0.95
        Simultaneous confidence of all intervals.
    together : {"holm", "bonferroni", "sidak", "max_t"}, default "holm"
        Correction for multiple comparisons, see `jointly`.

    Returns
    -------
    DataFrame
        A row per value, with columns `by`, difference, low, high, p, paired, n,
        correlation, variance_reduction and left_out. `n` counts pairs, or the values
        that are compared with the reference.

    Raises
    ------
    ValueError
        If no trial has a value other than `reference`, and as in `contrast` and
        `jointly`.

    Examples
    --------
    >>> study = sweep.load("my/first")
    >>> table = contrasts(study, "speed", by="separation_weight", reference=1)
    >>> table[["separation_weight", "difference", "low", "high", "n"]].round(2)
       separation_weight  difference   low  high   n
    0                0.5        1.48  0.91  2.06  10
    1                2.0        2.23  1.75  2.72  10
    """
    trials, *_ = _table(source)
    _check_column(trials, by)
    same = dict(settings or {})
    values = [
        value
        for value in dict.fromkeys(chosen(trials, same)[by])
        if not agrees([value], reference)[0]
    ]
    if not values:
        raise ValueError(f"no trial has a value of {by} other than {reference}")
    sides = [
        contrast(
            source, metric, a=same | {by: reference}, b=same | {by: value}, unit=unit
        )
        for value in values
    ]
    family = jointly(sides, confidence, together)
    sides = list(family.contrasts)
    columns = {
        by: values,
        "difference": [side.value for side in sides],
        "low": family.low,
        "high": family.high,
    }
    columns |= {
        "p": family.p,
        "paired": [side.paired for side in sides],
        "n": [len(side.b) for side in sides],
    }
    columns |= {name: [getattr(side, name) for side in sides] for name in SHOWN}
    return pd.DataFrame(columns)


SHOWN = ("correlation", "variance_reduction", "left_out")


def jointly(
    sides: Sequence[Contrast],
    confidence: float = CONFIDENCE,
    together: Together = "holm",
) -> Family:
    """Return contrasts with simultaneous confidence intervals and adjusted p-values.

    "bonferroni" and "sidak" correct intervals and p-values. "holm" combines
    Bonferroni's intervals with Holm's p-values. Holm's p-values are never larger than
    Bonferroni's, so a p-value may be small although the interval includes zero. "max_t"
    computes intervals and p-values from one bootstrap of whole replicates. "max_t"
    needs paired contrasts, and leaves replicates that lack a trial out of all
    contrasts. `sweep.analysis.simultaneous` describes when each correction is valid.

    A contrast of fewer than two values is not a test. A contrast of constant samples is
    a test only if the values have a range or are events, and never with "max_t".

    Parameters
    ----------
    sides : sequence of Contrast
        The k contrasts.
    confidence : float, default 0.95
        Simultaneous confidence of all intervals.
    together : {"holm", "bonferroni", "sidak", "max_t"}, default "holm"
        Correction for multiple comparisons.

    Returns
    -------
    Family
        In the order of `sides`; with "max_t", contrasts of the common pairs.

    Raises
    ------
    ValueError
        If the correction is unknown. With "max_t" also if a contrast is not paired, or
        if `max_t` rejects the values.

    Examples
    --------
    >>> a = np.array([0.61, 0.58, 0.66, 0.63, 0.6])
    >>> sides = [independent_contrast(a, a + shift) for shift in (0.0, 0.1)]
    >>> family = jointly(sides)
    >>> family.low.round(3).tolist(), family.high.round(3).tolist()
    ([-0.053, 0.047], [0.053, 0.153])
    >>> family.p.round(3).tolist()
    [1.0, 0.002]
    """
    if together not in get_args(Together):
        raise ValueError(unknown("together", together, get_args(Together)))
    if together == "max_t":
        sides = _common(sides)
        changes = np.column_stack([side.b - side.a for side in sides])
        resampled = max_t(changes, confidence)
        cut = [
            side.estimate.support.cut(*bounds)
            for side, *bounds in zip(sides, *resampled[:3], strict=True)
        ]
        low, high = np.array(cut, np.float64).T
        return Family(sides, low, high, resampled.p)
    tests = max(1, sum(side.estimate.testable for side in sides))
    level = simultaneous_confidence(
        tests, confidence, "sidak" if together == "sidak" else "bonferroni"
    )
    bounds = np.array([side.interval(level) for side in sides])
    p_values = adjusted([side.estimate.p_value() for side in sides], together)
    return Family(sides, bounds[:, 0], bounds[:, 1], p_values)


def equivalence(
    estimate: MeanEstimate, low: float, high: float, level: float = 0.05
) -> Equivalence:
    """Test whether an estimate is between two margins of equivalence.

    Two one-sided tests (Schuirmann 1987, J. Pharmacokin. Biopharm. 15, 657-680): an
    estimate is equivalent if the two tests reject at `level`. For a true value on or
    beyond a margin, the probability of a result "equivalent" is at most `level`, if the
    interval of the estimate is valid. An estimate that is not equivalent need not
    differ.

    Parameters
    ----------
    estimate : MeanEstimate
        A mean or a difference, for example from `mean_estimate`.
    low, high : float
        Margins in the unit of the estimate, chosen before the data are seen.
    level : float, default 0.05
        Level of each one-sided test.

    Returns
    -------
    Equivalence
        With NaN for p and bounds if the estimate is not testable.

    Raises
    ------
    ValueError
        If `low` is not below `high`.

    Examples
    --------
    >>> changes = np.array([0.01, -0.02, 0.0, 0.03, -0.01, 0.02])
    >>> result = equivalence(mean_estimate(changes), -0.05, 0.05)
    >>> round(result.p, 3), round(result.low, 3), round(result.high, 3)
    (0.001, -0.01, 0.02)
    >>> result.equivalent
    True
    """
    if not low < high:
        raise ValueError(
            f"margins: {low} to {high}; the first must be below the second"
        )
    if not estimate.testable:
        return Equivalence(np.nan, np.nan, np.nan, False)
    p = max(estimate.tail(low, above=True), estimate.tail(high, above=False))
    return Equivalence(p, *estimate.interval(1.0 - 2.0 * level), p < level)


def _common(sides: Sequence[Contrast]) -> list[Contrast]:
    """Return the contrasts of the pairs that all contrasts have.

    Raises ValueError if a contrast is not paired.
    """
    if not all(side.paired for side in sides):
        raise ValueError(
            "max_t resamples whole replicates:"
            " every value needs a trial of each replicate, with a common start stream"
        )
    tables = [
        pd.DataFrame({"a": side.a, "b": side.b}, index=side.pairs) for side in sides
    ]
    common = tables[0].index
    for table in tables[1:]:
        common = common.intersection(table.index)
    chosen_pairs = [table.loc[common] for table in tables]
    return [
        _contrast_of_pairs(side, table)
        for table, side in zip(chosen_pairs, sides, strict=True)
    ]


def _contrast_of_pairs(side: Contrast, table: pd.DataFrame) -> Contrast:
    """Return the contrast of some pairs of a contrast, with unchanged support."""
    distribution = side.estimate.distribution
    fewer = paired_contrast(table["a"], table["b"], side.left_out, distribution)
    estimate = replace(fewer.estimate, support=side.estimate.support)
    return replace(fewer, estimate=estimate)


def _units(
    trials: pd.DataFrame, metric: str, unit: Unit | None, free: Sequence[str]
) -> Units:
    points = trials["point"].nunique()
    if points > 1 and unit not in get_args(Unit):
        raise ValueError(
            f'{points:,} points are left on one side; "unit" must name the independent'
            " values "
            f"({', '.join(get_args(Unit))}), or the sides must name more parameters"
        )
    values = trials[metric].astype(np.float64).where(trials["status"] == "done")
    independent = units(trials, values, unit or "trial", free)
    if points > 1 and not independent.values.index.is_unique:
        raise ValueError(
            "trials of equal seed and replicate differ in parameters that are not named"
        )
    return independent


def _table(
    source: TrialTables | pd.DataFrame,
) -> tuple[pd.DataFrame, Sequence[str], Mapping[str, Declared]]:
    return (
        (source, (), NONE_DECLARED)
        if isinstance(source, pd.DataFrame)
        else (source.trials, source.varied, source.distributions)
    )


def _check_column(trials: pd.DataFrame, name: str) -> None:
    if name not in trials:
        raise ValueError(unknown("column", name, [str(column) for column in trials]))


def _words(settings: Mapping[str, Any]) -> str:
    return (
        ", ".join(f"{name} = {value}" for name, value in settings.items())
        or "no parameters"
    )
