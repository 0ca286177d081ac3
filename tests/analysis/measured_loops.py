"""How often the interval of the area of a loop covers it, for made-up chains.

`python -m tests.analysis.measured_loops [STUDIES]` prints the table of
docs/decisions/chains-are-the-replicates.md.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.hysteresis import loop
from sweep.analysis.intervals import mean_interval

VALUES = np.linspace(0.0, 1.0, 11)
MEMORY = 0.8
NOISES = {
    "normal": lambda rng, shape: rng.normal(0.0, 0.1, shape),
    "skewed": lambda rng, shape: 0.1 * (rng.exponential(1.0, shape) - 1.0),
}


def chains(
    rng: np.random.Generator, count: int, noise: str, area: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Chains (count, k) up and down whose mean loop has this area. The noise of a link
    is MEMORY times that of the link before it, and some of its own.
    """
    links = 2 * len(VALUES)
    found = NOISES[noise](rng, (count, links))
    for link in range(1, links):
        own = np.sqrt(1.0 - MEMORY**2)
        found[:, link] = MEMORY * found[:, link - 1] + own * found[:, link]
    up, down = found[:, : len(VALUES)], found[:, : len(VALUES) - 1 : -1]
    return up - area / 2.0, down + area / 2.0


def covered(studies: int, count: int, noise: str, area: float) -> tuple[float, float]:
    """How often the interval covers the area, and how often one does that takes all
    links for independent.
    """
    rng, hits = np.random.default_rng(18), np.zeros(2)
    for _ in range(studies):
        up, down = chains(rng, count, noise, area)
        found = loop(VALUES, up, down).area
        hits[0] += found.low <= area <= found.high
        links = mean_interval((down - up).ravel(), interval="t")
        hits[1] += links.low <= area <= links.high
    whole, apart = hits / studies
    return float(whole), float(apart)


def main() -> None:
    """Print the rows."""
    studies = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    for noise in NOISES:
        for count in (3, 5, 10, 30):
            whole, apart = covered(studies, count, noise, 0.2)
            print(f"| {noise} | {count} | {whole:.1%} | {apart:.1%} |")


if __name__ == "__main__":
    main()
