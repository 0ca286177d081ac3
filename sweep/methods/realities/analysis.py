"""The reality gap: scores in the design world, and over pseudo-realities.

A controller is a point of the axes of `sweep`. The score of a controller in a reality
is the mean of a metric over the replicates. All controllers share the realities, so
differences between controllers are paired by reality and by replicate.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.analysis import (
    CONFIDENCE,
    Declaration,
    Interval,
    in_full,
    mean_interval,
    paired_estimate,
    simultaneous_confidence,
)
from sweep.errors import ChoiceError
from sweep.figures import direction, named
from sweep.methods.realities.estimates import (
    Floats,
    crossed_estimate,
    crossed_interval,
    difference_interval,
    fewer_known,
    known_means,
    lost_fraction,
    varies,
    worst_mean,
)
from sweep.methods.realities.section import KEY
from sweep.methods.realities.surrogate import SobolIndices, sobol_indices
from sweep.spec import Column
from sweep.tables import StoredStudy

REPLICATE = ["seed", "replicate"]
DROPS = "drops"
GAINS = "gains"
HOLDS = "holds"
REVERSES = "reverses"
UNDECIDED = "not decided"


@dataclass(frozen=True, eq=False)
class Scores:
    """The values of a metric for each controller in each reality.

    Attributes
    ----------
    controllers : list of str
        Name of each of the C controllers: the parameters that differ.
    design : array
        Values in the design world, (C, R), a column per replicate. NaN for no value.
    drawn : array
        Values in N realities, (C, N, R).
    imperfections : DataFrame
        The imperfections of each reality, N rows.
    without_value : int
        Number of trials without a value.
    """

    controllers: list[str]
    design: Floats
    drawn: Floats
    imperfections: pd.DataFrame
    without_value: int

    def realities(self, controller: int) -> Floats:
        """Return the score of a controller in each reality, (N,)."""
        return known_means(self.drawn[controller], 1)


class ControllerGap(NamedTuple):
    """The gap of a controller.

    Attributes
    ----------
    controller : str
    design, realities : Interval
        Mean score in the design world, and over the realities.
    drop : Interval
        Loss from the design world to the realities, positive if the realities are
        worse. The interval is simultaneous.
    worst_tenth : Interval
        Mean score over the worst tenth of the realities.
    verdict : str
        "drops", "gains" or "not decided".
    indices : SobolIndices
        The part of each imperfection in the variance over realities.
    """

    controller: str
    design: Interval
    realities: Interval
    drop: Interval
    worst_tenth: Interval
    verdict: str
    indices: SobolIndices


class RankChange(NamedTuple):
    """Two controllers, of which `leader` is better in the design world.

    Attributes
    ----------
    leader, other : str
    design, realities : Interval
        Advantage of the leader in the design world, and over the realities. The
        intervals are simultaneous.
    change : Interval
        Probability that `other` is better in a reality drawn at random.
    verdict : str
        "holds", "reverses" or "not decided".
    """

    leader: str
    other: str
    design: Interval
    realities: Interval
    change: Interval
    verdict: str


@dataclass(frozen=True, eq=False)
class RealityGap:
    """The reality gap of a study.

    Attributes
    ----------
    study : StoredStudy
    metric : str
    better : str
        "high" or "low": the better values of the metric.
    confidence : float
        Confidence of all intervals. The intervals that decide verdicts are
        simultaneous.
    scores : Scores
    controllers : list of ControllerGap
    pairs : list of RankChange
    """

    study: StoredStudy
    metric: str
    better: str
    confidence: float
    scores: Scores
    controllers: list[ControllerGap]
    pairs: list[RankChange]

    @property
    def draws(self) -> int:
        """The number of realities."""
        return len(self.scores.imperfections)

    @property
    def repeated(self) -> int:
        """The number of draws of the study that repeat a reality or the design world.

        Repeated draws are no realities, so all estimates are over different realities.
        0 for a plan that does not record the number.
        """
        record: dict[str, int] = self.study.about.sections[KEY.name]
        return record.get("repeated", 0)


def scores_of(study: StoredStudy, column: str) -> Scores:
    """Return the values of a metric for each controller in each reality.

    Parameters
    ----------
    study : StoredStudy
        `where` chooses among controllers and realities.
    column : str
        A column of trials, such as "speed" or "speed_mean".

    Raises
    ------
    ChoiceError
        The spec has no realities, the metric is unknown, or the design world or all
        realities are left out.
    """
    record = study.about.sections.get(KEY.name)
    if record is None:
        raise ChoiceError(
            f'the spec has no "{KEY.name}": add {KEY.name}: {KEY.example}', study.name
        )
    study.check_metric(Column.read(column).metric)
    design: dict[str, object] = record["design"]
    axes = study.axes
    grouping = [
        name for axis in axes if axis != KEY.name for name in axes[axis].settings
    ]
    plan = study.plan.to_pandas()
    done = study.trials[study.trials["status"] == "done"].set_index("trial_id")[column]
    values = plan["trial_id"].map(done).astype(np.float64).to_numpy()
    values = np.where(np.isfinite(values), values, np.nan)
    is_design = _equal(plan, design)
    if is_design.all() or not is_design.any():
        left = "realities" if is_design.all() else "trial of the design world"
        raise ChoiceError(f"the chosen points have no {left}", study.name)
    rows, imperfections = _numbered(plan, axes[KEY.name].settings, ~is_design)
    columns, _ = _numbered(plan, REPLICATE)
    places, controllers = _numbered(plan, grouping)
    shape = (len(controllers), len(imperfections), columns.max() + 1)
    table = np.full(shape, np.nan)
    table[places[~is_design], rows[~is_design], columns[~is_design]] = values[
        ~is_design
    ]
    at_design = np.full((shape[0], shape[2]), np.nan)
    at_design[places[is_design], columns[is_design]] = values[is_design]
    return Scores(
        [
            named((str(name), row[name]) for name in row) or study.name
            for row in controllers.to_dict("records")
        ],
        design=at_design,
        drawn=table,
        imperfections=imperfections,
        without_value=int(np.isnan(values).sum()),
    )


def _equal(plan: pd.DataFrame, values: dict[str, object]) -> NDArray[np.bool_]:
    """Return the trials with all of some values."""
    equal = np.ones(len(plan), np.bool_)
    for name, value in values.items():
        equal &= (plan[name] == value).to_numpy(np.bool_)
    return equal


def _numbered(
    plan: pd.DataFrame, columns: Sequence[str], chosen: NDArray[np.bool_] | None = None
) -> tuple[NDArray[np.intp], pd.DataFrame]:
    """Return the number of the combination of some columns, and the combinations.

    Combinations are numbered in the order of the plan. Trials that are not `chosen`
    have -1.
    """
    part = plan if chosen is None else plan[chosen]
    numbers = np.full(len(plan), -1, np.intp)
    places = np.arange(len(plan)) if chosen is None else np.flatnonzero(chosen)
    if not columns:
        numbers[places] = 0
        return numbers, pd.DataFrame(index=[0])
    groups = part.groupby([*columns], sort=False)
    numbers[places] = groups.ngroup().to_numpy()
    return numbers, part[[*columns]].drop_duplicates().reset_index(drop=True)


def reality_gap(
    study: StoredStudy,
    metric: str | None = None,
    *,
    half: bool = False,
    confidence: float = CONFIDENCE,
) -> RealityGap:
    """Return the reality gap of each controller, and the rank changes of each pair.

    Parameters
    ----------
    study : StoredStudy
        `where` chooses among controllers and realities.
    metric : str, optional
        A column of trials, such as "speed" or "speed_mean", optionally with the better
        direction: "speed+" for high values, "speed-" for low values. By default the
        declared direction, and high values for a metric without a direction. By default
        the first recorded metric.
    half : bool, default False
        Means over the second half of each trial, instead of the last frame.
    confidence : float, default 0.95
        Simultaneous confidence of the verdicts, and confidence of other intervals.

    Returns
    -------
    RealityGap

    Raises
    ------
    ChoiceError
        The confidence is not between 0 and 1, the spec has no realities, the metric is
        unknown, or the design world or all realities are left out.
    """
    if not 0.0 < confidence < 1.0:
        raise ChoiceError(
            f"confidence must be between 0 and 1, not {confidence}", study.name
        )
    score, prefers_high = direction(study, metric or study.metrics[0])
    column = str(Column.read(score)._replace(half=True)) if half else score
    scores = scores_of(study, column)
    sign = 1.0 if prefers_high else -1.0
    count = len(scores.controllers)
    pairs = list(combinations(range(count), 2))
    judge = _Judge(
        scores,
        sign,
        in_full(study.distributions[column]),
        confidence=confidence,
        # One drop per controller, and two advantages per pair.
        simultaneous=simultaneous_confidence(count + 2 * len(pairs), confidence),
    )
    return RealityGap(
        study=study,
        metric=column,
        better="high" if prefers_high else "low",
        confidence=confidence,
        scores=scores,
        controllers=[judge.controller(number) for number in range(count)],
        pairs=[judge.pair(first, second) for first, second in pairs],
    )


@dataclass(frozen=True, eq=False)
class _Judge:
    """The estimates and verdicts of a table of scores.

    `sign` is 1 if high values are better, else -1.
    """

    scores: Scores
    sign: float
    distribution: Declaration
    confidence: float
    simultaneous: float

    def controller(self, number: int) -> ControllerGap:
        """Return the gap of a controller."""
        scores = self.scores
        worst = partial(worst_mean, low_is_worst=self.sign > 0.0)
        drop = self._drop(number)
        return ControllerGap(
            scores.controllers[number],
            design=self._in_design(number, self.confidence),
            realities=self._over_realities(number, self.confidence),
            drop=drop,
            worst_tenth=crossed_estimate(worst, scores.drawn[number], self.confidence),
            verdict=_verdict(drop, DROPS, GAINS),
            indices=self._indices(number),
        )

    def _in_design(self, number: int, confidence: float) -> Interval:
        return mean_interval(
            self.scores.design[number], confidence, distribution=self.distribution
        )

    def _over_realities(self, number: int, confidence: float) -> Interval:
        rows = self.scores.realities(number)
        columns = known_means(self.scores.drawn[number], 0)
        interval = crossed_interval(_mean(rows), rows, columns, confidence)
        if np.isfinite(interval.low):
            return interval
        independent = fewer_known(rows, columns)
        return mean_interval(independent, confidence, distribution=self.distribution)

    def _drop(self, number: int) -> Interval:
        """Return the loss from the design world to the realities.

        Normal values are paired by replicate. Other distributions, and values without
        variation, need the interval of the declared distribution.
        """
        design = self.scores.design[number]
        rows = self.scores.realities(number)
        confidence = self.simultaneous
        if self.distribution.distribution == "normal" and varies(design):
            paired = design - known_means(self.scores.drawn[number], 0)
            value = _mean(design) - _mean(rows)
            drop = crossed_interval(value, rows, paired, confidence)
            if np.isfinite(drop.low):
                return self._oriented(drop)
        ends = [
            self._over_realities(number, confidence),
            self._in_design(number, confidence),
        ]
        return difference_interval(*(self._oriented(end) for end in ends))

    def _oriented(self, interval: Interval) -> Interval:
        """Return an interval in which high values are better."""
        if self.sign > 0.0:
            return interval
        return Interval(-interval.value, -interval.high, -interval.low, interval.n)

    def _indices(self, number: int) -> SobolIndices:
        """Return the Sobol indices of the realities with a score."""
        table = self.scores.drawn[number]
        rows = self.scores.realities(number)
        finite = np.isfinite(rows)
        # Common random numbers change all realities of a replicate alike, also those
        # without a value in another replicate.
        alike = known_means(table - rows[:, None], 0)
        table = table - np.where(np.isfinite(alike), alike, 0.0)
        rows = known_means(table, 1)
        noise = _noise(table - rows[:, None])
        return sobol_indices(
            self.scores.imperfections[finite],
            rows[finite],
            None if noise is None else noise[finite],
            self.confidence,
        )

    def pair(self, first: int, second: int) -> RankChange:
        """Return the rank change of a pair.

        Parameters
        ----------
        first, second : int
            Indices of two controllers. The better one in the design world becomes the
            leader.
        """
        scores = self.scores
        design = self._advantage(scores.design[first], scores.design[second])
        if design.value < 0.0:
            return self.pair(second, first)
        realities = self._advantage_over_realities(first, second)
        change = Interval(np.nan, np.nan, np.nan, 0)
        if design.value > 0.0:
            table = self._advantages(first, second)
            change = crossed_estimate(lost_fraction, table, self.confidence)
        low, high = np.clip([change.low, change.high], 0.0, 1.0).tolist()
        return RankChange(
            self.scores.controllers[first],
            self.scores.controllers[second],
            design=design,
            realities=realities,
            change=change._replace(low=low, high=high),
            verdict=_pair_verdict(design, realities),
        )

    def _advantages(self, first: int, second: int) -> Floats:
        """Return the advantage of a first controller in each trial, (N, R)."""
        drawn = self.scores.drawn
        advantages: Floats = self.sign * (drawn[first] - drawn[second])
        return advantages

    def _advantage_over_realities(self, first: int, second: int) -> Interval:
        """Return the advantage of a first controller, the mean over realities."""
        table = self._advantages(first, second)
        rows = known_means(table, 1)
        columns = known_means(table, 0)
        interval = crossed_interval(_mean(rows), rows, columns, self.simultaneous)
        if np.isfinite(interval.low):
            return interval
        both = np.isfinite(table)
        sides = [
            fewer_known(known_means(values, 1), known_means(values, 0))
            for values in (
                np.where(both, self.scores.drawn[controller], np.nan)
                for controller in (first, second)
            )
        ]
        return self._advantage(*sides)

    def _advantage(self, first: Floats, second: Floats) -> Interval:
        """Return the mean advantage of a first controller over independent pairs."""
        both = np.isfinite(first) & np.isfinite(second)
        estimate = paired_estimate(second[both], first[both], self.distribution)
        bounds = (np.nan, np.nan)
        if estimate.testable:
            bounds = estimate.interval(self.simultaneous)
        return self._oriented(Interval(estimate.value, *bounds, int(both.sum())))


def _mean(values: Floats) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if len(finite) else np.nan


def _noise(rest: Floats) -> Floats | None:
    """Return the squared error of the mean of each row by replicate noise, (N,).

    A row with a single value has the pooled variance of the other rows. None if no row
    has two values. `rest` is (N, R), without the common part of each replicate.
    """
    finite = np.isfinite(rest)
    count = finite.sum(axis=1)
    several = count > 1
    if not several.any():
        return None
    squares = (np.where(finite, rest, 0.0) ** 2).sum(axis=1)
    pooled = squares[several].sum() / (count[several] - 1).sum()
    variances = np.where(several, squares / np.maximum(count - 1, 1), pooled)
    errors: Floats = variances / np.maximum(count, 1)
    return errors


def _verdict(interval: Interval, above: str, below: str) -> str:
    if interval.low > 0.0:
        return above
    return below if interval.high < 0.0 else UNDECIDED


def _pair_verdict(design: Interval, realities: Interval) -> str:
    """Return whether the leader of the design world leads over the realities too."""
    if not design.low > 0.0:
        return UNDECIDED
    return _verdict(realities, HOLDS, REVERSES)
