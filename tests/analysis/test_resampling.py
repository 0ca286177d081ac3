"""Pseudo-values of the jackknife."""

import numpy as np
import pytest

from sweep.analysis import pseudo_values

VALUES = np.random.default_rng(3).normal(2.0, 1.0, (9, 2))


def test_pseudo_values_of_a_mean_are_the_values() -> None:
    """To the rounding of k times a mean."""
    found = pseudo_values(VALUES, lambda _, second: second)
    np.testing.assert_allclose(found, VALUES[:, 1], rtol=1e-12)


def test_the_mean_of_pseudo_values_has_no_bias_of_first_order() -> None:
    """The square of a mean of k values is too large by their variance over k."""
    first = VALUES[:, 0]
    found = pseudo_values(VALUES, lambda mean, _: mean * mean).mean()
    assert found == pytest.approx(first.mean() ** 2 - first.var(ddof=1) / 9, rel=1e-12)


def test_a_single_row_gives_its_own_value() -> None:
    found = pseudo_values(VALUES[:1], lambda first, second: first / second)
    assert found.tolist() == [VALUES[0, 0] / VALUES[0, 1]]
