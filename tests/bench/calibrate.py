"""Calibrations beside pyABC, with simulations of microseconds: what is left is the
method. A mean of four normal values has a known posterior.
"""

import logging
import math
import time
from collections.abc import Mapping
from importlib.util import find_spec
from statistics import mean
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import truncnorm

from tests.bench.scale import FULL, Scale
from tests.methods.measured_calibration import calibrated, mean_of_four, rule_of

Floats = NDArray[np.float64]
DATA_SETS = 40
SIMULATIONS = 2000
GENERATIONS = 5
LARGEST = 3.0
ERROR = 0.5
"""Standard deviation of a mean of four values."""


def calibrate(scale: Scale = FULL) -> None:
    """Error of the posterior mean by the number of simulations, of the same data sets.

    The error is against the exact posterior mean, in its standard deviations. pyABC has
    its own defaults with as many kept simulations, and ends after as many simulations.
    """
    if find_spec("pyabc") is None:
        print("calibrate: pyabc is not installed, skipped")
        return
    size = SIMULATIONS // 2 // GENERATIONS
    rng = np.random.default_rng(2)
    names = ("ours", "pyabc")
    rows: dict[str, list[Row]] = {name: [] for name in names}
    for _ in range(scale.of(DATA_SETS)):
        truth = rng.random((1, 1))
        (data,) = mean_of_four(truth, rng)
        began = time.process_time()
        mine = _mine(truth, data, rng)
        between = time.process_time()
        theirs = _theirs(float(data[0]), size, rng)
        ended = time.process_time()
        rows["ours"].append(mine.row(float(data[0]), between - began))
        rows["pyabc"].append(theirs.row(float(data[0]), ended - between))
    print(
        f"{'calibrate':10} {'simulations':>11} {'error':>6} {'width':>6} {'seconds':>8}"
    )
    for name in names:
        columns = zip(*rows[name], strict=True)
        count, error, width, seconds = (mean(column) for column in columns)
        print(f"{name:10} {count:11.0f} {error:11.3f} {width:11.2f} {seconds:11.3f}")


class Row(NamedTuple):
    """Of a posterior of one data set: simulations, error of the mean and spread in
    exact standard deviations, and seconds of a processor.
    """

    simulations: int
    error: float
    width: float
    seconds: float


class Estimate(NamedTuple):
    """Weighted draws, and the number of simulations that they took."""

    draws: Floats
    weights: Floats
    simulations: int

    def row(self, data: float, seconds: float) -> Row:
        """Compare with the exact posterior of the data."""
        exact = truncnorm(-data / ERROR, (LARGEST - data) / ERROR, data, ERROR)
        middle = float((self.weights * self.draws).sum())
        variance = float((self.weights * (self.draws - middle) ** 2).sum())
        spread = float(exact.std())
        error = abs(middle - float(exact.mean())) / spread
        return Row(self.simulations, error, math.sqrt(variance) / spread, seconds)


def _mine(truth: Floats, data: Floats, rng: np.random.Generator) -> Estimate:
    rule = rule_of(1, GENERATIONS, SIMULATIONS)
    population = calibrated(rule, mean_of_four, truth, rng, data).population
    draws = LARGEST * population.draws[population.nearest, 0]
    return Estimate(draws, population.weights, len(population.draws))


def _theirs(data: float, size: int, rng: np.random.Generator) -> Estimate:
    import pyabc

    logging.getLogger("ABC").setLevel(logging.WARNING)

    def simulate(parameters: Mapping[str, float]) -> dict[str, float]:
        draw = np.array([[parameters["mean"] / LARGEST]])
        return {"mean": float(mean_of_four(draw, rng)[0, 0])}

    abc = pyabc.ABCSMC(
        simulate,
        pyabc.Distribution(mean=pyabc.RV("uniform", 0, LARGEST)),
        pyabc.PNormDistance(),
        population_size=size,
        sampler=pyabc.SingleCoreSampler(),
    )
    abc.new("sqlite://", {"mean": data})
    history = abc.run(max_total_nr_simulations=SIMULATIONS, minimum_epsilon=0.0)
    frame, weights = history.get_distribution()
    draws = frame["mean"].to_numpy()
    return Estimate(draws, weights, history.total_nr_simulations)
