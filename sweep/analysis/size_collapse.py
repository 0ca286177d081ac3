"""Finite-size scaling: the exponents and the critical point of a collapse of curves.

Near a continuous transition, the order of a system of linear length L is m =
L^(-beta/nu) f((x - x_c) L^(1/nu)). The function f is equal for all sizes (Fisher and
Barber 1972, Phys. Rev. Lett. 28, 1516-1519). The quality S of a collapse needs no form
of f (Houdayer and Hartmann 2004, Phys. Rev. B 70, 014418, appendix). S is the mean
square distance of each point from the curve through neighbours of different sizes. Here
cubics replace the straight lines of Houdayer and Hartmann, because straight lines cut
off the bends of a curve between points. S is about 1 if the curves differ only by
statistical errors.
"""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.estimate import CONFIDENCE, student_quantile
from sweep.analysis.resampling import RESAMPLING_SEED
from sweep.analysis.size_curves import SizeCurve

Floats = NDArray[np.float64]

RESAMPLES = 200
OPEN = "the curves do not determine the critical point or 1/nu"
FEWEST_SIZES = 3
FEWEST_POINTS = 6
"""Fewest values of the control parameter per size."""
FIRST_PLACES = np.linspace(0.05, 0.95, 19)
"""Critical points of the coarse grid, as fractions of the range of x."""
FIRST_INVERSE_NU = np.array([0.25, 0.5, 0.75, 1.0, 1.5, 2.0])
FIRST_BETA_NU = np.array([0.0, 0.05, 0.125, 0.25, 0.5])
MOST_CALLS = 60
"""Most evaluations of the distances per least-squares fit."""
STARTS = 5
"""Number of points of the coarse grid from which a fit starts."""
PRECISION = 1e-4
"""Relative tolerance of a fit, and its relative step for derivatives."""
RIDGE = 1e-12
"""Ridge of the cubic fits, as a fraction of the trace of their normal matrix."""
LEAST_OVERLAP = 0.5
"""Least fraction of points that must have points of different sizes on either side."""
SIDES = (-2, -1, 0, 1)
"""Indices of points of a second size around a position, relative to the next point."""
POWERS = np.arange(4)
"""Powers of the cubic through the points of SIDES."""
APART = 1e3
"""Distance, in standard errors, of all points if too few points are comparable."""


class Scaled(NamedTuple):
    """Points of the curves of S sizes, as an array of P points per quantity.

    `lengths` are (S,): the linear length of each size. All other arrays are (P,):
    `size` is the index of the size, `x` the control parameter, `order` the mean order
    parameter and `error` the standard error of `order`. Points of a size are
    consecutive, ascending in `x`.
    """

    lengths: Floats
    size: NDArray[np.int64]
    x: Floats
    order: Floats
    error: Floats


class Collapse(NamedTuple):
    """The critical point `place`, the exponents 1/nu and beta/nu, and the quality S.

    `place`, `inverse_nu` and `beta_nu` each contain an estimate and the two bounds of
    the confidence interval. `compared` is the fraction of points with points of
    different sizes on either side. If the curves cannot be collapsed, all numbers are
    NaN, and `why` is the reason.
    """

    place: tuple[float, float, float]
    inverse_nu: tuple[float, float, float]
    beta_nu: tuple[float, float, float]
    quality: float
    compared: float
    why: str = ""


def collapse(
    curves: Sequence[SizeCurve],
    confidence: float = CONFIDENCE,
    resamples: int = RESAMPLES,
) -> Collapse:
    """Collapse the mean order parameter of several sizes onto one curve.

    The critical point x_c, 1/nu and beta/nu minimise S. The confidence intervals are
    Student's, with k - 1 degrees of freedom, where k is the smallest number of trials
    per point. The standard deviation comes from estimates of resampled trials. Each
    resample draws k - 1 of the k trials of a point with replacement, so that the
    variance has no bias (Rao and Wu 1988, J. Am. Stat. Assoc. 83, 231-241). The
    intervals do not include corrections to scaling: points far from the transition, and
    small systems, do not collapse. A large S indicates missing corrections.

    Parameters
    ----------
    curves : sequence of SizeCurve
        At least 3 sizes with 6 values of the control parameter each.
    confidence : float, default 0.95
        Confidence of each interval alone.
    resamples : int, default 200

    Returns
    -------
    Collapse
        With NaN and a reason if the curves cannot be collapsed.
    """
    if len(curves) < FEWEST_SIZES:
        return _none(f"fewer than {FEWEST_SIZES} sizes")
    if min(len(curve.x) for curve in curves) < FEWEST_POINTS:
        return _none(f"fewer than {FEWEST_POINTS} values of the control parameter")
    data = scaled(curves)
    if not (data.error > 0.0).all():
        return _none("all trials of a point have equal order")
    exponents = _improved(data, _first(data))
    distances = _distances(data, exponents)
    finite = np.isfinite(distances)
    rng = np.random.default_rng(RESAMPLING_SEED)
    again = np.array(
        [
            _improved(data._replace(order=_resampled(curves, rng)), exponents)
            for _ in range(resamples)
        ]
    )
    fewest = min(len(samples) for curve in curves for samples in curve.samples)
    half = student_quantile(0.5 + confidence / 2, fewest - 1) * again.std(axis=0)
    parts = [
        (float(value), float(value - width), float(value + width))
        for value, width in zip(exponents, half, strict=True)
    ]
    (_, low, high), (_, least, _), _ = parts
    if not (data.x.min() < low and high < data.x.max() and least > 0.0):
        return _none(OPEN)
    return Collapse(
        place=parts[0],
        inverse_nu=parts[1],
        beta_nu=parts[2],
        quality=float(np.mean(distances[finite] ** 2)),
        compared=float(finite.mean()),
    )


def _none(why: str) -> Collapse:
    nothing = (np.nan, np.nan, np.nan)
    return Collapse(
        place=nothing,
        inverse_nu=nothing,
        beta_nu=nothing,
        quality=np.nan,
        compared=np.nan,
        why=why,
    )


def scaled(curves: Sequence[SizeCurve]) -> Scaled:
    """Return the points of several sizes, joined into one array per quantity."""
    return Scaled(
        lengths=np.array([curve.length for curve in curves]),
        size=np.repeat(np.arange(len(curves)), [len(curve.x) for curve in curves]),
        x=np.concatenate([curve.x for curve in curves]),
        order=np.concatenate([curve.order.value for curve in curves]),
        error=np.concatenate([curve.order.error for curve in curves]),
    )


def _resampled(curves: Sequence[SizeCurve], rng: np.random.Generator) -> Floats:
    """Return the mean order at each point (P,), over k - 1 trials drawn from k."""
    means = []
    for curve in curves:
        for samples in curve.samples:
            values = samples.mean(axis=1)
            means.append(rng.choice(values, len(values) - 1).mean())
    return np.array(means)


def quality(curves: Sequence[SizeCurve], exponents: Floats) -> float:
    """Return S of Houdayer and Hartmann for x_c, 1/nu and beta/nu, (3,)."""
    distances = _distances(scaled(curves), np.asarray(exponents, np.float64))
    return float(np.nanmean(distances**2))


def _distances(data: Scaled, exponents: Floats) -> Floats:
    """Return the distance of each point from different sizes, in standard errors, (P,).

    The distance is to a cubic through two neighbours on either side from each different
    size, weighted by the errors. NaN if no different size has two points on either
    side.
    """
    place, inverse_nu, beta_nu = exponents
    # Lengths in units of the geometric mean make the exponents less dependent.
    lengths = (data.lengths / np.exp(np.log(data.lengths).mean()))[data.size]
    x = (data.x - place) * lengths**inverse_nu
    y = data.order * lengths**beta_nu
    error = data.error * lengths**beta_nu
    near, weights = _neighbours(data, x, 1.0 / error)
    enclosed = (weights > 0.0).sum(axis=1) >= len(SIDES)
    apart = np.where(weights > 0.0, x[near] - x[:, None], 0.0)
    apart /= np.maximum(np.abs(apart).max(axis=1, keepdims=True), np.finfo(float).tiny)
    # The cubic is centred at the point, so the level is the value at the point.
    rows = weights[..., None] * apart[..., None] ** POWERS
    squares = np.einsum("pij,pik->pjk", rows, rows)
    squares[~enclosed] = np.eye(len(POWERS))
    ridge = RIDGE * np.trace(squares, axis1=1, axis2=2)
    inverse = np.linalg.inv(squares + ridge[:, None, None] * np.eye(len(POWERS)))[:, 0]
    level = np.einsum("pj,pij,pi->p", inverse, rows, weights * y[near])
    distances: Floats = (y - level) / np.sqrt(error**2 + inverse[:, 0])
    return np.where(enclosed, distances, np.nan)


def _neighbours(
    data: Scaled, x: Floats, weights: Floats
) -> tuple[NDArray[np.int64], Floats]:
    """Return indices and weights of the neighbours of each point, (P, 4 S) each.

    The neighbours are two points of each different size on either side of `x` (P,). The
    weights are 0 if a size lacks two points on a side.
    """
    near = []
    counted = []
    for size in range(len(data.lengths)):
        own = np.flatnonzero(data.size == size)
        after = np.searchsorted(x[own], x)
        inside = (after > 1) & (after < len(own) - 1) & (data.size != size)
        for side in SIDES:
            other = own[np.clip(after + side, 0, len(own) - 1)]
            near.append(other)
            counted.append(np.where(inside, weights[other], 0.0))
    return np.stack(near, axis=1), np.stack(counted, axis=1)


def _first(data: Scaled) -> list[Floats]:
    """Return the STARTS best of a coarse grid of exponents, best first."""
    low = data.x.min()
    high = data.x.max()
    grid = [
        np.array([low + fraction * (high - low), inverse_nu, beta_nu])
        for fraction, inverse_nu, beta_nu in product(
            FIRST_PLACES, FIRST_INVERSE_NU, FIRST_BETA_NU
        )
    ]
    costs = [float(np.sum(_residuals(exponents, data) ** 2)) for exponents in grid]
    return [grid[number] for number in np.argsort(costs, kind="stable")[:STARTS]]


def _residuals(exponents: Floats, data: Scaled) -> Floats:
    """Return the distances scaled so that the sum of squares is S, (P,).

    All distances are APART if too few points are comparable, or if the exponents are
    outside the allowed range.
    """
    distances = _distances(data, exponents)
    finite = np.isfinite(distances)
    place, inverse_nu, _ = exponents
    within = data.x.min() <= place <= data.x.max() and inverse_nu > 0.0
    if finite.mean() < LEAST_OVERLAP or not within:
        return np.full(len(distances), APART)
    parts: Floats = np.where(finite, distances, 0.0) / np.sqrt(finite.sum())
    return parts


def _improved(data: Scaled, starts: list[Floats] | Floats) -> Floats:
    """Return the exponents with the smallest S, from one start or from several."""
    from scipy.optimize import least_squares

    if isinstance(starts, list):
        minima = [_improved(data, start) for start in starts]
        costs = [
            float(np.sum(_residuals(exponents, data) ** 2)) for exponents in minima
        ]
        return minima[int(np.argmin(costs))]
    reach = float(np.ptp(data.x))
    result = least_squares(
        _residuals,
        starts,
        args=(data,),
        method="lm",
        x_scale=[0.1 * reach, 1.0, 1.0],
        diff_step=PRECISION,
        ftol=PRECISION,
        xtol=PRECISION,
        max_nfev=MOST_CALLS,
    )
    return np.asarray(result.x, np.float64)
