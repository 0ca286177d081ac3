"""The data sets of a calibration: the data, and synthetic data sets that check it.

Each data set has separate draws from the prior, and separate proposals. So the data
sets are independent. The number 0 is the data, and the numbers from 1 are synthetic.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sweep.methods.calibration.distances import Distance
from sweep.methods.calibration.proposals import Allowed, Population, ProposalKernel
from sweep.methods.calibration.rule import Calibration
from sweep.spec import (
    DISTRIBUTIONS,
    SAMPLERS,
    Setting,
    UnitCube,
    Values,
    generator,
)

Floats = NDArray[np.float64]
DATA = 0
PRIOR = 0
TRUTH = -1
"""Generation of the draw that made a synthetic data set."""
FEWEST = 2
"""Fewest kept simulations from which a kernel follows."""


@dataclass(eq=False)
class Target:
    """A data set with its simulations.

    Attributes
    ----------
    number : int
    data : array of float, shape (S,)
        Summaries of the data set.
    rule : Calibration
    distance : Distance
        Distance from the data, scaled by the draws from the prior.
    population : Population
    stuck : bool
        True if the spec allows hardly any proposal.
    """

    number: int
    data: Floats
    rule: Calibration
    distance: Distance = field(init=False)
    population: Population = field(init=False)
    stuck: bool = False

    def begin(self, draws: Floats, summaries: Floats) -> None:
        """Add the draws from the prior, which scale the distance.

        Parameters
        ----------
        draws : array of float, shape (n, D)
            Allowed draws in the unit cube.
        summaries : array of float, shape (n, S)
            Summaries of their simulations.
        """
        rule = self.rule
        self.distance = Distance.of_prior(draws, summaries, learnt=rule.learnt)
        self.population = Population(rule.population)
        distances = self.distance.between(summaries, self.data)
        self.population.add(draws, distances, allowed=len(draws) / rule.draws)

    @property
    def ended(self) -> bool:
        """True if no generation follows.

        A calibration ends after the most generations, after a generation with few
        accepted proposals, and where the tolerance no longer falls.
        """
        *before, last = self.population.generations
        if self.stuck or len(self.population.nearest) < FEWEST:
            return True
        if len(before) >= self.rule.generations or last.tolerance == 0.0:
            return True
        if not before:
            return False
        falls = last.tolerance < before[-1].tolerance
        return not falls or last.accepted < self.rule.acceptance

    def propose(self, seed: int, allowed: Allowed) -> tuple[Floats, float]:
        """Return the draws of the next generation, and their allowed fraction.

        Parameters
        ----------
        seed : int
            Seed of the study.
        allowed : callable
            Returns which draws the spec allows.

        Raises
        ------
        ValueError
            If the spec allows hardly any proposal.
        """
        rng = random_numbers(seed, self.number, len(self.population.generations))
        return self.kernel.draw(self.rule.population, rng, allowed)

    @property
    def kernel(self) -> ProposalKernel:
        """The kernel of the next generation."""
        return self.population.kernel()

    def add(self, draws: Floats, summaries: Floats, allowed: float) -> None:
        """Add a generation of proposals.

        Parameters
        ----------
        draws : array of float, shape (n, D)
            Draws in the unit cube.
        summaries : array of float, shape (n, S)
            Summaries of their simulations.
        allowed : float
            Fraction of the mass of the kernel that the spec allows.
        """
        distances = self.distance.between(summaries, self.data)
        self.population.add(draws, distances, self.kernel, allowed)


def random_numbers(seed: int, number: int, generation: int) -> np.random.Generator:
    """Return the random numbers of a generation of a data set.

    Parameters
    ----------
    seed : int
        Seed of the study.
    number : int
        Number of the data set.
    generation : int
    """
    return generator(seed, "calibrate", str(number), str(generation))


@dataclass(frozen=True)
class PriorDraws:
    """Draws from the prior, and the values of the parameters of draws.

    Attributes
    ----------
    rule : Calibration
    settings : mapping
        Parameters of the study by name.
    seed : int
        Seed of the study.
    """

    rule: Calibration
    settings: Mapping[str, Setting]
    seed: int

    @cached_property
    def names(self) -> list[str]:
        """The calibrated parameters."""
        return list(self.rule.priors)

    def first(self) -> Floats:
        """Return the draws of the axis of the prior, shape (n, D).

        The draws are equal to the points of the axis.
        """
        rule = self.rule
        unbounded = [
            name
            for name, prior in rule.priors.items()
            if not DISTRIBUTIONS[prior.form].bounded
        ]
        cube = UnitCube(
            rule.draws, self.names, rule.axis, self.seed, unbounded=unbounded
        )
        return np.stack(SAMPLERS[rule.sampler].draw(cube), axis=1)

    def of_check(self, number: int) -> Floats:
        """Return the true draw of a synthetic data set, then its draws from the prior.

        The first allowed draw is the true draw.

        Parameters
        ----------
        number : int
            Number of the data set, from 1.

        Returns
        -------
        array of float, shape (1 + n, D)
        """
        rng = random_numbers(self.seed, number, PRIOR)
        return rng.random((1 + self.rule.draws, len(self.names)))

    def values(self, draws: Floats) -> dict[str, Values]:
        """Return the values of the parameters of draws, shape (n,) each.

        Parameters
        ----------
        draws : array of float, shape (n, D)
        """
        columns = dict[str, Values]()
        for unit, (name, prior) in zip(draws.T, self.rule.priors.items(), strict=True):
            setting = self.settings[name]
            drawn = DISTRIBUTIONS[prior.form].values(unit, setting, prior.arguments)
            columns[name] = setting.column(drawn)
        return columns
