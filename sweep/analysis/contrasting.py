"""What a change of settings does: the difference of two selections of trials, paired
where they share random numbers.

Two selections whose trials start alike differ less by chance than independent ones:
with common random numbers the variance of the difference is var(first) + var(second) -
2 cov(first, second) (Law 2015, Simulation Modeling and Analysis, section 11.2). Each
result says whether it is paired and what that brought.
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
    """What a contrast needs of a stored study: its trials and the names of the settings
    that differ between points.
    """

    @property
    def trials(self) -> pd.DataFrame:
        """One row a trial."""

    @property
    def varied(self) -> list[str]:
        """Names of settings."""

    @property
    def distributions(self) -> Mapping[str, Declared]:
        """How the values of columns are distributed over trials."""


@dataclass(frozen=True, eq=False)
class Contrast:
    """The mean of b minus that of a, as `sweep compare A B` has it.

    `a` and `b` hold the independent values that count: where paired, (n,) each in the
    order of `pairs`, what tells pairs apart (else None), and of any two lengths where
    not. `left_out` counts trials without a result.
    """

    estimate: MeanEstimate
    a: Floats
    b: Floats
    pairs: pd.Index | None
    left_out: int

    @property
    def paired(self) -> bool:
        """Whether it is the mean of differences within pairs."""
        return self.pairs is not None

    @property
    def value(self) -> float:
        """The difference, b minus a."""
        return self.estimate.value

    @property
    def correlation(self) -> float:
        """Pearson's correlation within pairs; NaN where not paired, where a side does
        not vary, or below 2 pairs.
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
        """How many times as many independent trials would be needed for the same error:
        var(unpaired)/var(paired).

        Infinite where all differences are equal, below 1 where pairs vary against each
        other, NaN where not paired or below 2 pairs. For equal variances it is 1/(1 -
        correlation).
        """
        if not self.paired or len(self.a) < 2:
            return np.nan
        unpaired = self.a.var(ddof=1) + self.b.var(ddof=1)
        change = self.b - self.a
        paired = change.var(ddof=1) if np.ptp(change) > 0.0 else 0.0
        return float(unpaired / paired) if paired > 0.0 else np.inf

    def interval(self, confidence: float = CONFIDENCE) -> tuple[float, float]:
        """The bounds of the interval that the distribution of the values has, see
        `MeanEstimate`: for normal ones Student's of the mean of differences, and
        Welch's where not paired; NaN if unknown, as for constant samples.
        """
        return (
            self.estimate.interval(confidence)
            if self.estimate.testable
            else (np.nan, np.nan)
        )

    def p_value(self) -> float:
        """The two-sided p-value of no difference, by the same distribution; NaN if
        unknown. Of several contrasts that are judged together see `contrasts`.
        """
        return self.estimate.p_value()


class Family(NamedTuple):
    """Contrasts looked at together: the bounds of intervals that all hold, and adjusted
    p-values, (k,) each.
    """

    contrasts: Sequence[Contrast]
    low: Floats
    high: Floats
    p: Floats


class Equivalence(NamedTuple):
    """Two one-sided tests: the larger p, the interval at 1 - 2 `level`, and whether it
    lies within the margins.
    """

    p: float
    low: float
    high: float
    equivalent: bool


def compare(a: Units, b: Units, distribution: Declared = "normal") -> Contrast:
    """b minus a: paired where each unit has its partner, else between independent
    samples. The values have this `distribution`.
    """
    left_out = a.left_out + b.left_out
    if pairable(a, b):
        return paired_contrast(a.values, b.values, left_out, distribution)
    before, after = (values[~np.isnan(values)] for values in (a.array(), b.array()))
    return independent_contrast(before, after, left_out, distribution)


def independent_contrast(
    a: Floats,
    b: Floats,
    left_out: int = 0,
    distribution: Declared = "normal",
) -> Contrast:
    """The mean of b minus that of a, of two independent samples without NaN."""
    estimate = mean_estimate(a, b, distribution=distribution)
    return Contrast(estimate, a, b, None, left_out)


def paired_contrast(
    a: "pd.Series[float]",
    b: "pd.Series[float]",
    left_out: int = 0,
    distribution: Declared = "normal",
) -> Contrast:
    """The mean of the differences, b minus a, of two columns whose index pairs them; a
    pair that lacks a side does not count.

    Raises ValueError where an index has an entry twice.
    """
    if not (a.index.is_unique and b.index.is_unique):
        raise ValueError(
            "values cannot be paired:"
            " several have the same seed, replicate and settings"
        )
    partners = b.index.get_indexer(a.index)
    one, column = (np.asarray(side, np.float64) for side in (a, b))
    other = np.append(column, np.nan)[partners]  # the last one for who has no partner
    complete = np.flatnonzero(~(np.isnan(one) | np.isnan(other)))
    pairs = a.index[complete]
    order = pairs.argsort()
    one, other = one[complete][order], other[complete][order]
    estimate = paired_estimate(one, other, distribution)
    return Contrast(estimate, one, other, pairs[order], left_out)


def contrast(
    source: TrialTables | pd.DataFrame,
    metric: str,
    *,
    a: Mapping[str, Any],
    b: Mapping[str, Any],
    unit: Unit | None = None,
) -> Contrast:
    """The mean of a column of trials where settings are `b` minus that where they are
    `a`: the sign of `sweep compare A B`. Both sides are named in a call.

    `source` is a stored study, or its table of trials, which then is taken to vary in
    the named settings only. Trials are paired by seed, replicate and the varied
    settings that neither side names, if all start in common (the spec's `streams:
    {start: common}`) and both sides have the same; else the two samples are taken to be
    independent. Where several points are left, `unit` says what is independent:
    "trial", the means of a "point", or those of a "replicate", the right one for starts
    in common. The interval is that of the distribution that a stored study knows of the
    column; a table is taken to have normal values. Raises ValueError for names that do
    not exist, sides that are empty or overlap, and where `unit` is missing.
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
            f"{_words(a)} and {_words(b)} share trials; a contrast needs two apart"
        )
    free = [name for name in varied if name not in {*a, *b}]
    one, other = (_units(side, metric, unit, free) for side in sides)
    return compare(one, other, distributions.get(metric, "normal"))


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
    """Every value of the setting `by` minus `reference`, where the other settings are
    `settings`.

    Columns: `by`, difference, low, high, p, paired, n (of pairs, else of values beside
    the reference), correlation, variance_reduction, left_out. The intervals hold
    together, as do the p-values, see `jointly`; `contrast` has pairs, units and errors.
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
        raise ValueError(f"no trial has another {by} than {reference}")
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
    """`sides` with intervals that all hold with `confidence`, and p-values that are
    adjusted for each other.

    With "bonferroni" and "sidak" both are those of that correction; "holm" has
    Bonferroni's intervals and Holm's p-values, which are never larger, so that one may
    be small although its interval has the zero. With "max_t" both come from one
    bootstrap of whole replicates, for which all must be paired; those that lack a trial
    are left out of all. `sweep.analysis.simultaneous` says when each is valid. A
    contrast of less than two values is no test, nor is one of constant samples, unless
    these have a range or are of events and nothing is resampled. Raises ValueError for
    another correction, and as `max_t`.
    """
    if together not in get_args(Together):
        raise ValueError(unknown("together", together, get_args(Together)))
    if together == "max_t":
        sides = _common(sides)
        found = max_t(np.column_stack([side.b - side.a for side in sides]), confidence)
        cut = [
            side.estimate.support.cut(*bounds)
            for side, *bounds in zip(sides, *found[:3], strict=True)
        ]
        low, high = np.array(cut, np.float64).T
        return Family(sides, low, high, found.p)
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
    """Whether an estimate is shown to lie between the margins `low` and `high`, chosen
    before looking.

    Two one-sided tests (Schuirmann 1987, J. Pharmacokin. Biopharm. 15, 657-680):
    equivalent if both reject at `level`, which a true value on or beyond a margin does
    with at most that chance, where the interval of the estimate holds. Not being shown
    equivalent does not mean to differ. p and bounds are NaN where the estimate is not
    testable. Raises ValueError for margins that are not in order.
    """
    if not low < high:
        raise ValueError(
            f"margins: {low} to {high}; the first must lie below the second"
        )
    if not estimate.testable:
        return Equivalence(np.nan, np.nan, np.nan, False)
    p = max(estimate.tail(low, above=True), estimate.tail(high, above=False))
    return Equivalence(p, *estimate.interval(1.0 - 2.0 * level), p < level)


def _common(sides: Sequence[Contrast]) -> list[Contrast]:
    """The contrasts of the pairs that all have. ValueError if one is not paired."""
    if not all(side.paired for side in sides):
        raise ValueError(
            "max_t resamples whole replicates:"
            " every value needs a trial of each, started in common"
        )
    tables = [
        pd.DataFrame({"a": side.a, "b": side.b}, index=side.pairs) for side in sides
    ]
    common = tables[0].index
    for table in tables[1:]:
        common = common.intersection(table.index)
    chosen_pairs = [table.loc[common] for table in tables]
    return [
        _paired_anew(side, table)
        for table, side in zip(chosen_pairs, sides, strict=True)
    ]


def _paired_anew(side: Contrast, table: pd.DataFrame) -> Contrast:
    """The contrast of some pairs of one."""
    before = side.estimate
    found = paired_contrast(table["a"], table["b"], side.left_out, before.distribution)
    return replace(found, estimate=replace(found.estimate, support=before.support))


def _units(
    trials: pd.DataFrame, metric: str, unit: Unit | None, free: Sequence[str]
) -> Units:
    points = trials["point"].nunique()
    if points > 1 and unit not in get_args(Unit):
        raise ValueError(
            f'{points:,} points are left on one side: "unit" must say what counts as'
            " one independent value "
            f"({', '.join(get_args(Unit))}), or more settings be named"
        )
    values = trials[metric].astype(np.float64).where(trials["status"] == "done")
    found = units(trials, values, unit or "trial", free)
    if points > 1 and not found.values.index.is_unique:
        raise ValueError(
            "trials of the same seed and replicate differ in settings that are not"
            " named"
        )
    return found


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
        or "no setting"
    )
