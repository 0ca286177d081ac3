"""Susceptibility and Binder cumulant of order parameters whose moments are known."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import (
    binder_cumulant,
    binder_values,
    mean_interval,
    order_parameters,
    order_samples,
    susceptibility,
    susceptibility_values,
)
from tests.studies import SMALL, launched

RECORDED = SMALL.replace(
    "series: [speed], every: 2", "series: [polarization], every: 2"
)
CHI_MODULUS = 2.0 - np.pi / 2
"""The variance of the length of a vector of two standard normal components."""


def modulus(rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """The order parameter of disorder: the length of the mean of many headings in the
    plane.
    """
    return np.hypot(rng.normal(size=shape), rng.normal(size=shape))


def test_binder_of_disorder_in_the_plane_is_a_third() -> None:
    """<m^2> = 2 and <m^4> = 8. 4 errors of the estimate's own; its interval is checked
    below.
    """
    found = binder_cumulant(modulus(np.random.default_rng(1), (400, 500)))
    assert found.n == 400
    assert abs(found.value - 1 / 3) < 4 * (found.high - found.low) / 3.93
    assert found.high - found.low < 0.01


def test_binder_of_disorder_of_one_component_is_zero() -> None:
    found = binder_cumulant(np.random.default_rng(2).normal(size=(400, 500)))
    assert abs(found.value) < 4 * (found.high - found.low) / 3.93
    assert found.high - found.low < 0.02


def test_binder_of_perfect_order_is_two_thirds_and_nothing_fluctuates() -> None:
    """Five equal values do not say how much others vary."""
    binder = binder_cumulant(np.full((5, 8), 0.9))
    found = susceptibility(np.full((5, 8), 0.9), 100)
    assert (binder.value, binder.n) == pytest.approx((2 / 3, 5))
    assert (found.value, found.n) == pytest.approx((0.0, 5), abs=1e-12)
    assert np.isnan([*binder[1:3], *found[1:3]]).all()


def test_where_order_and_disorder_coexist_binder_falls_below_disorder() -> None:
    """One trial in 20 ordered: <m^2> = 0.05 + 0.0095, <m^4> = 0.05 + 0.00019 for a
    disorder of <m^2> = 0.01.
    """
    small = 0.1 / np.sqrt(2) * modulus(np.random.default_rng(3), (1900,))
    assert binder_cumulant(
        np.concatenate([small, np.ones(100)])
    ).value == pytest.approx(1 - 0.05019 / (3 * 0.0595**2), abs=0.2)


def test_susceptibility_of_single_frames_is_the_sample_variance_times_n() -> None:
    values = np.random.default_rng(4).random(7)
    assert susceptibility(values, 50).value == pytest.approx(50 * values.var(ddof=1))


def test_susceptibility_of_series_is_without_bias() -> None:
    """The mean square less the square of the mean, which the variance of trial means
    makes too large by its k-th.
    """
    values = np.random.default_rng(5).random((6, 9)) + np.arange(6)[:, None]
    squared_mean = values.mean() ** 2 - values.mean(axis=1).var(ddof=1) / 6
    assert susceptibility(values, 20).value == pytest.approx(
        20 * ((values**2).mean() - squared_mean)
    )


def test_susceptibility_of_independent_boids_does_not_depend_on_their_number() -> None:
    """The length of a mean of n random headings has variance (1 - pi/4)/n, but for
    terms of 1/n^2.
    """
    rng = np.random.default_rng(6)
    for n in (100, 400):
        headings = rng.uniform(0, 2 * np.pi, (4000, n))
        length = np.hypot(np.cos(headings).mean(axis=1), np.sin(headings).mean(axis=1))
        found = susceptibility(length, n)
        assert (
            abs(found.value - (1 - np.pi / 4))
            < 4 * (found.high - found.low) / 3.92 + 1 / n
        )


def test_pseudo_values_are_those_of_leaving_each_trial_out() -> None:
    values = np.random.default_rng(7).random((5, 4))

    def plain(samples: np.ndarray) -> float:
        return float(1 - (samples**4).mean() / (3 * (samples**2).mean() ** 2))

    slow = [
        5 * plain(values) - 4 * plain(np.delete(values, trial, axis=0))
        for trial in range(5)
    ]
    assert binder_values(values) == pytest.approx(slow)
    assert binder_cumulant(values, 0.9) == mean_interval(binder_values(values), 0.9)
    assert susceptibility(values, 3) == mean_interval(susceptibility_values(values, 3))


@pytest.mark.slow
def test_the_jackknife_takes_the_bias_of_few_trials_away() -> None:
    """2500 samples of 12 single frames: the plain estimate is 0.048 too large; 4 errors
    of the mean are 0.021.
    """
    rng = np.random.default_rng(8)
    samples = modulus(rng, (2500, 12))
    plain = 1 - (samples**4).mean(axis=1) / (3 * (samples**2).mean(axis=1) ** 2)
    assert plain.mean() - 1 / 3 > 0.027
    assert abs(np.mean([binder_cumulant(one).value for one in samples]) - 1 / 3) < 0.021


@pytest.mark.slow
@pytest.mark.parametrize(
    ("k", "frames", "binder", "chi"), [(12, 1, 0.801, 0.833), (12, 100, 0.943, 0.948)]
)
def test_intervals_cover_as_they_say(
    k: int, frames: int, binder: float, chi: float
) -> None:
    """1000 samples of disorder; expected are the shares of 10,000 and more. 4 errors:
    two alarms in 10,000 for each.
    """
    rng, repeats = np.random.default_rng(9), 1000
    samples = [modulus(rng, (k, frames)) for _ in range(repeats)]
    for found, truth, expected in (
        ([binder_cumulant(one) for one in samples], 1 / 3, binder),
        ([susceptibility(one, 1) for one in samples], CHI_MODULUS, chi),
    ):
        share = np.mean([one.low <= truth <= one.high for one in found])
        assert abs(share - expected) < 4 * np.sqrt(expected * (1 - expected) / repeats)


def test_frames_of_a_trial_count_together() -> None:
    """A frame repeated ten times tells no more than once."""
    values = np.random.default_rng(10).random((9, 1))
    assert binder_cumulant(np.repeat(values, 10, axis=1)) == pytest.approx(
        binder_cumulant(values)
    )


def test_one_trial_has_no_interval_and_no_order_no_cumulant() -> None:
    alone = binder_cumulant([[0.5, 0.7]])
    assert alone.value == pytest.approx(
        1 - (0.5**4 + 0.7**4) / 2 / (3 * ((0.5**2 + 0.7**2) / 2) ** 2)
    )
    assert np.isnan([alone.low, alone.high]).all()
    assert np.isnan(binder_cumulant(np.zeros(4)).value)
    assert np.isnan(binder_cumulant([]).value)


@pytest.mark.parametrize(
    "samples", [[0.5, np.nan], np.zeros((2, 2, 2)), np.zeros((2, 0)), 0.5]
)
def test_samples_that_cannot_be_are_refused(samples: object) -> None:
    with pytest.raises(ValueError, match="samples"):
        binder_cumulant(samples)  # type: ignore[arg-type]


def test_the_table_of_a_study_is_that_of_its_series(tmp_path: Path) -> None:
    study = launched(RECORDED, tmp_path)
    table = order_parameters(study, "polarization", burn_in=4, confidence=0.9)
    assert list(table["separation_weight"]) == [0.5, 1.0]
    assert list(table["trials"]) == [3, 3]
    assert list(table["frames"]) == [4, 4]  # 4, 6, 8, and the last, 9
    series = study.series.merge(
        study.trials[["trial_id", "separation_weight"]], on="trial_id"
    )
    for _, row in table.iterrows():
        at = series[
            (series["separation_weight"] == row["separation_weight"])
            & (series["frame"] >= 4)
        ]
        samples = np.array(
            [group["polarization"] for _, group in at.groupby("trial_id", sort=False)]
        )
        expected = binder_cumulant(samples, 0.9)
        assert (row["binder"], row["binder_low"], row["binder_high"]) == pytest.approx(
            expected[:3]
        )
        assert row["susceptibility"] == pytest.approx(susceptibility(samples, 12).value)
        assert row["order"] == pytest.approx(samples.mean())


def test_trials_without_a_value_are_left_out_and_counted(tmp_path: Path) -> None:
    study = launched(RECORDED, tmp_path)
    whole = order_samples(study, "polarization")
    study.trials.loc[0, "status"] = "failed"
    study.series.loc[
        study.series["trial_id"] == study.trials["trial_id"][1], "polarization"
    ] = np.nan
    first, second = study.trials["point"].unique()
    samples = order_samples(study, "polarization")
    assert samples[first].tolist() == whole[first][2:].tolist()
    assert samples[second].tolist() == whole[second].tolist()
    table = order_parameters(study, "polarization")
    assert list(table["left_out"]) == [2, 0]
    assert np.isnan(table["binder_low"][0])


def test_a_point_without_a_trial_is_a_row_without_numbers(tmp_path: Path) -> None:
    study = launched(RECORDED, tmp_path)
    study.trials.loc[study.trials["point"] == study.trials["point"][0], "status"] = (
        "failed"
    )
    table = order_parameters(study, "polarization")
    assert list(table["trials"]) == [0, 3]
    assert table.loc[0, ["order", "susceptibility", "binder"]].isna().all()


def test_what_was_not_recorded_is_said(tmp_path: Path) -> None:
    study = launched(RECORDED, tmp_path)
    with pytest.raises(ValueError, match='did you mean "polarization"'):
        order_parameters(study, "polarisation")
    with pytest.raises(
        ValueError, match="burn_in: 10; allowed: at most the last recorded frame, 9"
    ):
        order_samples(study, "polarization", burn_in=10)
    assert isinstance(order_parameters(study, "polarization", burn_in=9), pd.DataFrame)
