"""How often crossings of refined grids hold the place where the mean crosses the level:
`python -m tests.methods.measured_boundaries [STUDIES]` prints the table of
docs/decisions/a-grid-is-refined-by-its-intervals.md.
"""

import math
import sys
from collections.abc import Iterator
from itertools import product

import numpy as np

from sweep.methods.refinement.rule import crossings
from tests.refined import Draw, line, refined, rule

EDGE = 0.37


def logistic(edge: float, slope: float, spread: float, seed: list[int]) -> Draw:
    """A mean that goes from 0 to 1 about `edge`, with normal noise; below 0 for a
    `spread`, 0 or 1 with that chance.
    """
    rng = np.random.default_rng(seed)

    def draw(at: tuple[float, ...], number: int) -> list[float]:
        mean = 1.0 / (1.0 + math.exp(-slope * (at[0] - edge)))
        if spread < 0:
            return rng.binomial(1, mean, number).astype(float).tolist()
        return rng.normal(mean, spread, number).tolist()

    return draw


def measured(
    studies: int, slope: float, spread: float, most: int
) -> tuple[int, int, float, float]:
    """Of so many studies: how many have no crossing, as no two points are known; how
    many have a wrong one, or several; the mean width of their crossings, and their mean
    number of trials.
    """
    asked = rule(
        {"x": line([0, 0.25, 0.5, 0.75, 1], 0.01)}, until=0.01, least=5, most=most
    )
    scale, none, wrong, widths, spent = asked.scales["x"], 0, 0, list[float](), 0
    of = "proportion" if spread < 0 else "normal"
    for seed in range(studies):
        draw = logistic(EDGE, slope, spread, [7, seed])
        trials, seen = refined(asked, draw, of=of)
        found = [
            (scale.at(one.low), scale.at(one.high))
            for one in crossings(asked, [*trials], seen)
        ]
        none += not found
        right = len(found) == 1 and found[0][0] <= EDGE <= found[0][1]
        wrong += bool(found) and not right
        widths += [high - low for low, high in found[:1]]
        spent += sum(trials.values())
    return none, wrong, float(np.mean(widths)), spent / studies


def rows(studies: int) -> Iterator[str]:
    yield "slope  spread  max  none (%)  wrong (%)  width  trials"
    for slope, spread, most in product((5.0, 20.0), (0.1, 0.5, -1.0), (10, 40, 160)):
        none, wrong, width, spent = measured(studies, slope, spread, most)
        name = "0 or 1" if spread < 0 else f"{spread:g}"
        yield (
            f"{slope:5g}  {name:>6}  {most:3}  {100 * none / studies:8.1f}"
            f"  {100 * wrong / studies:9.1f}"
            f"  {width:5.3f}  {spent:6.0f}"
        )


if __name__ == "__main__":
    for row in rows(int(sys.argv[1]) if len(sys.argv) > 1 else 1000):
        print(row, flush=True)
