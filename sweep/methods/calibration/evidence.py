"""How much data speak for each of several models: evidence, odds, and their errors.

The evidence of a model is the probability that a simulation, with parameters from the
prior, is within the tolerance of the data. The ratio of two such probabilities is the
Bayes factor of the summaries (Grelaud et al. 2009).
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
LEVEL = 0.95
NORMAL = 1.959963984540054
"""Quantile of the normal distribution at the upper end of a 95 % interval."""
FEW = 10
"""Effective number of simulations below which an interval is binomial."""
NEAR = 0.01
"""Fraction of the simulations of the priors that are near a synthetic data set."""
FEWEST_NEAR = 20
ROUNDING = 1e-9
"""Relative difference of probabilities that may be rounding."""
MOST_DATA_SETS = 200
"""Most synthetic data sets of a model that test whether models are told apart."""


class BoundedEstimate(NamedTuple):
    """An estimate with the ends of its 95 % confidence interval, none below 0."""

    value: float
    low: float
    high: float


class Evidence(NamedTuple):
    """Probability that a simulation is within the tolerance of the data.

    Attributes
    ----------
    probability : BoundedEstimate
    near : int
        Number of simulations within the tolerance.
    effective : float
        Number of independent simulations that those within the tolerance are worth.
    """

    probability: BoundedEstimate
    near: int
    effective: float


def evidence(weights: Floats, near: NDArray[np.bool_], of_prior: int) -> Evidence:
    """Return the evidence of a model.

    With few simulations within the tolerance, or few outside, the interval is the
    binomial one of the draws from the prior (Clopper and Pearson), which needs no
    normal approximation.

    Parameters
    ----------
    weights : array of float, shape (N,)
        Density of the prior over the density of all generations together.
    near : array of bool, shape (N,)
        Which simulations are within the tolerance.
    of_prior : int
        Number of draws from the prior, which come first.
    """
    counted = np.where(near, weights, 0.0)
    value = min(1.0, float(counted.mean()))
    squares = float((counted**2).sum())
    effective = float(counted.sum()) ** 2 / squares if squares else 0.0
    outside = len(near) - int(near.sum())
    if effective < FEW or outside < FEW:
        from scipy.stats import binomtest

        hits = int(near[:of_prior].sum())
        ends = binomtest(hits, of_prior).proportion_ci(LEVEL, method="exact")
        low = min(float(ends.low), value)
        high = max(float(ends.high), value)
    else:
        error = float(counted.std(ddof=1)) / math.sqrt(len(counted)) / value
        low = value * math.exp(-NORMAL * error)
        high = min(1.0, value * math.exp(NORMAL * error))
    return Evidence(BoundedEstimate(value, low, high), int(near.sum()), effective)


def ratio(above: BoundedEstimate, below: BoundedEstimate) -> BoundedEstimate:
    """Return the ratio of two independent estimates.

    The ends are those of the difference of logarithms, from the intervals of both
    (Zou and Donner 2008).

    Parameters
    ----------
    above, below : BoundedEstimate
        `below` has a value above 0.
    """
    if above.value == 0.0:
        return BoundedEstimate(
            0.0, 0.0, above.high / below.low if below.low else math.inf
        )
    value = above.value / below.value
    down = math.hypot(_log(above.value, above.low), _log(below.high, below.value))
    up = math.hypot(_log(above.high, above.value), _log(below.value, below.low))
    high = value * math.exp(up) if up < math.inf else math.inf
    return BoundedEstimate(value, value * math.exp(-down), high)


def _log(larger: float, smaller: float) -> float:
    return math.log(larger / smaller) if smaller else math.inf


def total(estimates: Sequence[BoundedEstimate]) -> BoundedEstimate:
    """Return the sum of independent estimates, with its interval (Zou and Donner 2008).

    Parameters
    ----------
    estimates : sequence of BoundedEstimate
    """
    value = math.fsum(each.value for each in estimates)
    down = math.hypot(*(each.value - each.low for each in estimates))
    up = math.hypot(*(each.high - each.value for each in estimates))
    return BoundedEstimate(value, max(0.0, value - down), value + up)


def probabilities(estimates: Sequence[BoundedEstimate]) -> list[BoundedEstimate]:
    """Return the posterior probability of each model, if all are as likely before.

    Parameters
    ----------
    estimates : sequence of BoundedEstimate
        Evidence of each model. One at least has a value above 0.
    """
    shares = list[BoundedEstimate]()
    for number, own in enumerate(estimates):
        against = total([*estimates[:number], *estimates[number + 1 :]])
        if against.value:
            odds = ratio(own, against)
            shares.append(BoundedEstimate(*(_share(each) for each in odds)))
        else:
            low = ratio(against, own).high
            shares.append(BoundedEstimate(1.0, 1.0 / (1.0 + low), 1.0))
    return shares


def _share(odds: float) -> float:
    return odds / (1.0 + odds) if odds < math.inf else 1.0


class PriorSimulations(NamedTuple):
    """Simulations of the prior of a model.

    Attributes
    ----------
    features : array of float, shape (n, S)
        Scaled summaries.
    draws : mapping
        Draws in the unit cube of each parameter, by its name, shape (n,) each.
    """

    features: Floats
    draws: Mapping[str, Floats]


def told_apart(priors: Sequence[PriorSimulations]) -> list[tuple[float, Floats]]:
    """Return how well summaries tell models apart, for data sets of each model.

    Simulations of the priors serve as data in turn. The nearest of all other
    simulations are counted by model (cross-validation, Csillery et al. 2012). Studies
    with equal seeds share draws. So simulations that share a draw with the data set do
    not count, in any model.

    Parameters
    ----------
    priors : sequence of PriorSimulations

    Returns
    -------
    list of (float, array of float)
        For data sets of each model: the fraction for which the model is the most
        probable, and the mean posterior probability of each model.
    """
    of_model = np.repeat(
        np.arange(len(priors)), [len(each.features) for each in priors]
    )
    pooled = np.concatenate([each.features for each in priors])
    near = max(FEWEST_NEAR, round(NEAR * len(pooled)))
    rows = list[tuple[float, Floats]]()
    for number, each in enumerate(priors):
        shares = list[Floats]()
        for place, data in enumerate(each.features[:MOST_DATA_SETS]):
            apart = ~_sharing(priors, each, place)
            away = np.where(apart, ((pooled - data) ** 2).sum(axis=1), np.inf)
            # All as near as the last count: a choice among ties favours one model.
            within = apart & (away <= np.partition(away, near - 1)[near - 1])
            counts = np.bincount(of_model[within], minlength=len(priors))
            fractions = counts / np.bincount(of_model[apart], minlength=len(priors))
            shares.append(fractions / fractions.sum())
        table = np.stack(shares)
        # Half a data set for two models that are equally probable.
        best = table >= table.max(axis=1, keepdims=True) * (1.0 - ROUNDING)
        right = float((best[:, number] / best.sum(axis=1)).mean())
        rows.append((right, table.mean(axis=0)))
    return rows


def _sharing(
    priors: Sequence[PriorSimulations], source: PriorSimulations, place: int
) -> NDArray[np.bool_]:
    """Return which simulations of all models share a draw with one simulation."""
    shared = list[NDArray[np.bool_]]()
    for each in priors:
        common = np.zeros(len(each.features), np.bool_)
        for name in each.draws.keys() & source.draws.keys():
            common |= each.draws[name] == source.draws[name][place]
        if each is source:
            common[place] = True
        shared.append(common)
    return np.concatenate(shared)
