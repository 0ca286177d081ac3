"""Measures of small tables against answers by hand."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import Distribution, mean_estimate, paired_estimate
from sweep.published.estimates import Measured, MeasureError, measure
from sweep.published.measures import Call, Mean, MeanDifference, RankCorrelation

WEIGHTS, SEEDS = (0.5, 1.0, 2.0), (27, 729, 4913)


class Tables:
    """What a measure needs of a stored study: three weights and three seeds."""

    distributions: Mapping[str, Distribution]
    left_out: Mapping[str, str]

    def __init__(
        self,
        speeds: Sequence[float],
        streams: str = "start=common world=common noise=independent",
        distribution: Distribution = "normal",
    ) -> None:
        self.distributions, self.left_out = {"speed": distribution}, {}
        rows = [
            (weight, seed, replicate)
            for weight in WEIGHTS
            for replicate, seed in enumerate(SEEDS)
        ]
        self.trials = pd.DataFrame(rows, columns=["weight", "seed", "replicate"])
        self.trials["trial_id"] = [f"t{number}" for number in range(9)]
        self.trials["point"] = [f"p{weight}" for weight in self.trials["weight"]]
        self.trials["streams"] = streams
        self.trials["status"] = "done"
        self.trials["speed"] = np.array(speeds, np.float64)
        self.varied = ["weight"]
        self.series = pd.DataFrame(
            [
                (f"t{number}", frame, number + frame / 10)
                for number in range(9)
                for frame in (0, 5, 10)
            ],
            columns=["trial_id", "frame", "speed"],
        )


SPEEDS = (1.0, 2.0, 6.0, 2.0, 4.0, 9.0, 5.0, 5.0, 8.0)


def mean(
    unit: Any = "trial",
    frames: tuple[int, int] | None = None,
    spec: str = "s",
    **settings: float,
) -> Mean:
    return Mean(spec, "speed", frames, settings, unit)


def found(what: Any, study: Tables | None = None, **functions: Any) -> Measured:
    return measure({"s": study or Tables(SPEEDS)}, what, functions)  # type: ignore[dict-item]


def assert_same(one: Measured, *values: Sequence[float]) -> None:
    expected = mean_estimate(
        *(np.array(array, np.float64) for array in reversed(values))
    )
    assert one.estimate.value == pytest.approx(expected.value)
    assert one.estimate.interval() == pytest.approx(expected.interval())


def test_intervals_are_those_of_the_distribution_of_the_metric() -> None:
    counts = Tables((0, 0, 0, 0, 3, 1, 0, 2, 0), distribution="count")
    nothing = found(mean(weight=0.5), counts).estimate
    assert nothing.interval() == pytest.approx((0.0, -np.log(0.05) / 3))
    change = MeanDifference(mean(weight=1.0), mean(weight=2.0))
    sides = np.array([0.0, 2.0, 0.0]), np.array([0.0, 3.0, 1.0])
    wanted = paired_estimate(*sides, "count").interval()
    assert found(change, counts).estimate.interval() == pytest.approx(wanted)


def test_a_mean_is_over_the_chosen_trials() -> None:
    one = found(mean(weight=1.0))
    assert_same(one, [2, 4, 9])
    assert (one.trials, one.left_out) == ("3", 0)


@pytest.mark.parametrize(
    ("unit", "values"),
    [("trial", SPEEDS), ("point", (3, 5, 6)), ("replicate", (8 / 3, 11 / 3, 23 / 3))],
)
def test_the_unit_decides_what_is_independent(
    unit: str, values: Sequence[float]
) -> None:
    one = found(mean(unit))
    assert_same(one, values)
    assert one.trials == "9"


@pytest.mark.parametrize(
    ("frames", "added"), [((0, 0), 0.0), ((5, 10), 0.75), ((0, 10), 0.5)]
)
def test_frames_are_averaged_within_a_trial(
    frames: tuple[int, int], added: float
) -> None:
    assert_same(found(mean(frames=frames, weight=0.5)), [added, 1 + added, 2 + added])


def test_trials_without_a_result_are_left_out_with_their_unit() -> None:
    study = Tables(SPEEDS)
    study.trials.loc[0, "status"] = "diverged"
    one = found(mean("replicate"), study)
    assert_same(one, [11 / 3, 23 / 3])
    assert (one.trials, one.left_out) == ("8", 1)


def test_a_difference_at_common_starts_is_paired() -> None:
    one = found(MeanDifference(mean(weight=1.0), mean(weight=0.5)))
    assert_same(one, [1, 2, 3])
    assert one.trials == "3 and 3, paired"


def test_a_pair_that_lacks_a_trial_is_left_out() -> None:
    study = Tables(SPEEDS)
    study.trials.loc[0, "status"] = "failed"
    one = found(MeanDifference(mean(weight=1.0), mean(weight=0.5)), study)
    assert_same(one, [2, 3])
    assert one.left_out == 1


def test_a_difference_at_independent_starts_is_welchs() -> None:
    study = Tables(SPEEDS, "start=independent world=common noise=independent")
    assert_same(
        found(MeanDifference(mean(weight=1.0), mean(weight=0.5)), study),
        [2, 4, 9],
        [1, 2, 6],
    )


def test_so_is_one_between_other_units() -> None:
    other = Tables(SPEEDS)
    other.trials["seed"] += 1
    what = MeanDifference(mean(weight=1.0), mean(weight=0.5, spec="t"))
    one = measure({"s": Tables(SPEEDS), "t": other}, what, {})  # type: ignore[dict-item]
    assert_same(one, [2, 4, 9], [1, 2, 6])


def test_points_are_paired_by_the_settings_that_no_side_names() -> None:
    """Two sizes at the same three weights: the differences
    of the means of each weight.
    """
    small, large = Tables(SPEEDS), Tables([speed * speed for speed in SPEEDS])
    both = Tables(SPEEDS)
    both.trials = pd.concat(
        [small.trials.assign(n=10), large.trials.assign(n=20)], ignore_index=True
    )
    both.trials["trial_id"] = [f"t{number}" for number in range(18)]
    both.trials["point"] += both.trials["n"].astype(str)
    both.varied = ["n", "weight"]
    one = found(MeanDifference(mean("point", n=20), mean("point", n=10)), both)
    assert_same(one, [41 / 3 - 3, 101 / 3 - 5, 114 / 3 - 6])


def test_a_rank_correlation_is_over_points() -> None:
    one = found(RankCorrelation("s", "weight", "speed", {}))
    assert one.estimate.value == pytest.approx(1.0)
    assert one.trials == "9 at 3 points"


def test_functions_give_one_or_two_samples() -> None:
    assert_same(
        found(Call("f", "normal"), f=lambda studies: studies["s"].trials["speed"]),
        SPEEDS,
    )
    heavy = found(
        Call("f", "normal", {"weight": 2.0}),
        f=lambda _studies, weight: weight * np.arange(3.0),
    )
    assert_same(heavy, [0, 2, 4])
    two = found(
        Call("f", "normal"), f=lambda _: (np.arange(4.0), np.array([1.0, np.nan, 3.0]))
    )
    assert_same(two, [0, 1, 2, 3], [1, 3])
    assert (two.trials, two.left_out) == ("4 and 2", 1)


def test_a_function_says_how_its_values_are_distributed() -> None:
    """Twenty trials in none of which something happens say that it is rare."""
    never = np.zeros(20)
    assert not found(Call("f", "normal"), f=lambda _: never).estimate.testable
    low, high = found(Call("f", "percentage"), f=lambda _: never).estimate.interval()
    assert (low, 10.0 < high < 20.0) == (0.0, True)


def raising(_studies: Any) -> None:
    raise RuntimeError("no idea")


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (raising, "f: RuntimeError: no idea"),
        (lambda _: 3.0, "f must return an array"),
        (lambda _: ([1.0], [2.0], [3.0]), "f must return an array"),
        (lambda _: "text", "f: ValueError"),
    ],
)
def test_a_function_that_fails_says_so(function: Any, message: str) -> None:
    with pytest.raises(MeasureError, match=message):
        found(Call("f", "normal"), f=function)
