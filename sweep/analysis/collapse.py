"""Finite-size scaling: the exponents and the critical point with which the curves of
systems of several sizes collapse onto one.

Near a continuous transition the order m of a system of linear length L is
L^(-beta/nu) f((x - x_c) L^(1/nu)) with one function f for all sizes (Fisher and Barber
1972, Phys. Rev. Lett. 28, 1516-1519). How well curves collapse is measured without a
form of f, by the distance of each point from what neighbours of the other sizes say: S
of Houdayer and Hartmann (2004, Phys. Rev. B 70, 014418, appendix), with cubics in place
of their straight lines, which cut off the bends of a curve between points. S is about 1
where the curves differ by their errors alone.
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
OPEN = "the curves leave the critical point open, or 1/nu"
FEWEST_SIZES, FEWEST_POINTS = 3, 6
FIRST_PLACES = np.linspace(0.05, 0.95, 19)
FIRST_INVERSE_NU = np.array([0.25, 0.5, 0.75, 1.0, 1.5, 2.0])
FIRST_BETA_NU = np.array([0.0, 0.05, 0.125, 0.25, 0.5])
MOST_CALLS = 60
STARTS = 5
PRECISION, RIDGE = 1e-4, 1e-12
LEAST_OVERLAP = 0.5
SIDES, POWERS = (-2, -1, 0, 1), np.arange(4)
"""Which points of another size stand about a place between two of them, and the powers
of the cubic through them.
"""
APART = 1e3
"""The distance of points, in errors, where too few of them have others to compare."""


class Scaled(NamedTuple):
    """Curves of S sizes as they are collapsed: the S lengths, and of each point of all
    sizes, (P,) each, the number of its size, the control parameter, the order and its
    error. Points of a size stand together, by the control parameter.
    """

    lengths: Floats
    size: NDArray[np.int64]
    x: Floats
    order: Floats
    error: Floats


class Collapse(NamedTuple):
    """The critical point x_c and the exponents 1/nu and beta/nu, each as an estimate
    and the bounds of its interval, and the `quality` S.

    `compared` is the share of points that have points of other sizes on both sides. All
    but this are NaN where the curves cannot be collapsed: `why` says so in words.
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
    """The collapse of the mean order of some sizes, with intervals by the bootstrap.

    S is made smallest by x_c, 1/nu and beta/nu. The intervals are Student's, of k - 1
    degrees of freedom, with the standard deviation of estimates from resampled trials:
    of each point k - 1 of its k trials are drawn, with replacement, so that its
    variance is without bias (Rao and Wu 1988, J. Am. Stat. Assoc. 83, 231-241). They
    say nothing of corrections to scaling: points far from the transition, and small
    systems, belong to no collapse, which a large S shows.
    """
    if len(curves) < FEWEST_SIZES:
        return _none(f"fewer than {FEWEST_SIZES} sizes")
    if min(len(one.x) for one in curves) < FEWEST_POINTS:
        return _none(f"fewer than {FEWEST_POINTS} values of the control parameter")
    data = scaled(curves)
    if not (data.error > 0.0).all():
        return _none("all trials of a point agree")
    best = _first(data)
    found = _improved(data, best)
    distances = _distances(data, found)
    known = np.isfinite(distances)
    rng = np.random.default_rng(RESAMPLING_SEED)
    again = np.array(
        [
            _improved(data._replace(order=_resampled(curves, rng)), found)
            for _ in range(resamples)
        ]
    )
    fewest = min(len(samples) for one in curves for samples in one.samples)
    half = student_quantile(0.5 + confidence / 2, fewest - 1) * again.std(axis=0)
    parts = [
        (float(value), float(value - width), float(value + width))
        for value, width in zip(found, half, strict=True)
    ]
    (_, low, high), (_, least, _), _ = parts
    if not (data.x.min() < low and high < data.x.max() and least > 0.0):
        return _none(OPEN)
    quality = float(np.mean(distances[known] ** 2))
    return Collapse(parts[0], parts[1], parts[2], quality, float(known.mean()))


def _none(why: str) -> Collapse:
    nothing = (np.nan, np.nan, np.nan)
    return Collapse(nothing, nothing, nothing, np.nan, np.nan, why)


def scaled(curves: Sequence[SizeCurve]) -> Scaled:
    """The points of some sizes, in one row."""
    return Scaled(
        np.array([one.length for one in curves]),
        np.repeat(np.arange(len(curves)), [len(one.x) for one in curves]),
        np.concatenate([one.x for one in curves]),
        np.concatenate([one.order.value for one in curves]),
        np.concatenate([one.order.error for one in curves]),
    )


def _resampled(curves: Sequence[SizeCurve], rng: np.random.Generator) -> Floats:
    """The mean order at each point, of k - 1 trials drawn from its k."""
    means = []
    for curve in curves:
        for samples in curve.samples:
            values = samples.mean(axis=1)
            means.append(rng.choice(values, len(values) - 1).mean())
    return np.array(means)


def quality(curves: Sequence[SizeCurve], exponents: Floats) -> float:
    """S of Houdayer and Hartmann for x_c, 1/nu and beta/nu, (3,)."""
    distances = _distances(scaled(curves), np.asarray(exponents, np.float64))
    return float(np.nanmean(distances**2))


def _distances(data: Scaled, exponents: Floats) -> Floats:
    """How far each point (P,) lies from the others, in standard errors; NaN where no
    other size has two points on both sides.

    The others are two neighbours on either side of each other size, near which the
    cubic goes that fits them best by their errors.
    """
    place, inverse_nu, beta_nu = exponents
    # Lengths in units of their mean: the exponents depend less on each other so.
    lengths = (data.lengths / np.exp(np.log(data.lengths).mean()))[data.size]
    x = (data.x - place) * lengths**inverse_nu
    y, error = (one * lengths**beta_nu for one in (data.order, data.error))
    near, weights = _neighbours(data, x, 1.0 / error)
    known = (weights > 0.0).sum(axis=1) >= len(SIDES)
    apart = np.where(weights > 0.0, x[near] - x[:, None], 0.0)
    apart /= np.maximum(np.abs(apart).max(axis=1, keepdims=True), np.finfo(float).tiny)
    # About the point itself the level of the cubic is its value there.
    rows = weights[..., None] * apart[..., None] ** POWERS
    squares = np.einsum("pij,pik->pjk", rows, rows)
    squares[~known] = np.eye(len(POWERS))
    ridge = RIDGE * np.trace(squares, axis1=1, axis2=2)
    inverse = np.linalg.inv(squares + ridge[:, None, None] * np.eye(len(POWERS)))[:, 0]
    level = np.einsum("pj,pij,pi->p", inverse, rows, weights * y[near])
    distances: Floats = (y - level) / np.sqrt(error**2 + inverse[:, 0])
    return np.where(known, distances, np.nan)


def _neighbours(
    data: Scaled, x: Floats, weights: Floats
) -> tuple[NDArray[np.int64], Floats]:
    """Which points stand on either side of each point at `x` (P,), two of each other
    size on each side, and their weights, (P, 4 S) each; these are 0 where a size has no
    two points on both sides.
    """
    near, counted = [], []
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
    """The best of a coarse grid of exponents."""
    low, high = data.x.min(), data.x.max()
    grid = [
        np.array([low + share * (high - low), inverse_nu, beta_nu])
        for share, inverse_nu, beta_nu in product(
            FIRST_PLACES, FIRST_INVERSE_NU, FIRST_BETA_NU
        )
    ]
    worth = [float(np.sum(_residuals(one, data) ** 2)) for one in grid]
    return [grid[number] for number in np.argsort(worth, kind="stable")[:STARTS]]


def _residuals(exponents: Floats, data: Scaled) -> Floats:
    """The distances, as parts of S, which is the sum of their squares."""
    distances = _distances(data, exponents)
    known = np.isfinite(distances)
    place, inverse_nu, _ = exponents
    within = data.x.min() <= place <= data.x.max() and inverse_nu > 0.0
    if known.mean() < LEAST_OVERLAP or not within:
        return np.full(len(distances), APART)
    parts: Floats = np.where(known, distances, 0.0) / np.sqrt(known.sum())
    return parts


def _improved(data: Scaled, starts: list[Floats] | Floats) -> Floats:
    """The exponents of the smallest S that is found from one start, or from several."""
    from scipy.optimize import least_squares

    if isinstance(starts, list):
        found = [_improved(data, start) for start in starts]
        worth = [float(np.sum(_residuals(one, data) ** 2)) for one in found]
        return found[int(np.argmin(worth))]
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
