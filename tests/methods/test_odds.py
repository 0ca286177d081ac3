"""Odds of models: known Bayes factors, bounds without simulations, and bad input."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binomtest

from sweep.campaigns.launching import launch
from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.loaded import LoadedStudy
from sweep.methods.calibration.evidence import (
    BoundedEstimate,
    PriorSimulations,
    evidence,
    probabilities,
    ratio,
    told_apart,
    total,
)
from sweep.methods.calibration.report import odds_report
from sweep.spec.study import parse_spec
from sweep.trial.result import Result, failed
from sweep.workers.executors import Serial
from tests.cases import slow_but
from tests.methods.measured_calibration import exact_evidence, factors
from tests.methods.test_calibration import DATA, SMALL, normal
from tests.searches import replace_trials

Floats = NDArray[np.float64]
NARROW = SMALL.replace("study: fit", "study: narrow").replace("[0, 3]", "[0, 2]")
FAR = SMALL.replace("study: fit", "study: far").replace("[0, 3]", "[40, 43]")
NORMAL = 1.959963984540054


def stored(
    results: Path, monkeypatch: pytest.MonkeyPatch, *specs: str
) -> list[LoadedStudy]:
    """The studies of some specs, after the data are stored."""
    replace_trials(monkeypatch, normal)
    studies = [parse_spec(text) for text in (DATA, *specs)]
    for study in studies:
        launch(study, results, Serial())
    return [LoadedStudy(study.name, results) for study in studies[1:]]


def test_the_bayes_factor_is_the_exact_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wide, narrow, far = stored(tmp_path, monkeypatch, SMALL, NARROW, FAR)
    odds = wide.odds(narrow, far)
    data = LoadedStudy("data", tmp_path).trials["speed"].mean()
    rows = odds.models.set_index("study")
    (spread,) = odds.summaries["spread"]
    likely = [
        exact_evidence(data, odds.tolerance * spread, largest) for largest in (3.0, 2.0)
    ]
    for name, value in zip(("fit", "narrow"), likely, strict=True):
        row = rows.loc[name]
        error = math.log(row["evidence_high"] / row["evidence"]) / NORMAL
        # Four standard errors, beyond which an estimate is in 1 of 16,000 cases.
        assert abs(math.log(row["evidence"] / value)) < 4.0 * error
    assert rows["probability"].sum() == pytest.approx(1.0)
    assert rows.loc["far", "evidence"] == 0.0
    # No draw of 100 is near: 97.5 % sure that fewer than 1 in 27 would be.
    bound = 1.0 - 0.025 ** (1.0 / 100.0)
    assert rows.loc["far", "evidence_high"] == pytest.approx(bound)
    assert 0.0 < rows.loc["far", "probability_high"] < 0.5
    assert rows.loc["far", "fit"] < 0.05
    first, *_ = odds_report(odds).parts
    assert str(first).startswith("misfit: only <1 % of data sets from the prior of far")
    apart = odds.told_apart.set_index(["study", "judged"])
    assert apart.loc[("far", "far"), "right"] == 1.0
    assert apart.loc[("fit", "far"), "probability"] == 0.0


@pytest.mark.parametrize("generations", slow_but([2], [0, 2]))
def test_intervals_of_bayes_factors_cover_the_truth(generations: int) -> None:
    """Of 200 data sets; the two-sided test fails by chance in 1 of 1,000 cases."""
    rows = factors(generations, 0.4, 200, 400)
    enough = [each for each in rows if each[2] >= 10.0]
    inside = sum(factor.low <= true <= factor.high for factor, true, _ in enough)
    assert len(enough) > 150
    assert binomtest(inside, len(enough), 0.95).pvalue > 0.001


@pytest.mark.slow
def test_intervals_of_few_simulations_cover_more_than_they_say() -> None:
    rows = factors(0, 0.025, 200, 400)
    rough = [each for each in rows if each[2] < 10.0]
    inside = sum(factor.low <= true <= factor.high for factor, true, _ in rough)
    assert len(rough) > 50
    assert binomtest(inside, len(rough), 0.95, alternative="less").pvalue > 0.001


def test_ratios_and_probabilities_of_evidences() -> None:
    one, two = BoundedEstimate(0.02, 0.016, 0.025), BoundedEstimate(0.01, 0.008, 0.0125)
    factor = ratio(one, two)
    # Equal errors of two logarithms add as squares.
    assert factor.value == pytest.approx(2.0)
    assert factor.high == pytest.approx(2.0 * 1.25 ** math.sqrt(2.0))
    assert factor.low == pytest.approx(2.0 / 1.25 ** math.sqrt(2.0))
    shares = probabilities([one, two])
    assert [each.value for each in shares] == pytest.approx([2 / 3, 1 / 3])
    for own, against in (shares, shares[::-1]):
        assert own.low == pytest.approx(1.0 - against.high)
    summed = total([one, two])
    assert summed.value == pytest.approx(0.03)
    assert summed.high == pytest.approx(0.03 + math.hypot(0.005, 0.0025))


def test_a_model_without_simulations_near_the_data_has_a_bound() -> None:
    near, none = BoundedEstimate(0.02, 0.016, 0.025), BoundedEstimate(0.0, 0.0, 0.004)
    factor = ratio(none, near)
    assert factor == BoundedEstimate(0.0, 0.0, 0.004 / 0.016)
    assert ratio(none, BoundedEstimate(0.02, 0.0, 0.03)).high == math.inf
    best, worst = probabilities([near, none])
    assert best.value == 1.0
    assert best.low == pytest.approx(1.0 / (1.0 + factor.high))
    assert worst.high == pytest.approx(1.0 - best.low)
    assert probabilities([near]) == [BoundedEstimate(1.0, 1.0, 1.0)]


def prior(features: Floats, draws: Floats, name: str = "weight") -> PriorSimulations:
    """Simulations of the prior of a model with one parameter."""
    return PriorSimulations(features, {name: draws})


def test_models_are_told_apart_as_well_as_their_summaries_differ() -> None:
    rng = np.random.default_rng(6)
    same = [prior(rng.normal(size=(500, 2)), rng.random(500)) for _ in range(2)]
    # Each of 200 data sets is right with probability 1/2; four standard errors.
    error = 4.0 * math.sqrt(0.25 / 200)
    for number, (right, shares) in enumerate(told_apart(same)):
        assert right == pytest.approx(0.5, abs=error)
        assert shares[number] == pytest.approx(0.5, abs=0.1)
    away = prior(same[1].features + 100.0, same[1].draws["weight"])
    assert [right for right, _ in told_apart([same[0], away])] == [1.0, 1.0]
    # Equal distances favour no model, of whatever number of simulations.
    constant = [prior(np.zeros((size, 1)), rng.random(size)) for size in (300, 200)]
    for right, shares in told_apart(constant):
        assert right == 0.5
        assert shares.tolist() == pytest.approx([0.5, 0.5])


def test_simulations_with_equal_draws_are_no_evidence_for_another_model() -> None:
    """Studies with equal seeds share draws: one model has the twin of a data set."""
    rng = np.random.default_rng(8)
    draws = rng.random(500)
    features = [(draws + 0.01 * rng.normal(size=500)).reshape(-1, 1) for _ in range(2)]
    models = [prior(each, draws) for each in features]
    error = 4.0 * math.sqrt(0.25 / 200)
    for right, _ in told_apart(models):
        assert right == pytest.approx(0.5, abs=error)
    twins = [prior(features[0], draws)] * 2
    for right, _ in told_apart(twins):
        assert right == 0.5


def test_evidence_of_a_model_that_is_always_near_is_at_most_one() -> None:
    near = np.ones(100, np.bool_)
    probability = evidence(np.ones(100), near, 100).probability
    # 97.5 % sure that more than 96 of 100 are near (Clopper and Pearson).
    assert probability == pytest.approx((1.0, 0.025 ** (1.0 / 100.0), 1.0))
    near[:2] = False
    assert evidence(np.ones(100), near, 100).probability.high < 1.0


def test_odds_of_models_that_mostly_fail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Failed trials are no simulations near the data, however few are left."""

    def fragile(job: Job) -> Result:
        weight = float(job.settings["separation_weight"])
        return normal(job) if 1.3 < weight < 1.8 else failed(job, 0.0, "broken")

    replace_trials(monkeypatch, fragile)
    specs = [f"{text}on_error: record\n" for text in (SMALL, NARROW)]
    for text in (DATA, *specs):
        launch(parse_spec(text), tmp_path, Serial())
    wide, narrow = (LoadedStudy(name, tmp_path) for name in ("fit", "narrow"))
    odds = wide.odds(narrow)
    assert odds.told_apart.empty
    assert math.isfinite(odds.tolerance)
    complete = [each.posterior().draws.shape[0] for each in (wide, narrow)]
    assert (odds.models["near"] <= complete).all()
    assert (odds.models["evidence"] < 1.0).all()
    report = odds_report(odds)
    text = " ".join(part for part in report.parts if isinstance(part, str))
    assert "the fit of fit was not tested" in text
    assert "whether the summaries tell the models apart was not tested" in text
    assert json.loads(report.to_json())["models"][0]["fit"] is None


def test_what_no_odds_compare(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = SMALL.replace("study: fit", "study: other")
    other = other.replace("summaries: [speed]", "summaries: {speed: sd}")
    fewer = SMALL.replace("study: fit", "study: fewer")
    fewer = fewer.replace("replicates: 4", "replicates: 3")
    studies = stored(tmp_path, monkeypatch, SMALL, other, fewer)
    wide, differs, few = studies
    with pytest.raises(ChoiceError, match=r"different summaries.*other has sd of"):
        wide.odds(differs)
    with pytest.raises(ChoiceError, match=r"different replicates.*fewer has 3"):
        wide.odds(few)
    with pytest.raises(ChoiceError, match="odds need at least two studies"):
        wide.odds()
    with pytest.raises(ChoiceError, match="the study is named twice"):
        wide.odds(wide)
    with pytest.raises(ChoiceError, match='data: the spec has no "calibrate"'):
        wide.odds(LoadedStudy("data", tmp_path))
    with pytest.raises(ChoiceError, match="cannot be restricted by where"):
        wide.where("separation_weight > 1").odds(few)
