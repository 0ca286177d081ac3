"""How often intervals of calibrations hold the truth, by the number of generations.

`python -m tests.methods.measured_calibration 400` prints the tables of
docs/decisions/a-calibration-goes-in-generations.md, and of
docs/decisions/odds-come-from-stored-calibrations.md, with this number of data sets.
"""

import sys
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from sweep.methods.calibration.analysis import quantiles
from sweep.methods.calibration.evidence import BoundedEstimate, evidence, ratio
from sweep.methods.calibration.rule import Calibration, Prior, Summary
from sweep.methods.calibration.targets import Target

Floats = NDArray[np.float64]
Simulate = Callable[[Floats, np.random.Generator], Floats]


def mean_of_four(draws: Floats, rng: np.random.Generator) -> Floats:
    """The mean of four normal values, whose mean is 0 to 3 and whose sd is 1."""
    return 3.0 * draws[:, :1] + rng.normal(0.0, 0.5, (len(draws), 1))


def ridge(draws: Floats, rng: np.random.Generator) -> Floats:
    """A sum of two parameters, each 0 to 3, with little noise."""
    return 3.0 * draws.sum(axis=1, keepdims=True) + rng.normal(
        0.0, 0.1, (len(draws), 1)
    )


def heads(draws: Floats, rng: np.random.Generator) -> Floats:
    """Heads of four tosses, from 0 to 4: many distances are equal."""
    return rng.binomial(4, draws[:, :1]).astype(np.float64)


def rule_of(parameters: int, generations: int, simulations: int) -> Calibration:
    """A rule that spends so many simulations, half of them on the prior."""
    draws = simulations if generations == 0 else simulations // 2
    population = 100 if generations == 0 else simulations // 2 // generations
    return Calibration(
        to="data",
        summaries=(Summary("speed", "mean"),),
        priors={f"p{number}": Prior("uniform", (0, 1)) for number in range(parameters)},
        axis="prior",
        sampler="random",
        draws=draws,
        population=population,
        generations=generations,
        acceptance=0.0,
        checks=0,
        learnt=False,
        replicates=1,
    )


def calibrated(
    rule: Calibration,
    simulate: Simulate,
    truth: Floats,
    rng: np.random.Generator,
    data: Floats | None = None,
) -> Target:
    """A calibration to data, by default of a true draw, shape (1, D)."""
    if data is None:
        (data,) = simulate(truth, rng)
    target = Target(1, data, rule)
    draws = rng.random((rule.draws, truth.shape[1]))
    target.begin(draws, simulate(draws, rng))
    while not target.ended:
        size = rule.population
        draws, allowed = target.kernel.draw(
            size, rng, lambda some: np.ones(len(some), np.bool_)
        )
        target.add(draws, simulate(draws, rng), allowed)
    return target


def measured(
    simulate: Simulate, parameters: int, generations: int, count: int
) -> tuple[float, float, float, float]:
    """Of so many data sets: median tolerance, mean effective number of draws, fraction
    of 95 % intervals of the first parameter that hold the truth, and their mean width.
    """
    rng = np.random.default_rng(1)
    rule = rule_of(parameters, generations, 2000)
    inside = 0
    widths = []
    populations = []
    for _ in range(count):
        truth = rng.random((1, parameters))
        population = calibrated(rule, simulate, truth, rng).population
        drawn = population.draws[population.nearest, 0]
        low, high = quantiles(drawn, population.weights, (0.025, 0.975))
        inside += low <= truth[0, 0] <= high
        widths.append(high - low)
        populations.append(population)
    tolerance = np.median([each.tolerance for each in populations])
    effective = np.mean([each.effective for each in populations])
    return float(tolerance), float(effective), inside / count, float(np.mean(widths))


def exact_evidence(
    data: float, away: float, largest: float, error: float = 0.5
) -> float:
    """The probability that a normal value is near the data, with a uniform mean.

    Its mean is 0 to `largest`, its sd is `error`, and the prior is a fine grid.
    """
    means = (np.arange(4000) + 0.5) * largest / 4000
    ends = (data + away - means) / error, (data - away - means) / error
    return float((norm.cdf(ends[0]) - norm.cdf(ends[1])).mean())


def factors(
    generations: int, away: float, count: int, simulations: int = 1000
) -> list[tuple[BoundedEstimate, float, float]]:
    """Bayes factors of a wide and a narrow prior: estimate, truth and least number of
    independent simulations that an evidence rests on, for so many data sets.
    """
    rng = np.random.default_rng(4)
    rows = []
    while len(rows) < count:
        truth = rng.random((1, 1))
        (data,) = mean_of_four(truth, rng)
        evidences = []
        likely = []
        for part in (1.0, 0.5):

            def simulate(
                draws: Floats, rng: np.random.Generator, part: float = part
            ) -> Floats:
                return mean_of_four(part * draws, rng)

            rule = rule_of(1, generations, simulations)
            target = calibrated(rule, simulate, truth, rng, data)
            population = target.population
            near = population.distances * target.distance.spread[0] <= away
            weights = 1.0 / population.mixture(population.draws)
            drawn = population.generations[0].size
            evidences.append(evidence(weights, near, drawn))
            likely.append(exact_evidence(float(data[0]), away, 3.0 * part))
        wide, narrow = evidences
        if wide.probability.value:
            factor = ratio(narrow.probability, wide.probability)
            least = min(wide.effective, narrow.effective)
            rows.append((factor, likely[1] / likely[0], least))
    return rows


def main(count: int) -> None:
    """Print all rows."""
    print("| model | generations | tolerance | effective | coverage | mean width |")
    print("|---|---|---|---|---|---|")
    for simulate, parameters in ((mean_of_four, 1), (ridge, 2), (heads, 1)):
        for generations in (0, 2, 5, 10):
            row = measured(simulate, parameters, generations, count)
            tolerance, effective, inside, width = row
            print(
                f"| {simulate.__name__} | {generations} | {tolerance:.3g}"
                f" | {effective:.0f} | {inside:.3f} | {width:.3f} |"
            )
    print("\n| generations | tolerance | effective | coverage |\n|---|---|---|---|")
    for generations in (0, 2, 5):
        for away in (0.4, 0.1, 0.02):
            rows = factors(generations, away, count)
            covered = np.mean([row.low <= true <= row.high for row, true, _ in rows])
            median = np.median([least for *_, least in rows])
            print(f"| {generations} | {away} | {median:.0f} | {covered:.3f} |")


if __name__ == "__main__":
    main(int(sys.argv[1]))
