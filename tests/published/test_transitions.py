"""Claims on the order of a transition, judged by what the sizes of a study tell."""

import json
from pathlib import Path

import pandas as pd
import pytest

from sweep.campaigns.launching import launch
from sweep.cli.progress import ProgressBar
from sweep.errors import SpecError
from sweep.methods.scaling import Scaling
from sweep.published.foresight import outlooks
from sweep.published.judging import judged, stored_studies
from sweep.published.measures import Transition
from sweep.published.publications import read_all
from sweep.published.reproducing import reproduce
from sweep.published.scorecard import ours_text, published_text
from sweep.published.verdicts import OfOrder, Status, judge_order
from sweep.workers.executors import Serial
from tests.analysis.test_coexistence import continuous, jumping
from tests.publications import experiments

SPEC = """
study: tiny/small
model: vicsek1995
fixed: {steps: 40}
sizes: {n: [16, 36]}
sweep: {noise: [2, 6]}
replicates: 8
seed: 1
record: {series: [polarization, speed], every: 1}
"""
PUBLISHED = """
title: A tiny study
source: "Nobody (2024), <nowhere>"
specs:
  small: {replicates: 6}
claims:
  - id: order
    where: "Abstract"
    says: "the transition is continuous"
    kind: reading
    registered: 2024-03-01
    spec: small
    figure: sizes
    measure: {transition: polarization}
    expect: {order: continuous}
    looked: before
"""
DRAWN = """
from sweep.figures import Drawing, scaling_figure


def sizes(studies):
    return scaling_figure(studies["small"], "polarization")


FIGURES = {"sizes": Drawing(sizes, ("small",), "Sizes")}
"""
CONTINUOUS, FIRST_ORDER = OfOrder("continuous"), OfOrder("first order")


def made_up(*, jumps: bool) -> Scaling:
    """Three sizes of a system whose transition is of first order, or is continuous."""
    curves = tuple(jumping(3) if jumps else continuous(3))
    states = pd.DataFrame({"problems": [""]})
    return Scaling("m", "T", "n", None, curves, states, 0, 0.95)


@pytest.mark.parametrize(
    ("jumps", "expected", "status"),
    [
        (False, CONTINUOUS, "confirmed"),
        (False, FIRST_ORDER, "refuted"),
        (True, FIRST_ORDER, "confirmed"),
        (True, CONTINUOUS, "refuted"),
    ],
)
def test_the_other_order_is_refuted(
    jumps: bool, expected: OfOrder, status: Status
) -> None:
    """Of systems whose order is known."""
    verdict = judge_order(made_up(jumps=jumps), expected, family=1)
    assert verdict.status == status, verdict
    assert verdict.reason.startswith("the order with confidence 0.95 is ")
    assert (verdict.interval, verdict.noticeable, verdict.weak) == (None, None, False)


@pytest.mark.parametrize("expected", [CONTINUOUS, FIRST_ORDER])
def test_a_large_family_must_be_surer(expected: OfOrder) -> None:
    """At 1 - 0.05 / 10^9 nothing is decided by twelve trials."""
    verdict = judge_order(made_up(jumps=False), expected, family=10**9)
    assert verdict.status == "undecided"
    assert "is not decided: " in verdict.reason


def test_series_that_are_not_stationary_decide_nothing() -> None:
    found = made_up(jumps=True)
    found.states["problems"] = "its mean drifts"
    verdict = judge_order(found, FIRST_ORDER, family=1)
    assert (verdict.status, verdict.reason) == (
        "undecided",
        "the order with confidence 0.95 is not decided: not all series are stationary",
    )


def test_a_claim_on_an_order_is_judged_and_shown(tmp_path: Path) -> None:
    """Forty steps decide nothing. The page and the file for machines say so."""
    folder = experiments(tmp_path, PUBLISHED, SPEC, DRAWN)
    (tiny,) = publications = read_all(folder, quick=False)
    claim = tiny.claims[0]
    assert claim.measure == Transition("small", "polarization", {})
    assert claim.expect == CONTINUOUS
    results = tmp_path / "results"
    outcome = reproduce(publications, results, Serial(), ProgressBar)
    assert outcome.failures == []
    ([row], failures) = judged(tiny, stored_studies(tiny, results))
    assert (row.verdict.status, failures) == ("undecided", [])
    assert (ours_text(row), published_text(row)) == ("not decided", "continuous")
    assert row.measured is not None
    assert (row.measured.used, row.measured.trials) == (32, "32 at 4 points")
    [said] = json.loads((results / "scorecard.json").read_text())["rows"]
    assert (said["expect"], said["published"], said["ours"]) == (
        "continuous",
        None,
        None,
    )
    assert outlooks(tiny, tiny, results) == []


def test_an_order_is_of_the_family_of_its_document(tmp_path: Path) -> None:
    """With a second claim that counts, each must be surer."""
    mean = "{mean: polarization, for: {n: 16, noise: 2}}"
    second = PUBLISHED.partition("claims:\n")[2].replace("id: order", "id: polar")
    second = second.replace("{transition: polarization}", mean)
    second = second.replace("{order: continuous}", "{above: 0}")
    folder = experiments(tmp_path, PUBLISHED + second, SPEC, DRAWN)
    (tiny,) = read_all(folder, quick=False)
    results = tmp_path / "results"
    launch(tiny.studies["small"], results, Serial())
    ([row, _], failures) = judged(tiny, stored_studies(tiny, results))
    assert (tiny.family, failures) == (2, [])
    assert row.verdict.reason.startswith("the order with confidence 0.975 is ")


def test_points_that_are_no_transition_fail_with_the_reason(tmp_path: Path) -> None:
    spec = SPEC.replace("{noise: [2, 6]}", "{noise: [2, 6], max_speed: [0.1, 0.2]}")
    spec = spec.replace("steps: 40", "steps: 2")
    folder = experiments(tmp_path, PUBLISHED, spec, DRAWN)
    (tiny,) = publications = read_all(folder, quick=False)
    outcome = reproduce(publications, tmp_path / "results", Serial(), ProgressBar)
    wanted = (
        "claim tiny/order: study tiny/small: varies several numbers in addition to n"
    )
    assert any(one.startswith(wanted) for one in outcome.failures), outcome.failures
    ([row], _) = judged(tiny, stored_studies(tiny, tmp_path / "results"))
    assert row.verdict.status == "not testable"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("{order: continuous}", "{above: 0}", 'unknown key "above"'),
        ("{order: continuous}", "{order: second}", 'unknown order "second"'),
        ("polarization}", "polarisation}", 'did you mean "polarization"'),
        (
            "polarization}",
            "polarization, for: {n: 16}}",
            "tiny/small has flocks of a single size",
        ),
        ("{transition: polarization}", "{mean: speed, frame: 0, unit: trial}", "order"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    folder = experiments(tmp_path, PUBLISHED.replace(old, new), SPEC, DRAWN)
    with pytest.raises(SpecError, match=message):
        read_all(folder, quick=False)
