"""The posterior of a calibrated study, with the checks that tell what it is worth."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.stats import binomtest, chisquare

from sweep.errors import ChoiceError, StoreError
from sweep.methods.calibration.rule import Calibration, from_json, summarised
from sweep.methods.calibration.strategy import ABOUT, DRAW
from sweep.methods.calibration.targets import (
    DATA,
    PRIOR,
    TRUTH,
    Target,
    targets_of,
)
from sweep.spec import DISTRIBUTIONS, PLAN
from sweep.store import metadata
from sweep.tables import StoredStudy

Floats = NDArray[np.float64]
LEVEL = 0.95
LEVELS = (0.5, LEVEL)
"""Probabilities of the credible intervals whose coverage is checked."""
NEAR = 0.01
"""Fraction of the simulations of the prior that are near a data set."""
MOST_COMPARED = 2000
"""Most simulations of the prior that are compared with the data."""
FEWEST_CHECKS = 10
"""Fewest synthetic data sets from which the uniformity of ranks is tested."""
PER_BIN = 5
MOST_BINS = 20
AGAIN = "launch the study again"
NUMBER = int | float
SHAPE = {
    "rule": {
        "to": str,
        "summaries": [list],
        "priors": {str: {str: list}},
        "axis": str,
        "sampler": str,
        "draws": int,
        "population": int,
        "generations": int,
        "acceptance": NUMBER,
        "checks": int,
        "learnt": bool,
        "replicates": int,
    },
    "data": [NUMBER],
    "data_trials": int,
    "allowed": [[NUMBER]],
    "finished": bool,
}


@dataclass(frozen=True, eq=False)
class Posterior:
    """Posterior of the parameters of a model, given data.

    Attributes
    ----------
    study : str
        Name of the study.
    rule : Calibration
    data_trials : int
        Number of trials of the data.
    finished : bool
        True if no generation follows.
    missing : int
        Number of requested trials that are not stored.
    simulations : int
        Number of simulations for the data, draws from the prior included.
    tolerance : float
        Largest distance of a kept simulation, in spreads of the prior.
    effective : float
        Effective number of kept draws.
    draws : DataFrame
        One row per kept simulation, the nearest first. Columns: weight, with the sum 1;
        distance; generation; the parameters; the summaries.
    parameters : DataFrame
        One row per parameter with numbers. Columns: parameter, unit, mean, sd, median,
        low and high (the 95 % credible interval), prior_low and prior_high (the same of
        the draws from the prior).
    choices : DataFrame
        One row per value of a parameter without numbers. Columns: parameter, value,
        prior, posterior.
    predictive : DataFrame
        One row per summary. Columns: summary, data; mean, low and high of the kept
        simulations, with their weights; prior_low and prior_high, the smallest and the
        largest value of the draws from the prior; spread, the robust spread over the
        draws from the prior.
    fit : float
        Probability that data from the prior are as far from the simulations of the
        prior as the data are; NaN without simulations.
    generations : DataFrame
        One row per generation. Columns: generation, simulations, accepted, tolerance,
        effective.
    ranks : DataFrame
        One row per synthetic data set, with the rank of the true value among the
        posterior draws of each parameter, from 0 to 1.
    checks : DataFrame
        One row per parameter. Columns: parameter, data_sets, p (of uniform ranks), and
        for 50 % and 95 % credible intervals the coverage with its confidence interval.
        Empty without synthetic data sets.
    """

    study: str
    rule: Calibration
    data_trials: int
    finished: bool
    missing: int
    simulations: int
    tolerance: float
    effective: float
    draws: pd.DataFrame
    parameters: pd.DataFrame
    choices: pd.DataFrame
    predictive: pd.DataFrame
    fit: float
    generations: pd.DataFrame
    ranks: pd.DataFrame
    checks: pd.DataFrame


def is_calibrated(study: StoredStudy) -> bool:
    """Return whether the spec of a stored study has `calibrate`."""
    requests = study.asked
    return requests is not None and ABOUT in (requests.schema.metadata or {})


def is_finished(study: StoredStudy) -> bool:
    """Return whether no generation follows in a calibrated study."""
    assert study.asked is not None
    file = study.store.folder / PLAN
    described = metadata(study.asked.schema, ABOUT, SHAPE, file, remedy=AGAIN)
    return bool(described["finished"])


def posterior(study: StoredStudy, *, checked: bool = True) -> Posterior:
    """Return the posterior of a calibrated study.

    Parameters
    ----------
    study : StoredStudy
    checked : bool, default True
        Whether synthetic data sets are read too, which takes most of the time.

    Raises
    ------
    ChoiceError
        The spec has no `calibrate`, or `where` has restricted the study.
    StoreError
        The plan is damaged, or no simulation has all summaries.
    """
    if not is_calibrated(study):
        raise ChoiceError(
            'the spec has no "calibrate", so there is no posterior;'
            " see sweep guide calibration",
            study.name,
        )
    if study.restricted:
        raise ChoiceError("a calibration cannot be restricted by where", study.name)
    simulated = _Simulated(study, checked=checked)
    targets = simulated.targets()
    if not targets or targets[0].number != DATA or not len(targets[0].population.kept):
        raise StoreError(
            "no simulation has all summaries yet; launch the study", study.name
        )
    target = targets[0]
    ranks = simulated.ranks(targets[1:])
    return Posterior(
        study=study.name,
        rule=simulated.rule,
        data_trials=simulated.description["data_trials"],
        finished=simulated.description["finished"],
        missing=simulated.missing,
        simulations=len(target.population.draws),
        tolerance=target.population.tolerance,
        effective=target.population.effective,
        draws=simulated.kept(target),
        parameters=simulated.estimates(target),
        choices=simulated.choices(target),
        predictive=simulated.predictive(target),
        fit=simulated.fit(target),
        generations=_generations(target),
        ranks=ranks,
        checks=_checks(ranks),
    )


class _Simulated:
    """The simulations of a stored calibration, in the order of the requests."""

    def __init__(self, study: StoredStudy, *, checked: bool) -> None:
        file = study.store.folder / PLAN
        table = study.asked
        assert table is not None
        self.study = study
        self.description = metadata(table.schema, ABOUT, SHAPE, file, remedy=AGAIN)
        try:
            self.rule = from_json(self.description["rule"])
        except (TypeError, ValueError, KeyError) as error:
            raise StoreError(f"{file}: the calibration is not valid; {AGAIN}") from error
        rule = self.rule
        columns = ["data_set", "generation", *(f"{DRAW}{name}" for name in rule.priors)]
        lacking = {*columns, "trial_id"} - {*table.column_names}
        if lacking or len(table) % rule.replicates:
            raise StoreError(f"{file}: the simulations are not complete; {AGAIN}")
        if not checked:
            table = table.filter(pc.equal(table["data_set"], DATA))
        first = slice(None, None, rule.replicates)
        self.number = table["data_set"].to_numpy()[first]
        self.generation = table["generation"].to_numpy()[first]
        drawn = [table[f"{DRAW}{name}"].to_numpy()[first] for name in rule.priors]
        self.draws: Floats = np.stack(drawn, axis=1)
        self.values, self.parameters = self._trials(table, first)
        self.summaries = summarised(rule.summaries, self.values)

    def _trials(
        self, table: pa.Table, first: slice
    ) -> tuple[dict[str, Floats], pd.DataFrame]:
        """Return the values of the columns, and the parameters of each simulation."""
        rule = self.rule
        ids = table["trial_id"].combine_chunks()
        stored = self.study.read("trials", ids).to_pandas()
        known = stored.set_index("trial_id").reindex(columns=[*rule.columns, "status"])
        rows = known.reindex(table["trial_id"].to_pylist())
        self.missing = int(rows["status"].isna().sum())
        shape = len(table) // rule.replicates, rule.replicates
        values = {
            name: rows[name].to_numpy(np.float64, na_value=np.nan).reshape(shape)
            for name in rule.columns
        }
        plan = self.study.plan.select(["trial_id", *rule.priors]).to_pandas()
        points = plan.set_index("trial_id").loc[table["trial_id"].to_pylist()[first]]
        return values, points.reset_index(drop=True)

    def targets(self) -> list[Target]:
        """Return the data and the synthetic data sets, with all generations."""
        prior = (self.number == DATA) & (self.generation == PRIOR)
        truths = np.flatnonzero(self.generation == TRUTH)
        synthetic = [self.summaries[place] for place in truths]
        data = np.array(self.description["data"], np.float64)
        if not np.isfinite(self.summaries[prior]).all(axis=1).any():
            return []
        targets = targets_of(
            self.rule, data, self.draws[prior], self.summaries[prior], synthetic
        )
        for target in targets:
            allowed = self.description["allowed"][target.number]
            for generation, fraction in enumerate(allowed, start=1):
                rows = (self.number == target.number) & (self.generation == generation)
                target.add(self.draws[rows], self.summaries[rows], fraction)
        return targets

    def _places(self, target: Target) -> NDArray[np.intp]:
        """Return the simulations of a data set, in the order of its population."""
        prior = (self.number == DATA) & (self.generation == PRIOR)
        later = (self.number == target.number) & (self.generation > PRIOR)
        return np.concatenate([np.flatnonzero(prior), np.flatnonzero(later)])

    def kept(self, target: Target) -> pd.DataFrame:
        """Return the kept simulations of a data set, the nearest first."""
        population = target.population
        places = self._places(target)[population.kept]
        table = pd.DataFrame(
            {
                "weight": population.weights,
                "distance": population.distances[population.kept],
                "generation": self.generation[places],
            }
        )
        values = self.parameters.iloc[places].reset_index(drop=True)
        summaries = pd.DataFrame(self.summaries[places], columns=self.words)
        return pd.concat([table, values, summaries], axis=1)

    @property
    def words(self) -> list[str]:
        """The summaries in words."""
        return [summary.words for summary in self.rule.summaries]

    def estimates(self, target: Target) -> pd.DataFrame:
        """Return estimates of the parameters with numbers."""
        kept = self.kept(target)
        weights = target.population.weights
        prior = (self.number == DATA) & (self.generation == PRIOR)
        rows = []
        for name in self.rule.priors:
            values = kept[name]
            if not _is_number(values):
                continue
            drawn = values.to_numpy(np.float64)
            mean = float((weights * drawn).sum())
            median, low, high = quantiles(drawn, weights, (0.5, *_ends(LEVEL)))
            before = self.parameters.loc[prior, name].to_numpy(np.float64)
            usual = quantiles(before, np.full(len(before), 1.0 / len(before)), _ends(LEVEL))
            rows.append(
                {
                    "parameter": name,
                    "unit": self.study.units.get(name, ""),
                    "mean": mean,
                    "sd": float(np.sqrt((weights * (drawn - mean) ** 2).sum())),
                    "median": median,
                    "low": low,
                    "high": high,
                    "prior_low": usual[0],
                    "prior_high": usual[1],
                }
            )
        return pd.DataFrame(rows)

    def choices(self, target: Target) -> pd.DataFrame:
        """Return the probabilities of the values of parameters without numbers."""
        kept = self.kept(target)
        rows = []
        for name, prior in self.rule.priors.items():
            if DISTRIBUTIONS[prior.form].kind != "listed" or _is_number(kept[name]):
                continue
            for value in prior.arguments:
                chosen = (kept[name] == value).to_numpy()
                rows.append(
                    {
                        "parameter": name,
                        "value": value,
                        "prior": 1.0 / len(prior.arguments),
                        "posterior": float(target.population.weights[chosen].sum()),
                    }
                )
        return pd.DataFrame(rows, columns=["parameter", "value", "prior", "posterior"])

    def predictive(self, target: Target) -> pd.DataFrame:
        """Return the summaries of the kept simulations beside those of the data."""
        kept = self.summaries[self._places(target)[target.population.kept]]
        weights = target.population.weights
        prior = self.summaries[(self.number == DATA) & (self.generation == PRIOR)]
        rows = []
        for place, words in enumerate(self.words):
            low, high = quantiles(kept[:, place], weights, _ends(LEVEL))
            rows.append(
                {
                    "summary": words,
                    "data": float(target.data[place]),
                    "mean": float((weights * kept[:, place]).sum()),
                    "low": low,
                    "high": high,
                    "prior_low": float(np.nanmin(prior[:, place])),
                    "prior_high": float(np.nanmax(prior[:, place])),
                    "spread": float(target.distance.spread[place]),
                }
            )
        return pd.DataFrame(rows)

    def fit(self, target: Target) -> float:
        """Return the probability of data as far away as the data (Lemaire et al. 2016).

        The statistic is the mean distance from the nearest simulations of the prior.
        Simulations of the prior in turn serve as data.
        """
        prior = self.summaries[(self.number == DATA) & (self.generation == PRIOR)]
        scaled = target.distance.scaled(prior[np.isfinite(prior).all(axis=1)])
        near = max(1, round(NEAR * len(scaled)))
        if len(scaled) <= near + 1:
            return float("nan")
        tree = cKDTree(scaled)
        data = target.distance.scaled(target.data[None])
        away = np.reshape(tree.query(data, k=near)[0], (1, -1)).mean()
        # The nearest simulation of a simulation is itself.
        others = tree.query(scaled[:MOST_COMPARED], k=near + 1)[0][:, 1:].mean(axis=1)
        return float((1 + (others >= away).sum()) / (1 + len(others)))

    def ranks(self, targets: list[Target]) -> pd.DataFrame:
        """Return the rank of the true draw of each synthetic data set."""
        rows = []
        for target in targets:
            (truth,) = self.draws[
                (self.number == target.number) & (self.generation == TRUTH)
            ]
            population = target.population
            drawn = population.draws[population.kept]
            below = (drawn < truth) + 0.5 * (drawn == truth)
            rows.append((population.weights[:, None] * below).sum(axis=0))
        return pd.DataFrame(rows, columns=[*self.rule.priors])


def _is_number(values: "pd.Series[Any]") -> bool:
    return pd.api.types.is_numeric_dtype(values) and not pd.api.types.is_bool_dtype(
        values
    )


def _ends(level: float) -> tuple[float, float]:
    return (1.0 - level) / 2.0, (1.0 + level) / 2.0


def quantiles(
    values: Floats, weights: Floats, probabilities: tuple[float, ...]
) -> list[float]:
    """Return quantiles of weighted values.

    Parameters
    ----------
    values : array of float, shape (n,)
    weights : array of float, shape (n,)
        With the sum 1.
    probabilities : tuple of float
    """
    order = np.argsort(values, kind="stable")
    sums = np.cumsum(weights[order]) - 0.5 * weights[order]
    quantile: list[float] = np.interp(probabilities, sums, values[order]).tolist()
    return quantile


def _generations(target: Target) -> pd.DataFrame:
    rows = [
        {
            "generation": number,
            "simulations": generation.count,
            "accepted": generation.accepted,
            "tolerance": generation.tolerance,
            "effective": generation.effective,
        }
        for number, generation in enumerate(target.population.generations)
    ]
    return pd.DataFrame(rows)


def _checks(ranks: pd.DataFrame) -> pd.DataFrame:
    """Return the coverage of credible intervals, and the test of uniform ranks."""
    rows = []
    for name, column in ranks.items() if len(ranks) else ():
        row: dict[str, Any] = {"parameter": name, "data_sets": len(column)}
        row["p"] = uniformity(column.to_numpy(np.float64))
        for level in LEVELS:
            low, high = _ends(level)
            row |= _coverage(level, int(column.between(low, high).sum()), len(column))
        rows.append(row)
    return pd.DataFrame(rows)


def _coverage(level: float, inside: int, count: int) -> Mapping[str, float]:
    interval = binomtest(inside, count).proportion_ci(method="exact")
    name = f"coverage_{100 * level:g}"
    return {
        name: inside / count,
        f"{name}_low": float(interval.low),
        f"{name}_high": float(interval.high),
    }


def uniformity(ranks: Floats) -> float:
    """Return the p value of the hypothesis that ranks are uniform (chi square).

    NaN for fewer than FEWEST_CHECKS ranks.

    Parameters
    ----------
    ranks : array of float, shape (n,)
        From 0 to 1.
    """
    if len(ranks) < FEWEST_CHECKS:
        return float("nan")
    bins = min(MOST_BINS, len(ranks) // PER_BIN)
    counts, _ = np.histogram(ranks, bins=bins, range=(0.0, 1.0))
    return float(chisquare(counts).pvalue)
