"""Series whose autocorrelation, transient and mean are known."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.signal import lfilter

from sweep.analysis import (
    autocorrelation,
    burn_in,
    drift,
    integrated_time,
    steady_state,
    steady_states,
)
from tests.cases import slow_but
from tests.studies import SMALL, launched


def autoregressive(phi: float, m: int, frames: int, seed: int = 1) -> np.ndarray:
    """m stationary AR(1) series (m, frames) with mean 0: autocorrelation phi^lag, tau
    (1 + phi)/(1 - phi).
    """
    noise = np.random.default_rng(seed).normal(size=(m, frames))
    noise[:, 0] /= np.sqrt(1 - phi**2)
    return np.asarray(lfilter([1.0], [1.0, -phi], noise, axis=1))


def test_the_autocorrelation_is_that_of_a_slow_sum() -> None:
    values = autoregressive(0.7, 2, 60)
    centred = values - values.mean(axis=1, keepdims=True)
    slow = [
        sum((row[: 60 - lag] * row[lag:]).sum() for row in centred) for lag in range(60)
    ]
    assert autocorrelation(values) == pytest.approx(np.array(slow) / slow[0], abs=1e-12)


@pytest.mark.parametrize("phi", [0.0, 0.5, 0.9, -0.5])
def test_the_integrated_time_of_autoregressive_series_is_known(phi: float) -> None:
    """Its standard error is sqrt(2 (2 window + 1)/(m T)) (Sokal 1997, equation 3.19); 4
    of them are allowed, and 3 % for the end of the sum.
    """
    tau, values = (1 + phi) / (1 - phi), autoregressive(phi, 20, 10_000)
    found = integrated_time(values)
    error = np.sqrt(2 * (2 * 5 * max(tau, 1) + 1) / values.size)
    assert abs(found.tau / tau - 1) < 4 * error * max(1, 1 / tau) + 0.03
    assert found.effective == pytest.approx(values.size / found.tau)
    assert found.reliable


def test_the_variance_of_means_is_that_of_the_effective_size() -> None:
    """400 series of 2000 frames: var(mean) x effective = var; the ratio has an error of
    sqrt(2/400).
    """
    values = autoregressive(0.8, 400, 2000)
    ratio = (
        values.mean(axis=1).var(ddof=1)
        * (integrated_time(values).effective / 400)
        / values.var()
    )
    assert abs(ratio - 1) < 4 * np.sqrt(2 / 400)


def test_a_short_series_says_that_its_time_is_not_reliable() -> None:
    assert not integrated_time(autoregressive(0.98, 1, 1000)).reliable
    assert (
        "shorter than 50 autocorrelation times"
        in steady_state(autoregressive(0.98, 1, 1000)).problems
    )


def test_the_burn_in_ends_where_a_step_does() -> None:
    """A step of 5 standard deviations after 300 frames, in 100 series; hardly ever much
    more is left out.
    """
    values = autoregressive(0.5, 100, 2000) + 5 * (np.arange(2000) < 300)
    found = [burn_in(row) for row in values]
    frames = np.array([one.frames for one in found])
    assert all(one.end_found for one in found)
    assert frames.min() >= 300
    assert np.mean(frames < 400) >= 0.9


def test_after_an_exponential_transient_the_mean_has_no_bias_left() -> None:
    """10 exp(-t/50) would shift the mean of 2000 frames by 0.25; of 200 series 4 errors
    of their mean are 0.013.
    """
    rows = autoregressive(0.5, 200, 2000) + 10 * np.exp(-np.arange(2000) / 50)
    found = [steady_state(row) for row in rows]
    assert rows.mean() > 0.2
    assert abs(np.mean([one.mean for one in found])) < 0.03
    assert 70 < np.median([one.burn_in for one in found]) < 250


def test_a_transient_without_an_end_is_said() -> None:
    found = burn_in(np.linspace(0.0, 1.0, 400))
    assert found == (0, False)
    assert not steady_state(np.linspace(0.0, 1.0, 400)).stationary


@pytest.mark.parametrize(
    ("phi", "expected"), slow_but([(0.5, 0.945)], [(0.0, 0.95), (0.5, 0.945)])
)
def test_the_interval_of_one_series_covers_its_mean(
    phi: float, expected: float
) -> None:
    """1000 series of 1000 frames; expected is the measured share of a longer run, 4
    standard errors.
    """
    found = [steady_state(row) for row in autoregressive(phi, 1000, 1000)]
    covered = np.mean([one.low <= 0 <= one.high for one in found])
    assert abs(covered - expected) < 4 * np.sqrt(expected * (1 - expected) / 1000)
    assert np.mean([one.stationary for one in found]) > 0.95


def test_the_interval_of_several_short_series_covers_their_mean() -> None:
    """300 sets of 12 series of 10 tau, and drifts found in one of a hundred; 4 standard
    errors.
    """
    values = autoregressive(0.9, 12 * 300, 200).reshape(300, 12, 200)
    found = [steady_state(rows) for rows in values]
    assert abs(
        np.mean([one.low <= 0 <= one.high for one in found]) - 0.95
    ) < 4 * np.sqrt(0.95 * 0.05 / 300)
    assert np.mean([one.stationary for one in found]) > 0.99 - 4 * np.sqrt(
        0.01 * 0.99 / 300
    )
    assert not any(one.reliable for one in found)


@pytest.mark.parametrize("m", slow_but([1], [1, 12]))
def test_a_steady_series_drifts_as_seldom_as_the_p_value_says(m: int) -> None:
    """600 sets; approximate to one per cent for one series, 4 standard errors for
    chance.
    """
    values = autoregressive(0.5, 600 * m, 1000).reshape(600, m, 1000)
    share = np.mean([drift(rows).p < 0.05 for rows in values])
    assert abs(share - 0.05) < 0.01 + 4 * np.sqrt(0.05 * 0.95 / 600)


def test_trends_and_random_walks_are_flagged() -> None:
    trend = autoregressive(0.5, 100, 2000) + np.linspace(0.0, 2.0, 2000)
    assert not any(steady_state(row).stationary for row in trend)
    assert "the mean drifts" in steady_state(trend).problems
    walks = np.cumsum(np.random.default_rng(2).normal(size=(100, 1000)), axis=1)
    assert not any(steady_state(row).stationary for row in walks)


def test_a_constant_series_is_its_own_mean() -> None:
    found = steady_state(np.full(50, 3.0))
    assert (found.mean, found.low, found.high, found.stationary) == (
        3.0,
        3.0,
        3.0,
        True,
    )
    assert np.isnan(found.tau)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.zeros(19), "19 frames; allowed: 20"),
        (np.full(30, np.nan), "missing"),
        (np.zeros((2, 3, 40)), "shape"),
    ],
)
def test_what_is_no_series_is_said(values: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        steady_state(values)


class Tables:
    """Two points of three trials, recorded every 10 steps and at the last, 1003; one
    trial is not done.
    """

    def __init__(self) -> None:
        frames = [*range(0, 1001, 10), 1003]
        values = autoregressive(0.5, 6, len(frames)) + 4.0
        values[:, -1] = 1e6
        ids = [f"t{number}" for number in range(6)]
        self.trials = pd.DataFrame(
            {"trial_id": ids, "point": list("aaabbb"), "weight": [1.0] * 3 + [2.0] * 3}
        )
        self.trials["status"] = ["done"] * 5 + ["failed"]
        self.series = pd.DataFrame(
            {"trial_id": np.repeat(ids, len(frames)), "frame": frames * 6}
        )
        self.series["speed"] = values.ravel()
        self.varied = ["weight"]
        self.values = values[:, :-1]


def test_a_table_of_steady_states() -> None:
    study = Tables()
    table = steady_states(study, "speed")
    expected = [steady_state(study.values[:3]), steady_state(study.values[3:5])]
    assert list(table["weight"]) == [1.0, 2.0]
    assert list(table["mean"]) == pytest.approx([one.mean for one in expected])
    assert list(table["tau"]) == pytest.approx([10 * one.tau for one in expected])
    assert list(table["burn_in"]) == [10 * one.burn_in for one in expected]
    assert (list(table["series"]), list(table["left_out"])) == ([3, 2], [0, 1])
    assert list(table["stationary"]) == [one.stationary for one in expected]


def test_a_point_without_any_trial_is_not_stationary() -> None:
    study = Tables()
    study.trials.loc[3:, "status"] = "diverged"
    row = steady_states(study, "speed").iloc[1]
    assert (row["series"], row["stationary"], row["problems"], row["left_out"]) == (
        0,
        False,
        "no trial is done",
        3,
    )


def test_a_stored_study_has_steady_states_and_what_is_not_recorded_is_said(
    tmp_path: Path,
) -> None:
    study = launched(SMALL.replace("steps: 9", "steps: 60"), tmp_path)
    table = steady_states(study, "speed")
    assert list(table["separation_weight"]) == [0.5, 1.0]
    assert list(table["series"]) == [3, 3]
    assert np.isfinite(table["mean"]).all()
    with pytest.raises(
        ValueError, match='unknown recorded series "sped"; did you mean "speed"'
    ):
        steady_states(study, "sped")
