"""Many intervals at once: all hold together as often as they say."""

import numpy as np
import pytest

from sweep.analysis import holm, max_t, mean_interval, simultaneous_confidence
from tests.cases import slow_but


def test_bonferroni_and_sidak() -> None:
    assert simultaneous_confidence(10) == pytest.approx(0.995)
    assert simultaneous_confidence(10, correction="sidak") == pytest.approx(0.95**0.1)
    assert (
        simultaneous_confidence(1)
        == simultaneous_confidence(1, correction="sidak")
        == pytest.approx(0.95)
    )


@pytest.mark.slow
def test_independent_intervals_of_sidak_hold_together_exactly_as_often() -> None:
    """1000 sets of 6 intervals of 8 values; two-sided bound at 4 standard errors."""
    rng, level = (
        np.random.default_rng(1),
        simultaneous_confidence(6, correction="sidak"),
    )
    sets = rng.normal(size=(1000, 6, 8))
    held = [
        all(
            low <= 0 <= high
            for _, low, high, _ in (mean_interval(row, level) for row in rows)
        )
        for rows in sets
    ]
    assert abs(np.mean(held) - 0.95) < 4 * np.sqrt(0.95 * 0.05 / 1000)


@pytest.mark.parametrize(
    "wrong", [{"comparisons": 0}, {"comparisons": 2, "correction": "none"}]
)
def test_what_is_not_allowed_is_said(wrong: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="llowed: "):
        simultaneous_confidence(**wrong)  # type: ignore[arg-type]


def test_holms_p_values_by_hand() -> None:
    """4 x 0.005, 3 x 0.01, 2 x 0.03, and 0.04 must not be below the one before."""
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])
    assert holm([0.6, np.nan, 0.4]) == pytest.approx([0.8, np.nan, 0.8], nan_ok=True)
    assert len(holm([])) == 0


@pytest.fixture
def fewer_resamples(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sweep.analysis.resampling.RESAMPLES", 499)


def correlated(
    rng: np.random.Generator, n: int, k: int, correlation: float
) -> np.ndarray:
    """(n, k) normal values with that correlation between columns."""
    shared = rng.normal(size=(n, 1))
    return np.sqrt(correlation) * shared + np.sqrt(1 - correlation) * rng.normal(
        size=(n, k)
    )


@pytest.mark.usefixtures("fewer_resamples")
@pytest.mark.parametrize("correlation", slow_but([0.5], [0.0, 0.5, 0.95]))
def test_max_t_has_one_error_in_twenty_families(correlation: float) -> None:
    """700 families of 6 contrasts of 30 replicates; approximate to one per cent, and 4
    standard errors.
    """
    rng, wrong = np.random.default_rng(2), []
    for _ in range(700):
        found = max_t(correlated(rng, 30, 6, correlation))
        wrong.append(((found.low > 0) | (found.high < 0)).any())
        # The interval and the p-value come from the same resamples: half a step apart
        # at the most.
        assert (
            (found.p < 0.05 - 2 / 500).any()
            <= wrong[-1]
            <= (found.p < 0.05 + 2 / 500).any()
        )
    assert abs(np.mean(wrong) - 0.05) < 0.01 + 4 * np.sqrt(0.05 * 0.95 / 700)


def test_max_t_is_narrower_than_bonferroni_where_contrasts_go_together() -> None:
    values = correlated(np.random.default_rng(3), 60, 12, 0.95)
    found = max_t(values)
    alone = mean_interval(values[:, 0], simultaneous_confidence(12))
    assert found.value[0] == pytest.approx(alone.value)
    assert found.high[0] - found.low[0] < 0.9 * (alone.high - alone.low)


def test_max_t_finds_a_real_effect_and_equal_differences_take_no_part() -> None:
    values = correlated(np.random.default_rng(4), 20, 4, 0.3)
    values[:, 0] += 3.0
    values[:, 2] = 0.1
    values[1:, 3] = 0.1
    found, alone = max_t(values), max_t(values[:, :2])
    assert found.p[0] < 0.01 < 0.05 < found.p[1]
    assert found.value[2] == pytest.approx(0.1)
    for whole, part in zip(found[1:], alone[1:], strict=True):
        assert whole[:2].tolist() == part.tolist()
        assert np.isnan(whole[2:]).all()
    assert np.isnan(max_t(values[:, 2:]).p).all()


@pytest.mark.parametrize(
    ("values", "message"),
    [(np.ones((9, 2)), "9 replicates"), (np.full((12, 2), np.nan), "missing")],
)
def test_max_t_needs_replicates_without_gaps(values: np.ndarray, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        max_t(values)
