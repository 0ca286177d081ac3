"""Intervals end where the values of a metric do, wherever they are made."""

import math
from typing import Any, get_args

import numpy as np
import pandas as pd
import pytest

from kernels.metrics import METRICS
from sweep.analysis import (
    Declaration,
    MeanKind,
    Support,
    by_point,
    compare,
    curves,
    equivalence,
    independent_contrast,
    jointly,
    mean_estimate,
    mean_interval,
    paired_contrast,
    paired_estimate,
)
from sweep.analysis.mean_bounds import FEW
from sweep.analysis.pairing import Units
from sweep.analysis.sequential import Width, repeated_interval
from sweep.methods.adaptive.rule import Until, look
from sweep.spec.recorded import declaration_of
from tests.analysis.measured_coverage import covered, lognormal

POLARIZATION = declaration_of(METRICS["polarization"])
RADIUS = declaration_of(METRICS["flock_radius"])
NEAR_ONE = np.array([0.9, 0.99, 0.7])
FAR = np.array([1.0, 40.0, 900.0, 2.0, 5.0])
TRIALS = pd.DataFrame(
    {
        "trial_id": list("abc"),
        "point": "p",
        "status": "done",
        "polarization": NEAR_ONE,
        "frame": 0,
        "weight": 3,
    }
)
"""Student's interval of the polarization has 1.23 as its upper bound."""


@pytest.mark.parametrize("kind", [None, *get_args(MeanKind)])
@pytest.mark.parametrize(
    ("values", "declared"), [(NEAR_ONE, POLARIZATION), (FAR, RADIUS)]
)
def test_an_interval_lies_where_values_do(
    values: np.ndarray, declared: Declaration, kind: MeanKind | None
) -> None:
    """What is inside stays as it is."""
    bare = declared._replace(support=Support())
    uncut = mean_interval(values, interval=kind, distribution=bare)
    found = mean_interval(values, interval=kind, distribution=declared)
    low, high = declared.support
    assert found == (uncut.value, max(uncut.low, low), min(uncut.high, high), uncut.n)
    assert (uncut.low, uncut.high) != (found.low, found.high) or kind == "bootstrap"


def test_tables_and_curves_have_the_same_ends() -> None:
    wanted = mean_interval(NEAR_ONE, distribution=POLARIZATION)
    assert wanted.high == 1.0
    names = {"polarization": POLARIZATION}
    for kind in (None, "t", "bootstrap_t"):
        row = by_point(
            TRIALS, [], ["polarization"], interval=kind, distributions=names
        ).iloc[0]
        assert row["polarization_high"] == 1.0
    curve = curves(
        TRIALS,
        TRIALS[["trial_id", "status", "weight"]],
        "weight",
        "polarization",
        distribution=POLARIZATION,
    )
    assert curve["high"].tolist() == [1.0]
    repeated = repeated_interval(NEAR_ONE, (3, 9), distribution=POLARIZATION)
    assert repeated.high == 1.0


def test_a_look_asks_how_well_a_mean_is_known() -> None:
    """A mean near an end of the range needs as many trials as elsewhere."""
    until = Until({"polarization": Width(0.3)}, 0.95, 3, 9)
    seen = look(
        until,
        0.95,
        np.array([3]),
        {"polarization": NEAR_ONE},
        {"polarization": POLARIZATION},
    ).metrics["polarization"]
    uncut, cut = (
        mean_interval(NEAR_ONE),
        mean_interval(NEAR_ONE, 0.95, None, POLARIZATION),
    )
    assert seen.half_width == pytest.approx([(uncut.high - uncut.low) / 2.0])
    assert (cut.high - cut.low) / 2.0 < 0.3 < seen.half_width[0]


def unpaired(values: "pd.Series[float]") -> Units:
    return Units(values, len(values), 0, pairs=False)


def test_a_difference_lies_where_differences_do() -> None:
    one, other = NEAR_ONE, np.array([0.01, 0.4, 0.3])
    pairs = pd.Series(other), pd.Series(one)
    found = [
        independent_contrast(other, one, distribution=POLARIZATION),
        paired_contrast(*pairs, distribution=POLARIZATION),
        compare(unpaired(pairs[0]), unpaired(pairs[1]), POLARIZATION),
    ]
    for side in found:
        low, high = side.interval(0.999)
        assert -1.0 <= low < 0.0
        assert high == 1.0
    family = jointly(found, 0.9999)
    assert (family.low.min(), family.high.max()) == (-1.0, 1.0)
    radii = paired_estimate(FAR[::-1], FAR, RADIUS)
    assert radii.interval()[0] < 0.0
    assert radii.support == Support(-math.inf, math.inf)


def test_resampled_pairs_end_there_too() -> None:
    rng = np.random.default_rng(5)
    one = pd.Series(np.where(rng.random(10) < 0.1, 0.0, 1.0))
    other = pd.Series(np.where(rng.random(10) < 0.1, 1.0, 0.0))
    side = paired_contrast(other, one, distribution=POLARIZATION)
    assert jointly([side], 0.9999, "max_t").high.tolist() == [1.0]
    bare = paired_contrast(other, one, distribution="normal")
    assert jointly([bare], 0.9999, "max_t").high[0] > 1.0


def test_what_cannot_be_has_no_chance() -> None:
    """So that equivalence and its interval agree."""
    estimate = mean_estimate(NEAR_ONE, distribution=POLARIZATION)
    found = equivalence(estimate, 0.3, 1.1)
    assert found.high == 1.0
    assert found.equivalent
    assert estimate.tail(1.1, above=False) == 0.0
    assert estimate.tail(-0.1, above=True) == 0.0
    assert estimate.tail(1.0, above=False) > 0.01
    uncut = mean_estimate(NEAR_ONE)
    assert not equivalence(uncut, 0.3, 1.1).equivalent


def test_the_error_of_published_trials_is_not_cut() -> None:
    estimate = mean_estimate(NEAR_ONE, distribution=POLARIZATION)
    assert estimate.interval()[1] == 1.0
    assert estimate.interval(published=3)[1] > 1.0


@pytest.mark.parametrize("distribution", ["count", "proportion", "percentage"])
def test_the_name_of_a_distribution_says_a_range(distribution: Any) -> None:
    whole = {"count": math.inf, "proportion": 1.0, "percentage": 100.0}[distribution]
    found = Declaration.of(distribution, -5.0, math.inf)
    assert found.support == Support(0.0, whole)
    estimate = mean_estimate(np.ones(3), distribution=distribution)
    assert estimate.support == found.support


def test_an_interval_has_its_mean_whatever_rounding_did() -> None:
    above = np.full(3, np.nextafter(1.0, 2.0))
    found = mean_interval(above, distribution=POLARIZATION)
    assert found.low <= found.value <= found.high
    assert found.value > 1.0


def test_a_wrong_declaration_cuts_nothing() -> None:
    outside = np.array([0.2, 0.4, 1.5])
    assert mean_interval(outside, distribution=POLARIZATION) == mean_interval(outside)
    table = TRIALS.assign(polarization=outside)
    names = {"polarization": POLARIZATION}
    rows = by_point(table, [], ["polarization"], distributions=names).iloc[0]
    assert rows["polarization_high"] > 2.0
    pair = pd.Series(NEAR_ONE), pd.Series(outside)
    assert paired_contrast(*pair, distribution=POLARIZATION).interval()[0] < -1.0


def test_few_values_do_not_show_a_long_tail() -> None:
    """As the documents say: 85.6 % of five values. Ten standard errors to either side
    are allowed.
    """
    assert FEW == 5
    assert 83.0 < covered(lognormal(1.5), FEW, samples=20_000) < 88.0
