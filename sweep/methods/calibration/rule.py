"""A checked `calibrate` section: data, summaries, prior, and numbers of simulations."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.spec import ProfilePoint, Value

Floats = NDArray[np.float64]
MEAN = "mean"
DEVIATION = "sd"
STATISTICS = (MEAN, DEVIATION)


class Summary(NamedTuple):
    """A statistic of a metric or profile over the trials of a data set.

    Attributes
    ----------
    column : str
        Column of trials, or a profile.
    statistic : str or float
        "mean", "sd" for the standard deviation, or the probability of a quantile.
    at : float, optional
        Position along the axis of a profile; None for a column of trials.
    """

    column: str
    statistic: str | float
    at: float | None = None

    @property
    def source(self) -> str | ProfilePoint:
        """The value of a trial that the summary needs."""
        return self.column if self.at is None else ProfilePoint(self.column, self.at)

    @property
    def words(self) -> str:
        """The summary in words."""
        if isinstance(self.statistic, str):
            return f"{self.statistic} of {self.source}"
        return f"{self.statistic:g} quantile of {self.source}"

    def of(self, values: Floats) -> Floats:
        """Return the statistic over the last axis; trials without a value do not count.

        Parameters
        ----------
        values : array of float, shape (n, trials)

        Returns
        -------
        array of float, shape (n,)
            NaN where no trial has a value, and for a standard deviation of one value.
        """
        counts = np.isfinite(values).sum(axis=-1)
        enough = counts > (1 if self.statistic == DEVIATION else 0)
        result = np.full(len(values), np.nan)
        some = np.where(np.isfinite(values), values, np.nan)[enough]
        if not len(some):
            return result
        if self.statistic == MEAN:
            result[enough] = np.nanmean(some, axis=-1)
        elif self.statistic == DEVIATION:
            result[enough] = np.nanstd(some, axis=-1, ddof=1)
        else:
            result[enough] = np.nanquantile(some, float(self.statistic), axis=-1)
        return result


class Prior(NamedTuple):
    """Prior of a parameter: an entry of DISTRIBUTIONS, with its arguments."""

    form: str
    arguments: tuple[Value, ...]


@dataclass(frozen=True)
class Calibration:
    """The rule of a calibrated study, see `sweep.spec.section.GrowthRule`.

    Attributes
    ----------
    to : str
        The stored trials that are the data, see `sweep.methods.comparison.side_of`.
    summaries : tuple of Summary
    priors : mapping
        Prior of each parameter, by name.
    axis : str
        Axis of the prior.
    sampler : str
        Sampler of the draws from the prior.
    draws : int
        Number of draws from the prior.
    population : int
        Number of simulations that are kept, and of proposals of a generation.
    generations : int
        Most generations after the draws from the prior.
    acceptance : float
        Fraction of accepted proposals below which a calibration ends.
    checks : int
        Number of synthetic data sets.
    learnt : bool
        Whether regression turns the summaries into estimates of the parameters.
    replicates : int
        Trials per simulation.
    """

    place: ClassVar = ("calibrate",)
    """The key of a spec that writes the rule."""
    adds_points: ClassVar = True
    looks: ClassVar = ()
    nominal: ClassVar = 0.95

    to: str
    summaries: tuple[Summary, ...]
    priors: Mapping[str, Prior]
    axis: str
    sampler: str
    draws: int
    population: int
    generations: int
    acceptance: float
    checks: int
    learnt: bool
    replicates: int

    @property
    def sources(self) -> tuple[str | ProfilePoint, ...]:
        """The values of trials that the summaries need, without repetition."""
        return tuple(dict.fromkeys(summary.source for summary in self.summaries))

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of trials that the summaries need."""
        return tuple(value for value in self.sources if isinstance(value, str))

    @property
    def points(self) -> tuple[ProfilePoint, ...]:
        """The points of profiles that the summaries need."""
        return tuple(value for value in self.sources if isinstance(value, ProfilePoint))

    @property
    def least(self) -> int:
        """The number of trials of a point."""
        return self.replicates

    @property
    def most(self) -> int:
        """The number of trials of a point."""
        return self.replicates

    def most_trials(self, _points: int) -> int:
        """Return the most trials of a study, whatever the number of points at first."""
        of_data_set = self.draws + self.generations * self.population
        simulations = self.checks + (1 + self.checks) * of_data_set
        return simulations * self.replicates

    @property
    def counted(self) -> str:
        """The trials of a spec that are counted, in words."""
        return (
            "the draws from the prior are counted; each generation adds draws near the"
            " data"
        )

    @property
    def where(self) -> str:
        """The simulations near which points are added, in words."""
        return "is near the data"

    @property
    def in_words(self) -> str:
        """The condition on which points are added, in words."""
        again = f", also for {self.checks:,} synthetic data sets" if self.checks else ""
        return (
            f"; up to {self.generations} generations of {self.population:,} simulations"
            f"{again}"
        )

    def as_json(self) -> dict[str, Any]:
        """Return the rule for plans and reports."""
        return {
            "to": self.to,
            "summaries": [list(summary) for summary in self.summaries],
            "priors": {
                name: {prior.form: list(prior.arguments)}
                for name, prior in self.priors.items()
            },
            "axis": self.axis,
            "sampler": self.sampler,
            "draws": self.draws,
            "population": self.population,
            "generations": self.generations,
            "acceptance": self.acceptance,
            "checks": self.checks,
            "learnt": self.learnt,
            "replicates": self.replicates,
        }


def from_json(record: Mapping[str, Any]) -> Calibration:
    """Return the rule that `Calibration.as_json` has written."""
    summaries = tuple(Summary(*each) for each in record["summaries"])
    priors = {
        name: Prior(form, tuple(arguments))
        for name, spread in record["priors"].items()
        for form, arguments in spread.items()
    }
    return Calibration(**{**record, "summaries": summaries, "priors": priors})


def summarised(summaries: Sequence[Summary], values: Mapping[str, Floats]) -> Floats:
    """Return the summaries of data sets, shape (n, S).

    Parameters
    ----------
    summaries : sequence of Summary
        The S summaries.
    values : mapping
        Values of trials by source, shape (n, trials).
    """
    return np.stack([each.of(values[str(each.source)]) for each in summaries], axis=1)
