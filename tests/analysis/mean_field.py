"""Made-up systems of several sizes whose laws are known: the Curie-Weiss model, curves
that collapse exactly, and a mixture of two phases.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar
from scipy.special import gammaln

from sweep.analysis.size_curves import SizeCurve

Floats = NDArray[np.float64]


def curie_weiss(n: int, temperature: float) -> tuple[Floats, Floats]:
    """The values of m = |M| / n and their probabilities, of n spins of which each acts
    on each: P(M) ~ C(n, (n + M) / 2) exp(M^2 / (2 n T)).
    """
    up = np.arange(n + 1)
    total = 2.0 * up - n
    logs = gammaln(n + 1) - gammaln(up + 1) - gammaln(n - up + 1)
    logs += total**2 / (2.0 * n * temperature)
    weights = np.exp(logs - logs.max())
    return np.abs(total) / n, weights / weights.sum()


def exact_binder(n: int, temperature: float) -> float:
    m, p = curie_weiss(n, temperature)
    return float(1.0 - p @ m**4 / (3.0 * (p @ m**2) ** 2))


def exact_susceptibility(n: int, temperature: float) -> float:
    m, p = curie_weiss(n, temperature)
    return float(n * (p @ m**2 - (p @ m) ** 2))


def exact_crossing(n: int, other: int) -> float:
    """The temperature at which the cumulants of two sizes are equal."""
    found = brentq(lambda t: exact_binder(n, t) - exact_binder(other, t), 0.7, 1.05)
    return float(found)


def exact_peak(n: int) -> tuple[float, float]:
    """Where the susceptibility is largest, and how large."""
    found = minimize_scalar(
        lambda t: -exact_susceptibility(n, t), bounds=(0.6, 1.1), method="bounded"
    )
    return float(found.x), float(-found.fun)


def spins(
    n: int, temperatures: Floats, k: int, frames: int, rng: np.random.Generator
) -> SizeCurve:
    """A study of one size: k trials at each temperature, of independent frames."""
    samples = []
    for temperature in temperatures.tolist():
        m, p = curie_weiss(n, temperature)
        samples.append(rng.choice(m, (k, frames), p=p))
    return SizeCurve(n, float(n), np.asarray(temperatures), tuple(samples))


def smeared(curve: SizeCurve, rng: np.random.Generator) -> SizeCurve:
    """The same, with each m anywhere in the step between its neighbours: the values of
    spins lie on a lattice, of which bands hold unequal numbers.
    """
    samples = [
        np.abs(one + rng.uniform(-1.0, 1.0, one.shape) / curve.n)
        for one in curve.samples
    ]
    return SizeCurve(curve.n, curve.length, curve.x, tuple(samples))


def collapsing(
    n: int,
    x: Floats,
    k: int,
    rng: np.random.Generator,
    *,
    noise: float = 0.02,
    place: float = 3.0,
    inverse_nu: float = 0.9,
    beta_nu: float = 0.2,
) -> SizeCurve:
    """A study of one size whose mean order is L^(-beta/nu) f((x - place) L^(1/nu)) for
    L = sqrt(n), with normal noise between trials of this share of it.
    """
    length = float(np.sqrt(n))
    scaled = (x - place) * length**inverse_nu
    mean = length**-beta_nu * 0.5 * (1.0 - np.tanh(scaled / 6.0) + 0.1)
    draws = rng.normal(mean[:, None], noise * mean[:, None], (len(x), k))
    return SizeCurve(n, length, x, tuple(row[:, None] for row in draws))


def coexisting(
    n: int, x: Floats, k: int, frames: int, rng: np.random.Generator
) -> SizeCurve:
    """A study of one size with two phases: an ordered one with m near 0.7 and a
    disordered one with m near 1 / sqrt(n), of which the first has the share
    1 / (1 + exp(n (x - 1) / 4)) of the time. A trial changes phase now and then.
    """
    samples = []
    for one in x.tolist():
        share = 1.0 / (1.0 + np.exp(np.clip(n * (one - 1.0) / 4.0, -50, 50)))
        stays = rng.random((k, frames)) > 0.1
        drawn = rng.random((k, frames)) < share
        last = np.maximum.accumulate(np.where(stays, -1, np.arange(frames)), axis=1)
        ordered = np.take_along_axis(drawn, np.maximum(last, 0), axis=1)
        high = rng.normal(0.7, 0.5 / np.sqrt(n), (k, frames))
        low = np.hypot(*rng.normal(0.0, np.sqrt(0.5 / n), (2, k, frames)))
        samples.append(np.clip(np.where(ordered, high, low), 0.0, 1.0))
    return SizeCurve(n, float(np.sqrt(n)), x, tuple(samples))
