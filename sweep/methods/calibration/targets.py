"""The data sets of a calibration: the data, and synthetic data sets that check it.

All data sets share the draws from the prior. Each has proposals of its own. The number
0 is the data, and the numbers from 1 are synthetic.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sweep.methods.calibration.distances import Distance
from sweep.methods.calibration.proposals import Allowed, Kernel, Population
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
    distance : Distance
    rule : Calibration
    population : Population
    stuck : bool
        True if the spec allows hardly any proposal.
    """

    number: int
    data: Floats
    distance: Distance
    rule: Calibration
    population: Population = field(init=False)
    stuck: bool = False

    def __post_init__(self) -> None:
        """Begin without simulations."""
        self.population = Population(self.rule.population)

    @property
    def ended(self) -> bool:
        """True if no generation follows."""
        population = self.population
        later = len(population.generations) - 1
        if self.stuck or len(population.kept) < FEWEST:
            return True
        if later >= self.rule.generations:
            return True
        accepted = population.generations[-1].accepted
        return later > 0 and accepted < self.rule.acceptance

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
    def kernel(self) -> Kernel:
        """The kernel of the next generation."""
        return self.population.kernel()

    def add(self, draws: Floats, summaries: Floats, allowed: float = 1.0) -> None:
        """Add a generation; the first are the draws from the prior.

        Parameters
        ----------
        draws : array of float, shape (n, D)
            Draws in the unit cube.
        summaries : array of float, shape (n, S)
            Summaries of their simulations.
        allowed : float, default 1
            Fraction of the mass of the kernel that the spec allows.
        """
        kernel = self.kernel if self.population.generations else None
        distances = self.distance.between(summaries, self.data)
        self.population.add(draws, distances, kernel, allowed)


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

    def truths(self, allowed: Allowed) -> list[Floats]:
        """Return a draw per synthetic data set, each of shape (1, D).

        Parameters
        ----------
        allowed : callable
            Returns which draws the spec allows.
        """
        drawn = list[Floats]()
        for number in range(1, self.rule.checks + 1):
            rng = random_numbers(self.seed, number, PRIOR)
            draw = rng.random((1, len(self.names)))
            while not allowed(draw).all():
                draw = rng.random((1, len(self.names)))
            drawn.append(draw)
        return drawn

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


def targets_of(
    rule: Calibration,
    data: Floats,
    prior: Floats,
    summaries: Floats,
    synthetic: Sequence[Floats],
) -> list[Target]:
    """Return the data and the synthetic data sets, with the draws from the prior.

    A synthetic data set that lacks a summary is left out.

    Parameters
    ----------
    rule : Calibration
    data : array of float, shape (S,)
        Summaries of the data.
    prior : array of float, shape (n, D)
        Draws from the prior.
    summaries : array of float, shape (n, S)
        Summaries of their simulations.
    synthetic : sequence of array of float, shape (S,)
        Summaries of the synthetic data sets.
    """
    distance = Distance.of_prior(prior, summaries, learnt=rule.learnt)
    targets = [
        Target(number, each, distance, rule)
        for number, each in enumerate([data, *synthetic])
        if np.isfinite(each).all()
    ]
    for target in targets:
        target.add(prior, summaries)
    return targets
