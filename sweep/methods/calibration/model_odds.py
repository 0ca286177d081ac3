"""The odds of several models, from stored calibrations to the same data."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from sweep.errors import ChoiceError
from sweep.methods.calibration.analysis import (
    FEWEST_COMPARED,
    StoredSimulations,
    check_is_calibrated,
)
from sweep.methods.calibration.distances import Distance
from sweep.methods.calibration.evidence import (
    Evidence,
    PriorSimulations,
    evidence,
    probabilities,
    ratio,
    told_apart,
)
from sweep.methods.calibration.targets import Target
from sweep.tables import StoredStudy

Floats = NDArray[np.float64]
TOLERANCES = (1.0, 1.5, 2.0, 3.0)
"""Tolerances at which odds are computed, as multiples of the smallest."""
DIFFERENT = "the studies have different {}, so no odds compare them: {}"


@dataclass(frozen=True, eq=False)
class Odds:
    """Odds of several models, given data.

    Attributes
    ----------
    to : str
        The stored trials that are the data.
    data_trials : int
        Number of trials of the data.
    summaries : DataFrame
        One row per summary. Columns: summary, data, spread (the robust spread over the
        pooled draws from all priors).
    tolerance : float
        Distance within which a simulation counts, in spreads.
    models : DataFrame
        One row per study. Columns: study; model; simulations; near, the number of
        simulations within the tolerance; effective, the number of independent draws of
        equal precision; evidence; factor, the Bayes factor against the largest
        evidence; probability; and fit, see `Posterior.fit`. Columns with _low and _high
        have the 95 % confidence intervals of evidence, factor and probability.
        Further columns: finished, true if no generation follows; missing, the number of
        requested trials that are not stored.
    tolerances : DataFrame
        One row per tolerance and study. Columns: tolerance, study, near, probability,
        probability_low, probability_high.
    told_apart : DataFrame
        One row per study and judged study. Columns: study, the source of the synthetic
        data sets; right, the fraction of data sets whose most probable study is the
        source; judged; and probability, the mean over the data sets. Empty if a prior
        has too few simulations with all summaries.
    """

    to: str
    data_trials: int
    summaries: pd.DataFrame
    tolerance: float
    models: pd.DataFrame
    tolerances: pd.DataFrame
    told_apart: pd.DataFrame


def odds(studies: Sequence[StoredStudy]) -> Odds:
    """Return the odds of models that are calibrated to the same data.

    Before the data, all models are equally probable. Distances compare the summaries,
    also if a study has `learnt`.

    Parameters
    ----------
    studies : sequence of StoredStudy
        At least two studies with the same data, summaries and number of replicates.

    Raises
    ------
    ChoiceError
        There are fewer than two studies, or a study is named twice, has no `calibrate`
        or is restricted by `where`; or the studies differ in the data.
    StoreError
        A plan is damaged, or a study has no simulation with all summaries.
    """
    _check_names([study.name for study in studies])
    for study in studies:
        check_is_calibrated(study)
    calibrated = [_Calibrated(StoredSimulations(study)) for study in studies]
    _check_same(calibrated)
    draws = min(len(each.prior) for each in calibrated)
    pooled = np.concatenate([each.prior[:draws] for each in calibrated])
    distance = Distance.of_prior(np.empty((len(pooled), 0)), pooled, learnt=False)
    for each in calibrated:
        each.measure(distance)
    tolerance = _smallest_tolerance(calibrated)
    first = calibrated[0].simulations
    return Odds(
        to=first.rule.to,
        data_trials=first.description["data_trials"],
        summaries=pd.DataFrame(
            {
                "summary": first.words,
                "data": calibrated[0].target.data,
                "spread": distance.spread,
            }
        ),
        tolerance=tolerance,
        models=_models(calibrated, tolerance),
        tolerances=_tolerances(calibrated, tolerance),
        told_apart=_told_apart(calibrated, distance),
    )


def _check_names(names: Sequence[str]) -> None:
    if len(names) < 2:
        raise ChoiceError("odds need at least two studies", *names)
    twice = [name for name in dict.fromkeys(names) if names.count(name) > 1]
    if twice:
        raise ChoiceError("the study is named twice", twice[0])


class _Calibrated:
    """A calibrated study with the distances of its simulations from the data."""

    def __init__(self, simulations: StoredSimulations) -> None:
        self.simulations = simulations
        self.target: Target = simulations.targets()[0]
        self.summaries = simulations.summaries[simulations.places(self.target)]
        generations = self.target.population.generations
        self.prior: Floats = self.summaries[: generations[0].size]
        population = self.target.population
        density = 1.0 / generations[0].allowed
        self.weights: Floats = density / population.mixture(population.draws)
        self.distances: Floats = np.empty(0)

    @property
    def name(self) -> str:
        """The name of the study."""
        return self.simulations.study.name

    def measure(self, distance: Distance) -> None:
        """Set the distances from the data.

        Parameters
        ----------
        distance : Distance
            Distance that is common to all models.
        """
        self.distances = distance.between(self.summaries, self.target.data)

    @property
    def finite(self) -> Floats:
        """The distances of the simulations with all summaries, the smallest first."""
        return np.sort(self.distances[np.isfinite(self.distances)])

    def evidence(self, tolerance: float) -> Evidence:
        """Return the evidence of the model at a tolerance, in spreads."""
        near = np.isfinite(self.distances) & (self.distances <= tolerance)
        return evidence(self.weights, near, len(self.prior))

    def complete_prior(self, distance: Distance) -> PriorSimulations:
        """Return the draws from the prior that have all summaries.

        Parameters
        ----------
        distance : Distance
        """
        complete = np.isfinite(self.prior).all(axis=1)
        parameters = self.simulations.rule.priors
        draws = self.target.population.draws[: len(self.prior)][complete]
        return PriorSimulations(
            distance.scaled(self.prior[complete]),
            dict(zip(parameters, draws.T, strict=True)),
        )


def _smallest_tolerance(calibrated: Sequence[_Calibrated]) -> float:
    """Return the smallest tolerance at which one study has enough simulations.

    If no study has enough, the tolerance admits all simulations with all summaries.
    """
    size = min(each.simulations.rule.population for each in calibrated)
    distances = [each.finite for each in calibrated]
    enough = [each[size - 1] for each in distances if len(each) >= size]
    return float(min(enough) if enough else max(each[-1] for each in distances))


def _check_same(calibrated: Sequence[_Calibrated]) -> None:
    """Raise ChoiceError unless all studies are calibrated to the same data."""
    facts: dict[str, list[str]] = {
        "data": [each.simulations.rule.to for each in calibrated],
        "summaries": [", ".join(each.simulations.words) for each in calibrated],
        "replicates": [str(each.simulations.rule.replicates) for each in calibrated],
        "numbers of trials of the data": [
            str(each.simulations.description["data_trials"]) for each in calibrated
        ],
        "values of the data": [
            ", ".join(map(str, each.target.data.tolist())) for each in calibrated
        ],
    }
    for fact, values in facts.items():
        if len(set(values)) > 1:
            list_of_values = "; ".join(
                f"{each.name} has {value}"
                for each, value in zip(calibrated, values, strict=True)
            )
            raise ChoiceError(DIFFERENT.format(fact, list_of_values))


def _models(calibrated: Sequence[_Calibrated], tolerance: float) -> pd.DataFrame:
    evidences = [each.evidence(tolerance) for each in calibrated]
    estimates = [each.probability for each in evidences]
    best = max(estimates, key=lambda estimate: estimate.value)
    shares = probabilities(estimates)
    rows = []
    for each, own, share in zip(calibrated, evidences, shares, strict=True):
        simulations = each.simulations
        estimate = own.probability
        is_best = estimate is best
        factor = ratio(estimate, best)
        rows.append(
            {
                "study": each.name,
                "model": str(simulations.study.provenance["model"]),
                "simulations": len(each.distances),
                "near": own.near,
                "effective": own.effective,
                "evidence": estimate.value,
                "evidence_low": estimate.low,
                "evidence_high": estimate.high,
                "factor": factor.value,
                "factor_low": 1.0 if is_best else factor.low,
                "factor_high": 1.0 if is_best else factor.high,
                "probability": share.value,
                "probability_low": share.low,
                "probability_high": share.high,
                "fit": simulations.fit(each.target),
                "finished": simulations.description["finished"],
                "missing": simulations.missing,
            }
        )
    return pd.DataFrame(rows)


def _tolerances(calibrated: Sequence[_Calibrated], smallest: float) -> pd.DataFrame:
    rows = []
    for tolerance in dict.fromkeys(multiple * smallest for multiple in TOLERANCES):
        evidences = [each.evidence(tolerance) for each in calibrated]
        shares = probabilities([own.probability for own in evidences])
        for each, own, share in zip(calibrated, evidences, shares, strict=True):
            rows.append(
                {
                    "tolerance": tolerance,
                    "study": each.name,
                    "near": own.near,
                    "probability": share.value,
                    "probability_low": share.low,
                    "probability_high": share.high,
                }
            )
    return pd.DataFrame(rows)


def _told_apart(calibrated: Sequence[_Calibrated], distance: Distance) -> pd.DataFrame:
    priors = [each.complete_prior(distance) for each in calibrated]
    columns = ["study", "right", "judged", "probability"]
    if min(len(each.features) for each in priors) < FEWEST_COMPARED:
        return pd.DataFrame(columns=columns)
    models = [each.name for each in calibrated]
    rows = []
    for source, (right, shares) in zip(models, told_apart(priors), strict=True):
        for judged, share in zip(models, shares.tolist(), strict=True):
            rows.append((source, right, judged, share))
    return pd.DataFrame(rows, columns=columns)
