"""How often what sizes tell of a transition is right, for made-up systems with known
laws.

`python -m tests.analysis.measured_scaling [STUDIES]` prints the tables of
docs/decisions/sizes-tell-a-transition-by-whole-trials.md; those of collapses take less
than a third of the studies.
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from sweep.analysis.coexistence import transition_order
from sweep.analysis.size_collapse import Collapse, collapse
from sweep.analysis.size_curves import (
    SizeCurve,
    binder_crossings,
    susceptibility_peak,
)
from tests.analysis.mean_field import (
    coexisting,
    collapsing,
    exact_binder,
    exact_crossing,
    exact_peak,
    smeared,
    spins,
)

SMALL, LARGE = 100, 400
COLLAPSING, NOISES = (64, 256, 1024), np.linspace(2.0, 4.0, 13)
EXPONENTS = (3.0, 0.9, 0.2)
"""Of `collapsing`: the place, 1/nu and beta/nu."""
ORDERS = ("continuous", "not decided", "first order")
RESAMPLES = 60


class Held(NamedTuple):
    """Of so many studies of the Curie-Weiss model: how many have one crossing, and of
    these intervals how many hold its place and the cumulant there; how many have a
    peak of the smaller size, and how many intervals hold its place and height.
    """

    studies: int
    crossings: int
    places: int
    values: int
    peaks: int
    peak_places: int
    heights: int


def held(studies: int, trials: int, frames: int, points: int) -> Held:
    """The counts of studies with so many trials a point, frames and temperatures."""
    crossing, (place, height) = exact_crossing(SMALL, LARGE), exact_peak(SMALL)
    value, counts = exact_binder(SMALL, crossing), np.zeros(6, np.int64)
    temperatures = np.linspace(0.7, 1.1, points)
    for seed in range(studies):
        rng = np.random.default_rng(seed)
        curves = [spins(n, temperatures, trials, frames, rng) for n in (SMALL, LARGE)]
        found, peak = binder_crossings(curves), susceptibility_peak(curves[0])
        (one,) = found if len(found) == 1 else (None,)
        counts += [
            one is not None,
            one is not None and one.low <= crossing <= one.high,
            one is not None and one.value_low <= value <= one.value_high,
            not peak.why,
            peak.low <= place <= peak.high,
            peak.height_low <= height <= peak.height_high,
        ]
    return Held(studies, *counts.tolist())


def collapsed(
    studies: int, trials: int, noise: float, resamples: int = RESAMPLES
) -> list[Collapse]:
    """The collapses of studies with such a noise of a trial."""
    found = []
    for seed in range(studies):
        rng = np.random.default_rng(seed)
        curves = [collapsing(n, NOISES, trials, rng, noise=noise) for n in COLLAPSING]
        found.append(collapse(curves, resamples=resamples))
    return found


def holding(found: Sequence[Collapse]) -> list[int]:
    """How many intervals hold each of EXPONENTS."""
    parts = [(one.place, one.inverse_nu, one.beta_nu) for one in found]
    return [
        sum(low <= true <= high for _, low, high in of_one)
        for true, of_one in zip(EXPONENTS, zip(*parts, strict=True), strict=True)
    ]


def continuous(seed: int, k: int = 12, frames: int = 200) -> list[SizeCurve]:
    """A study of the Curie-Weiss model about its critical temperature."""
    rng = np.random.default_rng(seed)
    warm = np.linspace(0.8, 1.04, 9)
    return [smeared(spins(n, warm, k, frames, rng), rng) for n in (64, 256, 1024)]


def jumping(seed: int, k: int = 12, frames: int = 200) -> list[SizeCurve]:
    """A study of two phases, each of which is there at some values."""
    rng = np.random.default_rng(seed)
    warm = np.linspace(0.9, 1.1, 11)
    return [coexisting(n, warm, k, frames, rng) for n in (64, 144, 256)]


def said(curves: Sequence[SizeCurve]) -> str:
    """Of which order a transition is said to be, one of ORDERS."""
    found = transition_order(curves)
    assert found.why
    return found.order


def orders(
    study: Callable[[int, int, int], list[SizeCurve]],
    studies: int,
    trials: int = 12,
    frames: int = 200,
) -> list[int]:
    """Of how many studies each of ORDERS is said."""
    words = Counter(said(study(seed, trials, frames)) for seed in range(studies))
    assert words.keys() <= {*ORDERS}
    return [words[one] for one in ORDERS]


def rows(studies: int) -> Iterator[str]:
    yield "trials, frames, points: no crossing, place, cumulant; no peak, place, height"
    for trials, frames in ((8, 100), (12, 50), (20, 400)):
        for points in (9, 17):
            one = held(studies, trials, frames, points)
            shares = (
                1 - one.crossings / studies,
                one.places / max(one.crossings, 1),
                one.values / max(one.crossings, 1),
                1 - one.peaks / studies,
                one.peak_places / max(one.peaks, 1),
                one.heights / max(one.peaks, 1),
            )
            told = " | ".join(f"{share:.0%}" for share in shares)
            yield f"| {trials}, {frames} | {points} | {told} |"
    yield "trials, noise: place, 1/nu, beta/nu, mean S"
    for trials, noise in ((6, 0.02), (12, 0.05)):
        fewer = max(studies * 4 // 15, 1)
        found = collapsed(fewer, trials, noise)
        quality = np.mean([one.quality for one in found])
        told = " | ".join(f"{count / fewer:.0%}" for count in holding(found))
        yield f"| {trials} | {noise:.0%} | {told} | {quality:.1f} |"
    yield f"trials, frames: of each {', '.join(ORDERS)}"
    for trials, frames in ((8, 100), (12, 200)):
        fewer = max(studies * 2 // 5, 1)
        told = " | ".join(
            ", ".join(map(str, orders(study, fewer, trials, frames)))
            for study in (continuous, jumping)
        )
        yield f"| {trials}, {frames} | {told} |"


if __name__ == "__main__":
    for row in rows(int(sys.argv[1]) if len(sys.argv) > 1 else 150):
        print(row, flush=True)
