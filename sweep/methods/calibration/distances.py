"""Distances between data sets, from the draws of the prior."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
MAD_OF_NORMAL = 1.482602218505602
"""Standard deviation of a normal distribution over its median absolute deviation."""

ROUNDING = 1e-9
"""Spread as a fraction of the median, below which differences may be rounding."""


def spread_of(values: Floats) -> Floats:
    """Return the robust spread of each column, above 0.

    The spread is the scaled median absolute deviation. If half of the values agree,
    apart from rounding, the spread is the standard deviation. If all agree, it is 1.

    Parameters
    ----------
    values : array of float, shape (n, S)
        Rows without NaN.

    Returns
    -------
    array of float, shape (S,)
    """
    if not len(values):
        return np.ones(values.shape[1])
    middle = np.median(values, axis=0)
    spread = MAD_OF_NORMAL * np.median(np.abs(values - middle), axis=0)
    deviation = values.std(axis=0)
    rounding = ROUNDING * np.maximum(np.abs(middle), deviation)
    spread = np.where(spread > rounding, spread, deviation)
    positive: Floats = np.where(spread > rounding, spread, 1.0)
    return positive


@dataclass(frozen=True, eq=False)
class Distance:
    """Distance of summaries, scaled by their spread over the draws from the prior.

    Attributes
    ----------
    middle, spread : array of float, shape (S,)
        Median and spread of each summary.
    coefficients : array of float, shape (1 + 2 S, D), optional
        Linear regression of the D parameters on the scaled summaries and their squares.
        None if the summaries count as they are.
    """

    middle: Floats
    spread: Floats
    coefficients: Floats | None = None

    @classmethod
    def of_prior(cls, draws: Floats, summaries: Floats, *, learnt: bool) -> "Distance":
        """Return the distance that follows from simulations of the prior.

        Parameters
        ----------
        draws : array of float, shape (n, D)
            Draws in the unit cube.
        summaries : array of float, shape (n, S)
        learnt : bool
            Whether the summaries become estimates of the parameters by regression
            (Fearnhead and Prangle 2012).
        """
        complete = np.isfinite(summaries).all(axis=1)
        finite = summaries[complete]
        middle = np.median(finite, axis=0) if len(finite) else np.zeros(finite.shape[1])
        scaled = cls(middle, spread_of(finite))
        if not learnt:
            return scaled
        terms = scaled._terms(finite)
        solution = np.linalg.lstsq(terms, draws[complete], rcond=None)
        coefficients = np.asarray(solution[0], np.float64)
        return cls(scaled.middle, scaled.spread, coefficients)

    def _terms(self, summaries: Floats) -> Floats:
        scaled = self.scaled(summaries)
        return np.concatenate([np.ones((len(scaled), 1)), scaled, scaled**2], axis=1)

    def scaled(self, summaries: Floats) -> Floats:
        """Return summaries in units of their spread, shape (n, S)."""
        scaled: Floats = (summaries - self.middle) / self.spread
        return scaled

    def features(self, summaries: Floats) -> Floats:
        """Return the numbers whose differences count, shape (n, F).

        The numbers are the scaled summaries, or estimates of the parameters.
        """
        if self.coefficients is None:
            return self.scaled(summaries)
        estimates: Floats = np.einsum(
            "nt,td->nd", self._terms(summaries), self.coefficients
        )
        return estimates

    def between(self, summaries: Floats, data: Floats) -> Floats:
        """Return the distances of simulations from a data set, shape (n,).

        A distance is the root of the mean squared difference; infinite for a simulation
        without a summary.

        Parameters
        ----------
        summaries : array of float, shape (n, S)
        data : array of float, shape (S,)
        """
        away = self.features(summaries) - self.features(data[None])
        distances = np.sqrt((away**2).mean(axis=1))
        finite: Floats = np.where(np.isfinite(distances), distances, np.inf)
        return finite
