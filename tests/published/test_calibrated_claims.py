"""Claims on a calibrated parameter, judged by its posterior."""

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import norm

from sweep.cli.progress import ProgressBar
from sweep.errors import ChoiceError, SpecError
from sweep.loaded import LoadedStudy
from sweep.methods.calibration.analysis import PosteriorEstimate, posterior_estimate
from sweep.published.estimates import MeasureError, measure
from sweep.published.judging import judged, stored_studies
from sweep.published.measures import CalibratedParameter
from sweep.published.publications import read_all
from sweep.published.reproducing import reproduce
from sweep.published.verdicts import Above, Within, judge
from sweep.workers.executors import Serial
from tests.plotted import SPECS, study
from tests.publications import experiments

DATA = SPECS["small"].replace("study: small", "study: tiny/small")
FIT = SPECS["calibrated"].replace("study: calibrated", "study: tiny/fit")
FIT = FIT.replace('"small:', '"tiny/small:')
PUBLISHED = """
title: A tiny study
source: "Nobody (2024), <nowhere>"
specs:
  small: {}
  fit: {}
claims:
  - id: weight
    where: "Abstract"
    says: "the weight is below 2"
    kind: reading
    registered: 2024-03-01
    spec: fit
    measure: {calibrated: separation_weight}
    expect: {within: [-1, 3]}
    looked: before
"""


def normal(draws: int) -> PosteriorEstimate:
    """Quantiles of a standard normal posterior."""
    probabilities = (np.arange(draws) + 0.5) / draws
    weights = np.full(draws, 1.0 / draws)
    return PosteriorEstimate(norm.ppf(probabilities), weights)


def test_the_interval_is_that_of_the_posterior() -> None:
    estimate = normal(2000)
    assert estimate.value == pytest.approx(0.0, abs=1e-12)
    assert estimate.effective == pytest.approx(2000.0)
    for confidence in (0.5, 0.95, 0.99):
        high = norm.ppf(0.5 + confidence / 2.0)
        # Between two of 2,000 quantiles the bound is on a straight line.
        assert estimate.interval(confidence) == pytest.approx((-high, high), abs=1e-3)
    assert estimate.grown(100.0).interval(0.95) == estimate.interval(0.95)


def test_a_tail_without_a_draw_has_no_bound_and_more_draws_may_tell() -> None:
    few = normal(100)
    assert few.interval(0.99) == (-np.inf, np.inf)
    assert np.isfinite(normal(500).interval(0.99)).all()
    verdict = judge(few, Within(-9.0, 9.0), family=5, trials=100)
    assert (verdict.status, verdict.weak) == ("undecided", True)
    # The tail of 0.5 % has one of 199 draws.
    assert verdict.needed == 200


def test_verdicts_follow_from_the_credible_interval() -> None:
    estimate = normal(2000)
    statuses = [
        judge(estimate, expect, family, trials=100).status
        for expect in (Within(-2.2, 2.2), Above(3.0), Above(-1.0))
        for family in (1, 5)
    ]
    assert statuses == [
        *("confirmed", "undecided"),
        *("refuted", "refuted"),
        *("undecided", "undecided"),
    ]
    undecided = judge(estimate, Above(-1.0), family=1, trials=100)
    assert undecided.needed is None  # more simulations tell no more of the data


def test_a_claim_on_a_parameter_is_judged(tmp_path: Path) -> None:
    folder = experiments(tmp_path, PUBLISHED, DATA)
    (folder / "tiny" / "fit.yaml").write_text(FIT)
    (tiny,) = publications = read_all(folder, quick=False)
    assert tiny.claims[0].measure == CalibratedParameter("fit", "separation_weight")
    results = tmp_path / "results"
    outcome = reproduce(publications, results, Serial(), ProgressBar)
    assert outcome.failures == []
    ([row], failures) = judged(tiny, stored_studies(tiny, results))
    assert (row.verdict.status, failures) == ("confirmed", [])
    assert row.measured is not None
    expected = LoadedStudy("tiny/fit", results).posterior().parameters
    (of_study,) = expected.to_dict("records")
    assert row.measured.estimate.value == pytest.approx(of_study["mean"], rel=1e-12)
    assert row.verdict.interval == pytest.approx((of_study["low"], of_study["high"]))
    # 60 draws from the prior and a generation of 50, of 3 trials each.
    assert (row.measured.used, row.measured.left_out) == (330, 0)
    assert row.measured.trials.startswith("330, and ")


def test_what_is_not_calibrated_has_no_posterior(tmp_path: Path) -> None:
    with pytest.raises(MeasureError, match='the spec has no "calibrate"'):
        measure(
            {"fit": study("small")}, CalibratedParameter("fit", "separation_weight"), {}
        )
    with pytest.raises(ChoiceError, match="unknown calibrated number"):
        posterior_estimate(study("calibrated"), "noise")
    for old, new, message in (
        ("spec: fit", "spec: small", 'has no "calibrate"'),
        ("separation_weight}", "separation_wait}", 'did you mean "separation_weight"'),
        ("separation_weight}", "separation_weight, for: {n: 1}}", 'unknown key "for"'),
    ):
        folder = experiments(tmp_path / old, PUBLISHED.replace(old, new), DATA)
        (folder / "tiny" / "fit.yaml").write_text(FIT)
        with pytest.raises(SpecError) as raised:
            read_all(folder, quick=False)
        assert message in str(raised.value)
