"""Sobol indices from a given random sample, by a polynomial surrogate.

The draws of a study are a random sample. Estimators of total indices need points in
pairs, and the sample has none. So a surrogate is fitted: a polynomial chaos expansion
(Sudret 2008, Reliab. Eng. Syst. Saf. 93, 964-979). Its terms are products of orthogonal
functions, so the squared coefficients are the parts of the variance.

- A parameter with numbers enters by its rank. A monotone change of a parameter changes
  no index, so Legendre polynomials of ranks suit every distribution.
- A parameter with few values enters by contrasts between these values,
  orthonormal for the frequencies in the sample.
- The degree is the one with the smallest error for draws that the fit leaves out.
- The jackknife over draws removes the bias of squared coefficients. An index is a ratio
  of two jackknife estimates, with the interval of a ratio estimator (Cochran 1977,
  Sampling Techniques, section 6.4).

The error for left-out draws is part of the result: the surrogate knows nothing about
the part of the variance that it does not predict.
"""

from functools import partial
from itertools import product
from math import prod
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

Floats = NDArray[np.float64]

FEWEST_DRAWS = 30
"""Least number of draws for indices."""
FEW_DRAWS = f"indices need at least {FEWEST_DRAWS} realities with a score"
CONSTANT = "the score is equal in all realities"
FEW_FOR_TERMS = "too few realities for the number of imperfections"
CONFOUNDED = "imperfections change together in the drawn realities"
WITHIN_NOISE = "the variance over realities is within replicate noise"
UNCERTAIN = "the confidence interval of the variance over realities includes 0"

FEW_VALUES = 5
"""Number of distinct values up to which a parameter enters by contrasts."""
DRAWS_PER_TERM = 3
"""Least number of draws per term of the polynomial."""
MOST_DEGREE = 10
MOST_TERMS = 300
ROUNDING = 1e-12
"""Fraction of the size of a metric, below which a variation is a rounding error."""


class SobolIndices(NamedTuple):
    """Indices of each parameter, and the quality of the surrogate.

    Attributes
    ----------
    table : DataFrame
        One row per parameter, with the columns `parameter`, first, first_low,
        first_high, total, total_low and total_high. NaN if unknown.
    degree : int
        Degree of the polynomial; 0 without a fit.
    predicted : float
        Fraction of the variance that the surrogate predicts at draws that the fit
        leaves out; NaN without a fit.
    without_noise: bool
        True if the variance of errors is known and taken out. Else the noise counts in
        the variance, and makes indices smaller.
    reason : str
        Reason why the indices are unknown; "" if they are known.
    """

    table: pd.DataFrame
    degree: int
    predicted: float
    without_noise: bool
    reason: str = ""


class _Fit(NamedTuple):
    """A least-squares fit, and the coefficients without each draw, (terms, N)."""

    degree: int
    terms: NDArray[np.bool_]
    coefficients: Floats
    without: Floats
    error: float


def sobol_indices(
    parameters: pd.DataFrame,
    values: Floats,
    noise: Floats | None = None,
    confidence: float = 0.95,
) -> SobolIndices:
    """Return first-order and total indices of a random sample.

    Parameters
    ----------
    parameters : DataFrame
        Independent draws, one row for each of N draws.
    values : array
        A value per draw, (N,), without NaN.
    noise : array, optional
        Variance of the error of each value, (N,). The variance of the values is reduced
        by its mean. By default the variance of errors is unknown, and remains.
    confidence : float, default 0.95

    Returns
    -------
    SobolIndices
        Indices are fractions of the variance without noise. Intervals are Student's, of
        the jackknife, and cut off at 0 and 1. All are NaN if the draws are too few, if
        the values are equal, if parameters change together, or if the interval of the
        variance without noise includes 0. Then `reason` names the case.
    """
    names = [str(name) for name in parameters]
    n = len(values)
    spread = float(np.ptp(values)) if n else 0.0
    variances = noise if noise is not None else np.zeros(n)
    unknown = partial(_unknown, names, without_noise=noise is not None)
    if n < FEWEST_DRAWS:
        return unknown(FEW_DRAWS)
    if spread <= ROUNDING * float(np.abs(values).max(initial=0.0)):
        return unknown(CONSTANT)
    centred = (values - values.mean()) / spread
    variance = _variances(centred, variances / spread**2)
    fit = _best_fit(parameters, centred)
    if isinstance(fit, str):
        return unknown(fit)
    if _bounded(variance, confidence)[1] <= 0.0:
        return unknown(UNCERTAIN if noise is None else WITHIN_NOISE)
    rows = []
    alone = fit.terms.sum(axis=1) == 1
    for place, name in enumerate(names):
        row: dict[str, object] = {"parameter": name}
        parts = {"first": fit.terms[:, place] & alone, "total": fit.terms[:, place]}
        for index, chosen in parts.items():
            squares = float((fit.coefficients[chosen] ** 2).sum())
            without = (fit.without[chosen] ** 2).sum(axis=0)
            part = n * squares - (n - 1) * without
            value, low, high = _cut_ratio(part, variance, confidence)
            row |= {index: value, f"{index}_low": low, f"{index}_high": high}
        rows.append(row)
    mean_square = float(centred @ centred) / n
    predicted = max(0.0, 1.0 - fit.error / mean_square)
    return SobolIndices(
        pd.DataFrame(rows), fit.degree, predicted, without_noise=noise is not None
    )


def _unknown(names: list[str], reason: str, *, without_noise: bool) -> SobolIndices:
    columns = ("first", "first_low", "first_high", "total", "total_low", "total_high")
    rows = [{"parameter": name} | dict.fromkeys(columns, np.nan) for name in names]
    table = pd.DataFrame(rows)
    return SobolIndices(table, 0, np.nan, without_noise=without_noise, reason=reason)


def _variances(values: Floats, noise: Floats) -> Floats:
    """Return the pseudo-values of the variance without noise, (N,)."""
    n = len(values)
    squares = (values - values.mean()) ** 2
    without = (squares.sum() - squares * n / (n - 1)) / (n - 2)
    jackknifed: Floats = n * squares.sum() / (n - 1) - (n - 1) * without
    return jackknifed - noise


def _best_fit(parameters: pd.DataFrame, values: Floats) -> _Fit | str:
    """Return the fit with the smallest error for left-out draws.

    Without a fit of degree 1, return the reason.
    """
    fits = list[_Fit]()
    reason = FEW_FOR_TERMS
    for degree in range(1, MOST_DEGREE + 1):
        sides = [_functions(parameters[name], degree) for name in parameters]
        orders = _orders([[order for order, _ in side] for side in sides], degree)
        if len(orders) > min(MOST_TERMS, len(values) // DRAWS_PER_TERM):
            break
        matrix = np.stack(
            [
                prod(
                    (side[place][1] for side, place in zip(sides, term, strict=True)),
                    start=np.ones(len(values)),
                )
                for term in orders
            ],
            axis=1,
        )
        terms = np.array(orders) > 0
        if np.linalg.matrix_rank(matrix) < len(orders):
            reason = CONFOUNDED
            break
        fits.append(_least_squares(matrix, values, terms=terms, degree=degree))
    return min(fits, key=lambda fit: fit.error) if fits else reason


def _functions(column: "pd.Series[float]", degree: int) -> list[tuple[int, Floats]]:
    """Return orthonormal functions of a parameter, each with its degree.

    The first function is the constant. Contrasts between few values have degree 1.
    """
    codes, distinct = pd.factorize(column)
    n = len(column)
    if len(distinct) <= FEW_VALUES or not pd.api.types.is_numeric_dtype(column):
        levels = len(distinct)
        # Orthonormal for the observed frequencies; the first column is constant.
        roots = np.sqrt(np.bincount(codes) / n)[:, None]
        start = np.c_[np.ones(levels), np.eye(levels)[:, :-1]]
        contrasts = (np.linalg.qr(roots * start)[0] / roots)[codes, 1:]
        return [(0, np.ones(n)), *((1, contrast) for contrast in contrasts.T)]
    ranks = (column.rank().to_numpy(np.float64) - 0.5) / n
    powers = np.polynomial.legendre.legvander(2.0 * ranks - 1.0, degree)
    return [(k, np.sqrt(2.0 * k + 1.0) * powers[:, k]) for k in range(degree + 1)]


def _orders(degrees: list[list[int]], most: int) -> list[tuple[int, ...]]:
    """Return the terms of at most a total degree.

    A term has the index of a function of each parameter.
    """
    terms: list[tuple[tuple[int, ...], int]] = [((), 0)]
    for side in degrees:
        terms = [
            ((*term, place), total + degree)
            for (term, total), (place, degree) in product(terms, enumerate(side))
            if total + degree <= most
        ]
    return [term for term, _ in terms]


def _least_squares(
    matrix: Floats, values: Floats, *, terms: NDArray[np.bool_], degree: int
) -> _Fit:
    """Return the fit of all draws, and the fits without each draw."""
    q, r = np.linalg.qr(matrix)
    inverse = np.linalg.solve(r, q.T)
    coefficients = inverse @ values
    leverage = np.minimum((q * q).sum(axis=1), 1.0 - ROUNDING)
    left_out = (values - matrix @ coefficients) / (1.0 - leverage)
    without = coefficients[:, None] - inverse * left_out
    return _Fit(
        degree=degree,
        terms=terms,
        coefficients=coefficients,
        without=without,
        error=float((left_out**2).mean()),
    )


def _bounded(values: Floats, confidence: float) -> tuple[float, float, float]:
    """Return the mean of values (N,), and Student's interval."""
    from scipy.stats import t

    n = len(values)
    mean = float(values.mean())
    error = float(values.std(ddof=1)) / np.sqrt(n)
    half = float(t.ppf(0.5 + confidence / 2, n - 1)) * error
    return mean, mean - half, mean + half


def _cut_ratio(
    part: Floats, variance: Floats, confidence: float
) -> tuple[float, float, float]:
    """Return the ratio of two means with an interval, cut off at 0 and 1."""
    ratio = part.mean() / variance.mean()
    errors = (part - ratio * variance) / variance.mean()
    _, low, high = _bounded(errors, confidence)
    value, low, high = np.clip([ratio, ratio + low, ratio + high], 0.0, 1.0)
    return float(value), float(low), float(high)
