"""Races on candidates whose true means are known: what is dropped, what is kept, and
how often wrongly, for candidates as noisy as the others, noisier, and less noisy.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np
import pytest
from scipy.stats import binom

from sweep.methods.search.objectives import Constraint, Floats, Objective, Statistic
from sweep.methods.search.racing import LEAST_BLOCKS, Race, Samples

MEAN, WORST = Statistic("mean"), Statistic("worst")
GAIN, COST = Objective("gain", True, MEAN), Objective("cost", False, MEAN)
RUNGS = (1, 2, 4, 8, 16)
LEVEL = 0.1
FALSE_ALARM = 1e-4
"""How often a correct program fails each of the tests of a rate, two-sided."""


def samples(gain: Sequence[float] | Floats, **others: Sequence[float]) -> Samples:
    """One candidate in one scenario, by its blocks."""
    columns = {"gain": gain, **others}
    return {
        name: np.asarray(values, np.float64).reshape(-1, 1)
        for name, values in columns.items()
    }


def noisy(
    rng: np.random.Generator, mean: float, common: Floats, noise: float = 1.0
) -> Floats:
    """A candidate's gain in each block: its mean, what the block adds for all, and
    noise of this deviation.
    """
    return mean + common + noise * rng.normal(size=len(common))


def race(
    level: float = LEVEL,
    objective: Objective = GAIN,
    *constraints: Constraint,
    complete: int = 16,
) -> Race:
    return Race((objective,), constraints, level, complete)


def blocks_of(values: Floats, earlier: list[Samples], level: float = LEVEL) -> int:
    """How many blocks a candidate gets that races alone."""
    for rung in RUNGS[:-1]:
        if race(level).dropped(earlier, [samples(values[:rung])])[0]:
            return rung
    return RUNGS[-1]


def a_history(
    rng: np.random.Generator, common: Floats, candidates: int = 20
) -> list[Samples]:
    """Earlier candidates with two blocks each, and a complete one whose mean is 0 and
    better than theirs.
    """
    others = [samples(noisy(rng, -3.0, common)[:2]) for _ in range(candidates)]
    return [*others, samples(noisy(rng, 0.0, common))]


@cache
def spent_on(
    mean: float, repeats: int, level: float = LEVEL, noise: float = 1.0
) -> list[int]:
    """The blocks that a candidate of this mean and noise gets, in independent
    histories.
    """
    spent = []
    for seed in range(repeats):
        rng = np.random.default_rng([7, seed])
        common = rng.normal(0.0, 5.0, 16)
        history = a_history(rng, common)
        spent.append(blocks_of(noisy(rng, mean, common, noise), history, level))
    return spent


def within(count: int, n: int, probability: float) -> bool:
    """Whether a count agrees with a binomial probability; FALSE_ALARM of correct ones
    do not.
    """
    low, high = binom.ppf([FALSE_ALARM / 2, 1 - FALSE_ALARM / 2], n, probability)
    return bool(low <= count <= high)


REPEATS = 400


@pytest.mark.parametrize("noise", [0.25, 1.0, 4.0])
def test_one_test_of_an_equal_candidate_is_wrong_at_the_level(noise: float) -> None:
    """The first one, after two blocks, however noisy the others are."""
    spent = spent_on(0.0, REPEATS, noise=noise)
    assert within(sum(blocks == 2 for blocks in spent), REPEATS, LEVEL)
    assert not any(blocks == 1 for blocks in spent)


@pytest.mark.parametrize("noise", [0.25, 1.0, 4.0])
def test_an_equal_candidate_is_dropped_less_often_than_level_times_tests(
    noise: float,
) -> None:
    """Of three tests, which depend on each other: 0.21 are dropped, and the bound is
    0.3.
    """
    spent = spent_on(0.0, REPEATS, noise=noise)
    assert within(sum(blocks < 16 for blocks in spent), REPEATS, 0.21)


def test_a_candidate_that_is_better_by_one_deviation_is_kept() -> None:
    """All but 2.5 %."""
    assert within(sum(blocks < 16 for blocks in spent_on(1.0, REPEATS)), REPEATS, 0.025)


def test_a_bad_candidate_costs_few_blocks() -> None:
    """By two deviations of its noise 3.5 trials in the mean, by four 2.4; here within 5
    standard errors.
    """
    for mean, expected, error in ((-2.0, 3.54, 0.1), (-4.0, 2.42, 0.05)):
        assert abs(np.mean(spent_on(mean, REPEATS)) - expected) < 5 * error


def test_what_a_block_adds_for_all_does_not_matter() -> None:
    rng = np.random.default_rng(1)
    common = rng.normal(size=16)
    plain = [
        samples(noisy(rng, mean, 0 * common)[:4])
        for mean in (-2.0, -1.0, -0.5, 0.0, 0.2)
    ]
    leader = samples(noisy(rng, 0.0, 0 * common))
    shifted = [samples(one["gain"][:, 0] + 100 * common[:4]) for one in plain]
    ahead = samples(leader["gain"][:, 0] + 100 * common)
    assert race().dropped([leader], plain) == race().dropped([ahead], shifted)
    assert any(race().dropped([leader], plain))


def test_one_block_drops_nothing() -> None:
    """It has no deviation, and those of others say nothing about it."""
    history = a_history(np.random.default_rng(2), np.zeros(16))
    bad = samples([-20.0])
    assert race().dropped(history, [bad, samples([20.0])]) == [False, False]
    assert race().dropped([], [samples([mean]) for mean in range(20)]) == [False] * 20
    assert race().dropped(history, [samples([-20.0, -20.5])]) == [True]


@pytest.mark.parametrize(("blocks", "dropped"), [(2, False), (3, False), (4, True)])
def test_equal_differences_are_tested_by_their_signs(
    blocks: int, dropped: bool
) -> None:
    """A rare event that the leader lacks by chance: so many of the same sign have the
    chance 0.25, 0.125 and 0.0625. What a mean loses in its last digits is no spread.
    """
    leader = samples(np.full(16, 0.1))
    assert race().dropped([leader], [samples(np.full(blocks, -0.2))]) == [dropped]
    nearly = np.full(blocks, -0.2) + 1e-16 * np.arange(blocks)
    assert race().dropped([leader], [samples(nearly)]) == [dropped]
    assert race().dropped([leader], [samples(np.full(blocks, 0.1))]) == [False]


def test_of_a_cost_the_larger_is_dropped() -> None:
    ours = [
        {"cost": -one["gain"]}
        for one in a_history(np.random.default_rng(3), np.zeros(16))
    ]
    cheap, dear = ({"cost": np.array([[cost], [cost + 1]])} for cost in (-9.0, 9.0))
    assert race(LEVEL, COST).dropped(ours, [cheap, dear]) == [False, True]


def test_scenarios_are_averaged_by_block() -> None:
    """Two scenarios that cancel out in each block leave nothing to tell candidates
    apart.
    """
    rng = np.random.default_rng(4)
    noise = 50 * rng.normal(size=(8, 16))
    even = [
        {"gain": np.stack([mean + row, mean - row], axis=1)}
        for mean, row in zip(range(8), noise, strict=True)
    ]
    dropped = race(complete=17).dropped([], even)
    assert dropped == [True] * 7 + [False]


@pytest.mark.parametrize(
    "kind", [WORST, Statistic("quantile", 0.2), Statistic("cvar", 0.3)], ids=str
)
def test_other_statistics_are_resampled_from_five_blocks_on(kind: Statistic) -> None:
    rng = np.random.default_rng(5)
    tail = Objective("gain", True, kind)
    leader, good = samples(rng.normal(size=16)), samples(rng.normal(1.0, 1.0, 8))
    bad = samples(rng.normal(-5.0, 1.0, 8))
    assert race(LEVEL, tail).dropped([leader], [bad, good]) == [True, False]
    few = [{"gain": one["gain"][: LEAST_BLOCKS - 1]} for one in (bad, good)]
    assert race(LEVEL, tail).dropped([leader], few) == [False, False]


def test_an_equal_candidate_in_a_quantile_is_dropped_about_at_the_level() -> None:
    """The bootstrap is approximate: at 16 against 8 blocks the rate is measured to be
    below twice the level.
    """
    n, dropped = 300, 0
    median = Objective("gain", True, Statistic("quantile", 0.5))
    for seed in range(n):
        rng = np.random.default_rng([11, seed])
        common = rng.normal(size=16)
        ahead, equal = noisy(rng, 0.0, common), noisy(rng, 0.0, common)
        dropped += race(LEVEL, median).dropped([samples(ahead)], [samples(equal[:8])])[
            0
        ]
    assert dropped < binom.ppf(1 - FALSE_ALARM, n, 2 * LEVEL)
    assert dropped > 0


def test_the_worst_of_a_constraint_drops_at_once_and_for_good() -> None:
    never = Constraint("hits", 0.0, True, WORST)
    running = [samples([5.0], hits=[1.0]), samples([1.0], hits=[0.0])]
    assert race(LEVEL, GAIN, never).dropped([], running) == [True, False]


def test_the_mean_of_a_constraint_is_tested_against_its_bound() -> None:
    few = Constraint("hits", 1.0, True, MEAN)
    rng = np.random.default_rng(6)
    earlier = [
        samples(rng.normal(size=2), hits=rng.normal(0.0, 1.0, 2)) for _ in range(20)
    ]
    running = [
        samples([9.0, 9.0], hits=[8.0, 8.5]),
        samples([9.0, 9.0], hits=[1.5, 0.9]),
        samples([9.0, 9.0], hits=[-8.0, -8.5]),
    ]
    assert race(LEVEL, GAIN, few).dropped(earlier, running) == [True, False, False]
    many = Constraint("hits", 1.0, False, MEAN)
    assert race(LEVEL, GAIN, many).dropped(earlier, running) == [False, False, True]


def test_a_quantile_of_a_constraint_is_resampled() -> None:
    seldom = Constraint("hits", 0.0, True, Statistic("quantile", 0.9))
    running = [samples(np.zeros(6), hits=np.full(6, value)) for value in (3.0, -3.0)]
    assert race(LEVEL, GAIN, seldom).dropped([], running) == [True, False]


def test_a_candidate_out_of_bounds_never_leads() -> None:
    bound = Constraint("hits", 0.0, True, MEAN)
    rng = np.random.default_rng(8)
    earlier = [samples(rng.normal(-3.0, 1.0, 2), hits=[-1.0, -1.1]) for _ in range(20)]
    earlier += [samples(np.full(16, 50.0), hits=np.full(16, 0.01))]
    modest = samples(rng.normal(size=2), hits=[-1.0, -1.2])
    assert race(LEVEL, GAIN, bound).dropped(earlier, [modest]) == [False]
    earlier += [samples(np.full(16, 50.0), hits=np.full(16, -0.01))]
    assert race(LEVEL, GAIN, bound).dropped(earlier, [modest]) == [True]


def two_sided(gain: float, cost: float, blocks: int, seed: int) -> Samples:
    rng = np.random.default_rng([9, seed])
    return samples(
        gain + rng.normal(0, 0.1, blocks), cost=cost + rng.normal(0, 0.1, blocks)
    )


def test_of_several_objectives_one_complete_member_of_the_front_must_beat_all() -> None:
    several = Race((GAIN, COST), (), LEVEL, 4)
    front = [two_sided(5.0, 5.0, 4, 1), two_sided(1.0, 1.0, 4, 2)]
    between, beaten, ahead = (
        two_sided(4.0, 2.0, 2, 3),
        two_sided(0.0, 2.0, 2, 4),
        two_sided(9.0, 0.0, 2, 5),
    )
    assert several.dropped(front, [between, beaten, ahead]) == [False, True, False]
    assert several.dropped([], [between, beaten, ahead]) == [False, False, False]
    assert several.leaders([*front, beaten]) == front


def test_a_stricter_level_drops_fewer() -> None:
    loose, strict = (
        sum(np.array(spent_on(-1.0, 50, level)) < 16) for level in (0.3, 0.01)
    )
    assert loose > strict
