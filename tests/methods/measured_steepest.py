"""How often the interval of the steepest place holds it: `python -m
tests.methods.measured_steepest [STUDIES]` prints the second table of
docs/decisions/a-grid-is-refined-by-its-intervals.md.
"""

import sys
from collections.abc import Iterator
from itertools import product

import numpy as np

from sweep.methods.refinement.rule import STEEPEST
from sweep.methods.refinement.steepest import peaks
from tests.methods.measured_boundaries import EDGE, logistic
from tests.refined import line, refined, rule


def measured(
    studies: int, slope: float, spread: float, most: int
) -> tuple[int, int, float, float]:
    """Of so many studies: of how many the ends do not differ; how many have a wrong
    interval; the mean width of the intervals, and their mean number of trials.
    """
    scales = {"x": line([0, 0.25, 0.5, 0.75, 1], 0.01)}
    asked = rule(scales, at=STEEPEST, until=0.01, least=5, most=most)
    none, wrong, widths, spent = 0, 0, list[float](), 0
    of = "proportion" if spread < 0 else "normal"
    for seed in range(studies):
        draw = logistic(EDGE, slope, spread, [7, seed])
        trials, seen = refined(asked, draw, of=of)
        (peak,) = peaks(asked, [*trials], seen)
        low, high = (scales["x"].at(place) for place in (peak.low, peak.high))
        none += peak.rises is None
        wrong += peak.several or not low <= EDGE <= high
        widths.append(high - low)
        spent += sum(trials.values())
    return none, wrong, float(np.mean(widths)), spent / studies


def rows(studies: int) -> Iterator[str]:
    yield "slope  spread  max  none (%)  wrong (%)  width  trials"
    for slope, spread, most in product((5.0, 20.0), (0.02, 0.1, -1.0), (10, 40, 160)):
        none, wrong, width, spent = measured(studies, slope, spread, most)
        name = "0 or 1" if spread < 0 else f"{spread:g}"
        yield (
            f"{slope:5g}  {name:>6}  {most:3}  {100 * none / studies:8.1f}"
            f"  {100 * wrong / studies:9.1f}  {width:5.3f}  {spent:6.0f}"
        )


if __name__ == "__main__":
    for row in rows(int(sys.argv[1]) if len(sys.argv) > 1 else 1000):
        print(row, flush=True)
