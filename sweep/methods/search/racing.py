"""Races: candidates that are clearly worse than the best candidate get no more trials.

Candidates are compared block by block, on common random numbers. A mean is tested by
Student's one-sided test of the paired differences of the candidate, from two blocks on.
So the noise of other candidates does not matter. Other statistics are tested by
resampling blocks. After each rung every candidate left is tested once, at `level`. The
measured cost is in docs/decisions/races-drop-clearly-worse-candidates.md.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sweep.methods.search.objectives import Constraint, Floats, Objective

Samples = Mapping[str, Floats]
"""Values of a candidate in its blocks so far, by column; shape (blocks, scenarios)."""

SAME = 1e-12
"""Relative variation below which differences are equal."""

LEAST_BLOCKS = 5
"""Number of blocks below which nothing is resampled."""

RESAMPLES = 1000


@dataclass(frozen=True)
class Race:
    """The comparison of candidates in a race.

    Attributes
    ----------
    objectives : tuple of Objective
        Objectives to compare by.
    constraints : tuple of Constraint
        Constraints that candidates must not violate.
    level : float
        Level of the tests.
    complete : int
        Number of blocks of a complete candidate.
    """

    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    level: float
    complete: int

    def dropped(
        self, earlier: Sequence[Samples], running: Sequence[Samples]
    ) -> list[bool]:
        """Return which of the running candidates get no more blocks.

        No sample may be empty or NaN.

        Parameters
        ----------
        earlier : sequence of Samples
            Candidates of the batches before.
        running : sequence of Samples
            Candidates that are left, with equal numbers of blocks.

        Returns
        -------
        list of bool
            True for each candidate of `running` that is dropped.
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
        """Return the best of the complete candidates within the constraints.

        The result is a single candidate, or for several objectives the front.
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
        """Return the values of the objectives; smaller values are better."""
        values = [
            (objective.value(samples[objective.column]), objective.maximize)
            for objective in self.objectives
        ]
        return [-value if maximize else value for value, maximize in values]

    def _front(self, everyone: Sequence[Samples]) -> list[Samples]:
        """Return the candidates within the constraints that no candidate dominates.

        For a single objective the result is the best candidate.
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
    """Return whether a candidate is worse than the leader in an objective."""
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
    """Return whether a candidate violates a constraint, at this level.

    The violation is certain for a statistic that further trials can only make worse.
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
    """Return whether the mean of a sample (blocks,) is below zero, at this level.

    The test is Student's one-sided test. A single block has no standard deviation, and
    so is never below zero. Equal blocks have no standard deviation either, such as
    blocks of a rare event. A sign test then applies.
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
    """Return the statistic of `values` in each resample of blocks, shape (RESAMPLES,).

    `values` has the shape (blocks, scenarios).
    """
    drawn = values[_resampled_blocks(len(values))].reshape(RESAMPLES, -1)
    return objective.statistic.along(drawn, maximize=objective.maximize)


@lru_cache
def _resampled_blocks(count: int) -> NDArray[np.int64]:
    """Return the blocks of each resample, shape (RESAMPLES, count).

    The blocks are identical for all candidates and in every process.
    """
    return np.random.default_rng(0).integers(count, size=(RESAMPLES, count))
