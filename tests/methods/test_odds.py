"""Odds of models: known Bayes factors, bounds without simulations, and bad input."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from sweep.campaigns.launching import launch
from sweep.errors import ChoiceError
from sweep.loaded import LoadedStudy
from sweep.methods.calibration.evidence import (
    BoundedEstimate,
    probabilities,
    ratio,
    told_apart,
    total,
)
from sweep.methods.calibration.report import odds_report
from sweep.spec.study import parse_spec
from sweep.workers.executors import Serial
from tests.methods.measured_calibration import exact_evidence, factors
from tests.methods.test_calibration import DATA, SMALL, normal
from tests.searches import replace_trials

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


@pytest.mark.parametrize("generations", [0, 2])
def test_intervals_of_bayes_factors_cover_the_truth(generations: int) -> None:
    """Of 200 data sets; the two-sided test fails by chance in 1 of 1,000 cases."""
    rows = factors(generations, 0.4, 200, 400)
    enough = [each for each in rows if each[2] >= 10.0]
    inside = sum(factor.low <= true <= factor.high for factor, true, _ in enough)
    assert len(enough) > 150
    assert binomtest(inside, len(enough), 0.95).pvalue > 0.001


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


def test_models_are_told_apart_as_well_as_their_summaries_differ() -> None:
    rng = np.random.default_rng(6)
    same = [rng.normal(size=(500, 2)) for _ in range(2)]
    rows = told_apart(same)
    # Each of 200 data sets is right with probability 1/2; four standard errors.
    for number, (right, shares) in enumerate(rows):
        assert right == pytest.approx(0.5, abs=4.0 * math.sqrt(0.25 / 200))
        assert shares[number] == pytest.approx(0.5, abs=0.1)
    rows = told_apart([same[0], same[1] + 100.0])
    assert [right for right, _ in rows] == [1.0, 1.0]
    # Equal distances favour no model.
    for right, shares in told_apart([np.zeros((300, 1)), np.zeros((300, 1))]):
        assert right < 0.51
        assert shares.tolist() == pytest.approx([0.5, 0.5], abs=0.001)


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
