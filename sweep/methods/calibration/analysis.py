"""The posterior of a calibrated study, with the checks that tell what it is worth."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.errors import ChoiceError, StoreError
from sweep.methods.calibration.rule import (
    STATISTICS,
    Calibration,
    Prior,
    from_json,
    summarised,
)
from sweep.methods.calibration.strategy import ABOUT, DRAW, values_at_points
from sweep.methods.calibration.targets import (
    DATA,
    FEWEST,
    PRIOR,
    TRUTH,
    Target,
)
from sweep.spec import DISTRIBUTIONS, PLAN, columns_of
from sweep.store import metadata
from sweep.tables import StoredStudy
from sweep.text import unknown

Floats = NDArray[np.float64]
LEVEL = 0.95
LEVELS = (0.5, LEVEL)
"""Probabilities of the credible intervals whose coverage is checked."""
END = 0.05
"""Fraction of a prior that is one of its ends."""
NEAR = 0.01
"""Fraction of the simulations of the prior that are near a data set."""
MOST_COMPARED = 2000
"""Most simulations of the prior that are compared with the data."""
FEWEST_COMPARED = 100
"""Fewest simulations of the prior from which the fit is judged."""
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
        Largest distance of a kept simulation, in spreads of the prior. With summaries
        that are learnt, in fractions of the prior.
    effective : float
        Effective number of kept draws.
    draws : DataFrame
        One row per kept simulation, the nearest first. Columns: weight, with the sum 1;
        distance; generation; the parameters; the summaries.
    simulated : DataFrame
        One row per simulation for the data, in the order of the launch, with the
        columns of `draws` but the weight. The distance of a simulation without a
        summary is infinite. The simulations of generation 0 are from the prior.
    parameters : DataFrame
        One row per parameter with numbers. Columns: parameter, unit, mean, sd, median,
        low and high (the 95 % credible interval), prior_low and prior_high (the same of
        the draws from the prior), first and last. The last two are the probability of
        the first and of the last 5 % of a prior with bounds; else NaN.
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
    simulated: pd.DataFrame
    parameters: pd.DataFrame
    choices: pd.DataFrame
    predictive: pd.DataFrame
    fit: float
    generations: pd.DataFrame
    ranks: pd.DataFrame
    checks: pd.DataFrame


@dataclass(frozen=True, eq=False)
class PosteriorEstimate:
    """The posterior of a parameter, as an estimate with credible intervals.

    Attributes
    ----------
    draws : array of float, shape (n,)
        Kept draws of the parameter.
    weights : array of float, shape (n,)
        With the sum 1.
    times : float, default 1
        Number of independent draws as a multiple of the draws here.
    """

    draws: Floats
    weights: Floats
    times: float = 1.0

    @property
    def value(self) -> float:
        """The posterior mean."""
        return float((self.weights * self.draws).sum())

    @property
    def effective(self) -> float:
        """Effective number of draws (Kish)."""
        return self.times / float((self.weights**2).sum())

    @property
    def testable(self) -> bool:
        """True: where draws are too few, the interval has no bounds."""
        return True

    def interval(
        self,
        confidence: float = LEVEL,
        published: int | None = None,  # noqa: ARG002 (the interface of Estimate)
    ) -> tuple[float, float]:
        """Return the bounds of the equal-tailed credible interval.

        A tail with less probability than one of the independent draws is unknown. The
        interval then has no bounds.

        Parameters
        ----------
        confidence : float, default 0.95
        published : int, optional
            No effect: the trials of the data are part of the posterior.
        """
        tails = _ends(confidence)
        if tails[0] * (self.effective + 1.0) < 1.0:
            return -np.inf, np.inf
        low, high = quantiles(self.draws, self.weights, tails)
        return low, high

    def grown(self, times: float) -> "PosteriorEstimate":
        """Return the same posterior, with `times` as many independent draws.

        More simulations tell the tails, but nothing more of the data.

        Parameters
        ----------
        times : float
        """
        return PosteriorEstimate(self.draws, self.weights, self.times * times)


def is_calibrated(study: StoredStudy) -> bool:
    """Return whether the spec of a stored study has `calibrate`."""
    requests = study.asked
    return requests is not None and ABOUT in (requests.schema.metadata or {})


def check_is_calibrated(study: StoredStudy) -> None:
    """Raise ChoiceError unless the whole of a study with `calibrate` is loaded."""
    if not is_calibrated(study):
        raise ChoiceError(
            'the spec has no "calibrate", so there is no posterior;'
            " see sweep guide calibration",
            study.name,
        )
    if study.restricted:
        raise ChoiceError("a calibration cannot be restricted by where", study.name)


def is_finished(study: StoredStudy) -> bool:
    """Return whether no generation follows in a calibrated study."""
    return bool(described(study)["finished"])


def described(study: StoredStudy) -> dict[str, Any]:
    """Return the description of a calibrated study.

    Raises StoreError if no launch writes such a description.
    """
    assert study.asked is not None
    file = study.store.folder / PLAN
    description = metadata(study.asked.schema, ABOUT, SHAPE, file, remedy=AGAIN)
    try:
        columns = columns_of(study.about.record)
        check_description(description, columns, study.known.profiles)
    except (TypeError, ValueError, OverflowError) as error:
        raise StoreError(f"{file}: {error}; {AGAIN}") from error
    return description


def check_description(
    description: Mapping[str, Any], columns: Sequence[str], profiles: Collection[str]
) -> None:
    """Raise ValueError or TypeError for a description that no launch writes.

    Parameters
    ----------
    description : mapping
        Description of a calibration, with a checked shape.
    columns : sequence of str
        Recorded columns.
    profiles : collection of str
        Known profiles.
    """
    rule = from_json(description["rule"])
    numbers = (rule.draws, rule.population, rule.replicates)
    if min(numbers) < 1 or min(rule.generations, rule.checks) < 0:
        raise ValueError("the numbers of the calibration are not allowed")
    for summary in rule.summaries:
        if summary.column not in (columns if summary.at is None else profiles):
            raise ValueError(f"the summary {summary.column} is not recorded")
        statistic = summary.statistic
        if statistic not in STATISTICS and not 0.0 < float(statistic) < 1.0:
            raise ValueError(f"there is no statistic {statistic}")
        at = summary.at
        if at is not None and (type(at) not in (int, float) or not 0.0 < at < np.inf):
            raise ValueError("a summary has a position that is no number above 0")
    for name, prior in rule.priors.items():
        if prior.form not in DISTRIBUTIONS:
            raise ValueError(f"{name} has no distribution {prior.form}")
    fractions = [fraction for each in description["allowed"] for fraction in each]
    if not all(0.0 < fraction <= 1.0 for fraction in fractions):
        raise ValueError("the fractions of the calibration are not allowed")
    lengths = len(description["allowed"]), len(description["data"])
    if lengths != (rule.checks + 1, len(rule.summaries)) or not rule.priors:
        raise ValueError("the calibration is not complete")


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
    check_is_calibrated(study)
    simulated = StoredSimulations(study, checked=checked)
    target, *checks = simulated.targets()
    ranks = simulated.ranks(checks)
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
        simulated=simulated.every(target),
        parameters=simulated.estimates(target),
        choices=simulated.choices(target),
        predictive=simulated.predictive(target),
        fit=simulated.fit(target),
        generations=_generations(target),
        ranks=ranks,
        checks=_checks(ranks),
    )


class StoredSimulations:
    """The simulations of a stored calibration, in the order of the requests.

    Parameters
    ----------
    study : StoredStudy
    checked : bool, default False
        Whether synthetic data sets are read too, which takes most of the time.

    Attributes
    ----------
    rule : Calibration
    summaries : array of float, shape (simulations, S)
    parameters : DataFrame
        Values of the calibrated parameters, one row per simulation.
    points : Series
        Id of the point of each simulation.
    """

    def __init__(self, study: StoredStudy, *, checked: bool = False) -> None:
        table = study.asked
        assert table is not None
        self.study = study
        self.description = described(study)
        self.rule = rule = from_json(self.description["rule"])
        self._check(table)
        if not checked:
            table = table.filter(pc.equal(table["data_set"], DATA))
        first = slice(None, None, rule.replicates)
        self.number = table["data_set"].to_numpy()[first]
        self.generation = table["generation"].to_numpy()[first]
        drawn = [table[f"{DRAW}{name}"].to_numpy()[first] for name in rule.priors]
        self.draws: Floats = np.stack(drawn, axis=1)
        ids = table["trial_id"].combine_chunks()
        values = self._values(ids)
        self.summaries = summarised(rule.summaries, values)
        plan = study.plan.select(["trial_id", "point", *rule.priors]).to_pandas()
        rows = plan.set_index("trial_id").loc[ids.to_pylist()[first]]
        self.parameters: pd.DataFrame = rows[[*rule.priors]].reset_index(drop=True)
        self.points: pd.Series[str] = rows["point"].reset_index(drop=True)

    def _check(self, table: pa.Table) -> None:
        """Raise StoreError unless the table has whole simulations of trials."""
        rule = self.rule
        kinds = {"data_set": pa.int64(), "generation": pa.int64()}
        kinds |= {f"{DRAW}{name}": pa.float64() for name in rule.priors}
        kinds["trial_id"] = pa.string()
        fits = len(table) > 0 and not len(table) % rule.replicates
        for name, kind in kinds.items():
            fits = fits and name in table.column_names
            fits = fits and table.schema.field(name).type == kind
            fits = fits and not table[name].null_count
        if fits:
            ids = table["trial_id"]
            fits = len(pc.unique(ids)) == len(ids)
            numbers = table["data_set"].to_numpy()
            fits = fits and 0 <= numbers.min() <= numbers.max() <= rule.checks
            fits = fits and {*rule.priors} <= {*self.study.plan.column_names}
            draws = [table[f"{DRAW}{name}"].to_numpy() for name in rule.priors]
            fits = fits and all(
                ((drawn >= 0.0) & (drawn < 1.0)).all() for drawn in draws
            )
        if not fits:
            file = self.study.store.folder / PLAN
            raise StoreError(f"{file}: the simulations are not complete; {AGAIN}")

    def _values(self, ids: pa.Array) -> dict[str, Floats]:
        """Return the values of the columns, shape (simulations, trials)."""
        rule = self.rule
        stored = self.study.read("trials", ids).to_pandas()
        indexed = stored.set_index("trial_id").reindex(
            columns=[*rule.columns, "status"]
        )
        rows = indexed.reindex(ids.to_pylist())
        shape = len(ids) // rule.replicates, rule.replicates
        missing = rows["status"].isna().to_numpy()
        self.missing = int(missing.sum())
        self.stored = ~missing.reshape(shape).any(axis=1)
        values = {
            name: rows[name].to_numpy(np.float64, na_value=np.nan).reshape(shape)
            for name in rule.columns
        }
        at_points = values_at_points(self.study, rule, ids)
        return values | {
            name: column.reshape(shape) for name, column in at_points.items()
        }

    def rows(self, number: int, generation: int) -> NDArray[np.bool_]:
        """Return which simulations belong to a generation of a data set.

        Parameters
        ----------
        number : int
            Number of the data set.
        generation : int

        Returns
        -------
        array of bool, shape (simulations,)
        """
        rows: NDArray[np.bool_]
        rows = (self.number == number) & (self.generation == generation)
        return rows

    def targets(self) -> list[Target]:
        """Return the data, and the synthetic data sets, with their whole generations.

        A generation that still runs does not count: its weights would count simulations
        without a distance.

        Raises
        ------
        StoreError
            No simulation for the data has all summaries.
        """
        data = np.array(self.description["data"], np.float64)
        targets = list[Target]()
        for number in np.unique(self.number).tolist():
            if number != DATA:
                truth = self.rows(number, TRUTH)
                if truth.sum() != 1 or not self.stored[truth].all():
                    continue
                (data,) = self.summaries[truth]
            prior = self.rows(number, PRIOR)
            complete = prior.any() and self.stored[prior].all()
            if not complete or not np.isfinite(data).all():
                continue
            target = Target(number, data, self.rule)
            target.begin(self.draws[prior], self.summaries[prior])
            self._continue(target)
            targets.append(target)
        has_data = targets and targets[0].number == DATA
        if not has_data:
            raise StoreError(
                "no simulation has all summaries yet; launch the study",
                self.study.name,
            )
        if not len(targets[0].population.nearest):
            columns = ", ".join(map(str, self.rule.sources))
            raise StoreError(
                f"no simulation has all summaries: no trials have values of {columns}",
                self.study.name,
            )
        return targets

    def _continue(self, target: Target) -> None:
        """Add the whole generations of a data set after the prior."""
        allowed = self.description["allowed"][target.number]
        for generation, fraction in enumerate(allowed, start=1):
            rows = self.rows(target.number, generation)
            some = len(target.population.nearest) >= FEWEST
            if not some or not rows.any() or not self.stored[rows].all():
                return
            target.add(self.draws[rows], self.summaries[rows], fraction)

    def places(self, target: Target) -> NDArray[np.intp]:
        """Return the simulations of a data set, in the order of its population.

        Parameters
        ----------
        target : Target
        """
        generations = range(len(target.population.generations))
        rows = [self.rows(target.number, generation) for generation in generations]
        return np.concatenate([np.flatnonzero(some) for some in rows])

    def kept(self, target: Target) -> pd.DataFrame:
        """Return the kept simulations of a data set, the nearest first."""
        population = target.population
        table = self.every(target).iloc[population.nearest].reset_index(drop=True)
        table.insert(0, "weight", population.weights)
        return table

    def every(self, target: Target) -> pd.DataFrame:
        """Return all simulations of a data set, in the order of the launch.

        Parameters
        ----------
        target : Target
        """
        places = self.places(target)
        table = pd.DataFrame(
            {
                "distance": target.population.distances,
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
        table = self.kept(target)
        weights = target.population.weights
        prior = self.rows(DATA, PRIOR)
        drawn_from = target.population.draws[target.population.nearest]
        rows = []
        for place, (name, form) in enumerate(self.rule.priors.items()):
            values = table[name]
            if not is_number(values):
                continue
            drawn = values.to_numpy(np.float64)
            mean = float((weights * drawn).sum())
            median, low, high = quantiles(drawn, weights, (0.5, *_ends(LEVEL)))
            before = self.parameters.loc[prior, name].to_numpy(np.float64)
            usual = quantiles(
                before, np.full(len(before), 1.0 / len(before)), _ends(LEVEL)
            )
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
                    **_ends_of_prior(form, drawn_from[:, place], weights),
                }
            )
        return pd.DataFrame(rows)

    def choices(self, target: Target) -> pd.DataFrame:
        """Return the probabilities of the values of parameters without numbers."""
        table = self.kept(target)
        rows = []
        for name, prior in self.rule.priors.items():
            if DISTRIBUTIONS[prior.form].kind != "listed" or is_number(table[name]):
                continue
            drawn = self.parameters.loc[self.rows(DATA, PRIOR), name]
            for value in prior.arguments:
                chosen = (table[name] == value).to_numpy()
                rows.append(
                    {
                        "parameter": name,
                        "value": value,
                        "prior": float((drawn == value).mean()),
                        "posterior": float(target.population.weights[chosen].sum()),
                    }
                )
        return pd.DataFrame(rows, columns=["parameter", "value", "prior", "posterior"])

    def predictive(self, target: Target) -> pd.DataFrame:
        """Return the summaries of the kept simulations beside those of the data."""
        summaries = self.summaries[self.places(target)[target.population.nearest]]
        weights = target.population.weights
        prior = self.summaries[self.rows(DATA, PRIOR)]
        rows = []
        for place, label in enumerate(self.words):
            low, high = quantiles(summaries[:, place], weights, _ends(LEVEL))
            rows.append(
                {
                    "summary": label,
                    "data": float(target.data[place]),
                    "mean": float((weights * summaries[:, place]).sum()),
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
        prior = self.summaries[self.rows(DATA, PRIOR)]
        scaled = target.distance.scaled(prior[np.isfinite(prior).all(axis=1)])
        near = max(1, round(NEAR * len(scaled)))
        if len(scaled) < FEWEST_COMPARED:
            return float("nan")
        from scipy.spatial import cKDTree  # 0.3 s to import

        tree = cKDTree(scaled)
        data = target.distance.scaled(target.data[None])
        away = np.reshape(tree.query(data, k=near)[0], (1, -1)).mean()
        # The nearest simulation of a simulation is itself.
        usual = tree.query(scaled[:MOST_COMPARED], k=near + 1)[0][:, 1:].mean(axis=1)
        return float((1 + (usual >= away).sum()) / (1 + len(usual)))

    def ranks(self, targets: list[Target]) -> pd.DataFrame:
        """Return the rank of the true draw of each synthetic data set."""
        rows = []
        for target in targets:
            (truth,) = self.draws[self.rows(target.number, TRUTH)]
            population = target.population
            drawn = population.draws[population.nearest]
            below = (drawn < truth) + 0.5 * (drawn == truth)
            rank = (population.weights[:, None] * below).sum(axis=0)
            # The rank among K draws has K + 1 values, each equally likely.
            draws = population.effective
            rows.append((draws * rank + 0.5) / (draws + 1.0))
        return pd.DataFrame(rows, columns=[*self.rule.priors])


def posterior_estimate(
    study: StoredStudy, parameter: str
) -> tuple[PosteriorEstimate, int]:
    """Return the posterior of a parameter, and the number of trials behind it.

    The trials of synthetic data sets do not count.

    Parameters
    ----------
    study : StoredStudy
    parameter : str
        A parameter with numbers.

    Raises
    ------
    ChoiceError
        The spec has no `calibrate`, or no such parameter with numbers.
    StoreError
        The plan is damaged, or no simulation has all summaries.
    """
    estimates = posterior(study, checked=False)
    numbers = estimates.parameters["parameter"].tolist()
    if parameter not in numbers:
        raise ChoiceError(unknown("calibrated number", parameter, numbers), study.name)
    estimate = PosteriorEstimate(
        estimates.draws[parameter].to_numpy(np.float64),
        estimates.draws["weight"].to_numpy(np.float64),
    )
    return estimate, estimates.simulations * estimates.rule.replicates


def is_number(values: "pd.Series[Any]") -> bool:
    """Return whether values are numbers, and not truth values."""
    return pd.api.types.is_numeric_dtype(values) and not pd.api.types.is_bool_dtype(
        values
    )


def _ends_of_prior(prior: Prior, draws: Floats, weights: Floats) -> Mapping[str, float]:
    """Return the posterior probability of both ends of a prior with bounds.

    Parameters
    ----------
    prior : Prior
    draws : array of float, shape (n,)
        Kept draws in the unit interval.
    weights : array of float, shape (n,)
    """
    distribution = DISTRIBUTIONS[prior.form]
    if not distribution.bounded or distribution.kind == "listed":
        return {"first": np.nan, "last": np.nan}
    return {
        "first": float(weights[draws < END].sum()),
        "last": float(weights[draws >= 1.0 - END].sum()),
    }


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
            "simulations": generation.size,
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
    from scipy.stats import binomtest

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
    from scipy.stats import chisquare

    bins = min(MOST_BINS, len(ranks) // PER_BIN)
    counts, _ = np.histogram(ranks, bins=bins, range=(0.0, 1.0))
    return float(chisquare(counts).pvalue)
