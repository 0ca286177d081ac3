"""Simulations of one data set, and the proposals of the next generation.

The rule is sequential Monte Carlo for approximate Bayesian computation, in synchronous
generations (Lenormand, Jabot and Deffuant 2013). A simulation is a draw of the
parameters and the distance of its summaries from the data. The nearest simulations are
kept. The next generation comes from a Gaussian kernel around the kept draws, with twice
their weighted covariance (Beaumont et al. 2009).

Draws are in the unit cube, where the prior is uniform: the value of a parameter is the
quantile of its prior. So one kernel serves all distributions, lists of values included.

A weight is the density of the prior over the density of all generations together, which
includes the prior itself (deterministic mixture weights, Owen and Zhou 2000; Cornuet et
al. 2012). So all simulations count, and the draws from the prior bound each weight.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Allowed = Callable[[Floats], NDArray[np.bool_]]
"""Function of draws, shape (n, D), that returns which draws the spec allows, (n,)."""

WIDENING = 2.0
"""Covariance of the kernel as a multiple of the weighted covariance."""
LEAST_VARIANCE = 1e-12
"""Added to each variance, so that equal draws have a kernel too."""
FACTOR = 4
"""Number of candidates per requested draw, at a time."""
MOST_ROUNDS = 1000
MOST_CELLS = 1_000_000
"""Most pairs of a draw and a centre at a time."""


class ProposalKernel(NamedTuple):
    """A mixture of Gaussians around kept draws, cut to the allowed part of the cube.

    Attributes
    ----------
    centers : array of float, shape (K, D)
        Kept draws.
    weights : array of float, shape (K,)
        Weights of the kept draws, with the sum 1.
    root : array of float, shape (D, D)
        Lower triangular root of the covariance.
    """

    centers: Floats
    weights: Floats
    root: Floats

    def draw(
        self, count: int, rng: Generator, allowed: Allowed
    ) -> tuple[Floats, float]:
        """Return draws, and the fraction of candidates that were allowed.

        Parameters
        ----------
        count : int
            Number of draws.
        rng : Generator
        allowed : callable
            Returns which candidates within the cube the spec allows.

        Returns
        -------
        draws : array of float, shape (count, D)
        allowed : float
            Fraction of the mass of the mixture that is allowed.

        Raises
        ------
        ValueError
            If too few candidates are allowed.
        """
        accepted = list[Floats]()
        enough = 0
        tried = 0
        bounds = np.cumsum(self.weights)
        for _ in range(MOST_ROUNDS):
            size = FACTOR * count
            picks = np.searchsorted(bounds, rng.random(size) * bounds[-1], side="right")
            steps = rng.standard_normal((size, len(self.root)))
            moved = np.einsum("nj,ij->ni", steps, self.root)
            candidates = self.centers[picks] + moved
            inside = ((candidates >= 0.0) & (candidates < 1.0)).all(axis=1)
            candidates = candidates[inside]
            if len(candidates):
                candidates = candidates[allowed(candidates)]
            accepted.append(candidates)
            enough += len(candidates)
            tried += size
            if enough >= count:
                return np.concatenate(accepted)[:count], enough / tried
        raise ValueError("the kernel proposes hardly any draw that the spec allows")

    def density(self, draws: Floats) -> Floats:
        """Return the density of the mixture before the cut, shape (n,).

        Parameters
        ----------
        draws : array of float, shape (n, D)
        """
        rows = max(1, MOST_CELLS // len(self.centers))
        parts = [
            self._density(draws[first : first + rows])
            for first in range(0, len(draws), rows)
        ]
        return np.concatenate([np.empty(0), *parts])

    def _density(self, draws: Floats) -> Floats:
        squares = np.zeros((len(draws), len(self.centers)))
        whitened = np.zeros((len(self.root), *squares.shape))
        for row in range(len(self.root)):
            part = draws[:, row, None] - self.centers[None, :, row]
            for before in range(row):
                part = part - self.root[row, before] * whitened[before]
            whitened[row] = part / self.root[row, row]
            squares += whitened[row] ** 2
        volume = math.prod(self.root.diagonal().tolist())
        scale = volume * (2.0 * math.pi) ** (len(self.root) / 2.0)
        densities: Floats = (np.exp(-0.5 * squares) * self.weights).sum(axis=1) / scale
        return densities


class Generation(NamedTuple):
    """A generation of proposals, after its simulations.

    Attributes
    ----------
    size : int
        Number of simulations.
    kernel : ProposalKernel or None
        Kernel that proposed the draws; None for the prior.
    allowed : float
        Fraction of the mass of the kernel, or of the prior, that the spec allows.
    accepted : float
        Fraction of the simulations within the tolerance before this generation.
    tolerance : float
        Largest distance of a kept simulation after this generation.
    effective : float
        Effective number of kept draws after this generation.
    """

    size: int
    kernel: ProposalKernel | None
    allowed: float
    accepted: float
    tolerance: float
    effective: float


@dataclass(eq=False)
class Population:
    """Simulations of one data set, generation after generation.

    Attributes
    ----------
    size : int
        Number of simulations to keep.
    draws : array of float, shape (N, D)
        Draws of all simulations, in the unit cube.
    distances : array of float, shape (N,)
        Distances from the data; infinite for a simulation without summaries.
    generations : list of Generation
    nearest : array of int, shape (K,)
        Kept simulations, the nearest first: `size` simulations, and all as near as the
        last of these. A choice among equal distances by age would favour the prior.
    weights : array of float, shape (K,)
        Weights of the kept simulations, with the sum 1.
    """

    size: int
    draws: Floats = field(default_factory=lambda: np.empty((0, 0)))
    distances: Floats = field(default_factory=lambda: np.empty(0))
    generations: list[Generation] = field(default_factory=list)
    nearest: NDArray[np.intp] = field(default_factory=lambda: np.empty(0, np.intp))
    weights: Floats = field(default_factory=lambda: np.empty(0))

    @property
    def tolerance(self) -> float:
        """The largest distance of a kept simulation; infinite without simulations."""
        return (
            float(self.distances[self.nearest[-1]]) if len(self.nearest) else math.inf
        )

    @property
    def effective(self) -> float:
        """The effective number of kept draws (Kish)."""
        return float(1.0 / (self.weights**2).sum()) if len(self.weights) else 0.0

    def add(
        self,
        draws: Floats,
        distances: Floats,
        kernel: ProposalKernel | None = None,
        allowed: float = 1.0,
    ) -> None:
        """Add the simulations of a generation, and keep the nearest of all.

        Parameters
        ----------
        draws : array of float, shape (n, D)
        distances : array of float, shape (n,)
        kernel : ProposalKernel, optional
            Kernel that proposed the draws; by default the prior.
        allowed : float, default 1
            Fraction of the mass of the kernel, or of the prior, that the spec allows.
        """
        before = self.tolerance
        self.draws = np.concatenate([self.draws, draws]) if len(self.draws) else draws
        self.distances = np.concatenate([self.distances, distances])
        order = np.argsort(self.distances, kind="stable")
        finite = order[np.isfinite(self.distances[order])]
        last = self.distances[finite[: self.size][-1:]]
        self.nearest = finite[(self.distances[finite, None] <= last).any(axis=1)]
        accepted = float((distances <= before).mean())
        new = Generation(
            size=len(draws),
            kernel=kernel,
            allowed=allowed,
            accepted=accepted,
            tolerance=self.tolerance,
            effective=0.0,
        )
        self.generations.append(new)
        self.weights = self._weights()
        self.generations[-1] = new._replace(effective=self.effective)

    def _weights(self) -> Floats:
        weights = 1.0 / self.mixture(self.draws[self.nearest])
        normalised: Floats = weights / weights.sum()
        return normalised

    def mixture(self, draws: Floats) -> Floats:
        """Return the density of all generations together at some draws, shape (n,).

        Parameters
        ----------
        draws : array of float, shape (n, D)
            Allowed draws. Densities are over the allowed part of the cube.
        """
        density = np.zeros(len(draws))
        for generation in self.generations:
            scale = generation.size / generation.allowed
            kernel = generation.kernel
            density += scale * (1.0 if kernel is None else kernel.density(draws))
        mixed: Floats = density / sum(each.size for each in self.generations)
        return mixed

    def kernel(self) -> ProposalKernel:
        """Return the kernel of the next generation."""
        centers = self.draws[self.nearest]
        middle = (self.weights[:, None] * centers).sum(axis=0)
        away = centers - middle
        covariance = np.einsum("n,ni,nj->ij", self.weights, away, away)
        covariance = WIDENING * covariance + LEAST_VARIANCE * np.eye(len(middle))
        return ProposalKernel(centers, self.weights, np.linalg.cholesky(covariance))
