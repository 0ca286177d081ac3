"""Races: candidates that are clearly worse than the best one so far get no more trials.

Candidates are compared block by block, on the same random numbers. A mean is tested by
Student's one-sided test of the candidate's own paired differences, from two blocks on:
how noisy other candidates are does not matter. Other statistics are tested by
resampling blocks. After each rung every candidate left is tested once, at `level`.

What that costs is measured on the page of the decision:
docs/decisions/races-drop-clearly-worse-candidates.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sweep.spec.objectives import Constraint, Floats, Objective

Samples = Mapping[str, Floats]
"""The trials of one candidate: by column the values in the blocks it has had so far,
shape (blocks, scenarios).
"""

SAME = 1e-12
"""Differences that vary by less than this share of themselves are equal."""

LEAST_BLOCKS = 5
"""Blocks below which nothing is resampled."""

RESAMPLES = 1000


@dataclass(frozen=True)
class Race:
    """How candidates are compared: by what, at which level of the tests, and how many
    blocks make a candidate complete.
    """

    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    level: float
    complete: int

    def dropped(
        self, earlier: Sequence[Samples], running: Sequence[Samples]
    ) -> list[bool]:
        """Which of the `running` candidates get no more blocks.

        All of them have equally many; `earlier` are the candidates of the batches
        before. None of the samples may be empty or NaN.
        """
        everyone = [*earlier, *running]
        out = [
            any(
                _violates(samples, constraint, self.level)
                for constraint in self.constraints
            )
            for samples in running
        ]
        leaders = self.leaders(everyone)
        if not leaders and running and len(self.objectives) == 1:
            leaders = self._front(
                [
                    rival
                    for rival in everyone
                    if self._blocks(rival) == self._blocks(running[0])
                ]
            )
        for leader in leaders:
            for place, samples in enumerate(running):
                out[place] |= samples is not leader and all(
                    _lost(samples, leader, objective, self.level)
                    for objective in self.objectives
                )
        return out

    def leaders(self, everyone: Sequence[Samples]) -> list[Samples]:
        """The best of the complete candidates within the constraints: one, or for
        several objectives their front.
        """
        return self._front(
            [samples for samples in everyone if self._blocks(samples) >= self.complete]
        )

    def _blocks(self, samples: Samples) -> int:
        return len(samples[self.objectives[0].column])

    def _feasible(self, samples: Samples) -> bool:
        return all(
            constraint.violation(samples[constraint.column]) <= 0
            for constraint in self.constraints
        )

    def _values(self, samples: Samples) -> list[float]:
        """The objectives' values, the smaller the better."""
        values = [
            (objective.value(samples[objective.column]), objective.maximize)
            for objective in self.objectives
        ]
        return [-value if maximize else value for value, maximize in values]

    def _front(self, everyone: Sequence[Samples]) -> list[Samples]:
        """Those within the constraints that no other dominates; for one objective the
        best.
        """
        rivals = [samples for samples in everyone if self._feasible(samples)]
        if len(self.objectives) == 1:
            return [min(rivals, key=self._values)] if rivals else []
        values = np.array([self._values(samples) for samples in rivals]).reshape(
            -1, len(self.objectives)
        )
        beaten = [
            bool(((values <= own).all(axis=1) & (values < own).any(axis=1)).any())
            for own in values
        ]
        return [
            samples for samples, lost in zip(rivals, beaten, strict=True) if not lost
        ]


def _lost(
    samples: Samples, leader: Samples, objective: Objective, level: float
) -> bool:
    """Whether a candidate is worse than the leader in an objective, at this level."""
    values = samples[objective.column]
    best = leader[objective.column]
    shared = min(len(values), len(best))
    values = values[:shared]
    best = best[:shared]
    if objective.statistic.about.averages:
        gains = values.mean(axis=1) - best.mean(axis=1)
        return _below_zero(gains if objective.maximize else -gains, level)
    if shared < LEAST_BLOCKS:
        return False
    own, theirs = (_resampled(side, objective) for side in (values, best))
    as_good = own >= theirs if objective.maximize else own <= theirs
    return bool(as_good.mean() < level)


def _violates(samples: Samples, constraint: Constraint, level: float) -> bool:
    """Whether a candidate violates a constraint: surely for a statistic that more
    trials can only make worse, else at this level.
    """
    values = samples[constraint.column]
    statistic = constraint.statistic
    if statistic.about.extreme:
        return constraint.violation(values) > 0
    if statistic.about.averages:
        slack = constraint.bound - values.mean(axis=1)
        return _below_zero(slack if constraint.at_most else -slack, level)
    if len(values) < LEAST_BLOCKS:
        return False
    estimates = _resampled(
        values, Objective(constraint.column, not constraint.at_most, statistic)
    )
    within = (
        estimates <= constraint.bound
        if constraint.at_most
        else estimates >= constraint.bound
    )
    return bool(within.mean() < level)


def _below_zero(sample: Floats, level: float) -> bool:
    """Whether the mean of a sample (blocks,) is below zero, by Student's one-sided
    test; never for one block, which has no deviation.

    Blocks that are all equal have none either, as those of a rare event: they are
    tested by their signs.
    """
    from scipy.special import stdtrit

    count = len(sample)
    mean = sample.mean()
    if count < 2 or mean >= 0.0:
        return False
    if np.ptp(sample) <= SAME * np.abs(mean):
        return bool(0.5**count < level)
    error = sample.std(ddof=1) / np.sqrt(count)
    return bool(mean < stdtrit(count - 1, level) * error)


def _resampled(values: Floats, objective: Objective) -> Floats:
    """The statistic of `values` (blocks, scenarios) in each resample of the blocks,
    shape (RESAMPLES,).
    """
    drawn = values[_resampled_blocks(len(values))].reshape(RESAMPLES, -1)
    return objective.statistic.along(drawn, maximize=objective.maximize)


@lru_cache
def _resampled_blocks(count: int) -> NDArray[np.int64]:
    """The blocks of each resample, shape (RESAMPLES, count): the same for all
    candidates and in every process.
    """
    return np.random.default_rng(0).integers(count, size=(RESAMPLES, count))
