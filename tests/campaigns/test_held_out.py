"""What a search has chosen is judged on other seeds: the winner's curse is seen there,
and intervals hold.
"""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from sweep.analysis import mean_interval
from sweep.methods.search.block_intervals import block_interval, difference_interval
from sweep.methods.search.held_out import (
    differences,
    front,
    references,
    shown,
    winners,
)
from sweep.methods.search.objectives import Constraint, Objective, Statistic
from tests.cases import slow_but
from tests.made_up_searches import GAIN, MEAN, MadeUp, rows, searched

LOSS = Objective("loss", False, MEAN)
FALSE_ALARM = 1e-4
"""Chance that a correct estimator fails a test of its coverage."""


def covers_as_it_should(hits: int, trials: int, share: float) -> bool:
    low, high = binom.interval(1.0 - FALSE_ALARM, trials, share)
    return bool(low <= hits <= high)


def made_up(
    rng: np.random.Generator,
    truths: list[float],
    *,
    blocks: int = 8,
    fresh: int = 12,
    judged: int = 1,
    noise: float = 1.0,
) -> MadeUp:
    """A search over candidates with these true gains, of which the best `judged` have
    held-out blocks.
    """
    seen = np.array(truths)[:, None] + noise * rng.normal(size=(len(truths), blocks))
    order = np.argsort(-seen.mean(axis=1))[:judged]
    parts = [gains("search", np.arange(len(truths)), seen)]
    if judged:
        again = np.array(truths)[order, None] + noise * rng.normal(size=(judged, fresh))
        parts.append(gains("held_out", order, again))
    return searched(*parts, full=blocks)


def test_counts_that_were_never_seen_have_a_width() -> None:
    rare, nothing = replace(LOSS, distribution="count"), np.zeros((20, 1))
    found = block_interval(rare, nothing)
    assert (found.low, found.high) == pytest.approx((0.0, -np.log(0.05) / 20))
    change = difference_interval(rare, nothing, nothing)
    assert change.low < -0.1
    assert change.high > 0.1
    assert np.isnan(block_interval(LOSS, nothing).high)


def gains(phase: str, candidates: np.ndarray, values: np.ndarray) -> pd.DataFrame:
    """The rows of several candidates at once, whose values are (candidates, blocks): a
    table each would take long.
    """
    candidate, block = (
        np.repeat(candidates, values.shape[1]),
        np.tile(np.arange(values.shape[1]), len(candidates)),
    )
    columns = {
        "gain": values.ravel(),
        "candidate": candidate,
        "block": block,
        "weight": candidate / 10,
    }
    return rows(
        "search", phase, 0, {name: column[:, None] for name, column in columns.items()}
    )


def test_the_winner_has_both_estimates_with_intervals_over_blocks() -> None:
    asked = made_up(np.random.default_rng(1), [0.0, 5.0, 1.0])
    (row,) = winners(asked).to_dict("records")
    table = asked.table[asked.table["candidate"] == 1]
    for name, phase in (("search", "search"), ("held_out", "held_out")):
        expected = mean_interval(table.loc[table["phase"] == phase, "gain"])
        assert [
            row[name],
            row[f"{name}_low"],
            row[f"{name}_high"],
            row[f"{name}_n"],
        ] == pytest.approx(expected)
    assert (row["candidate"], row["objective"], row["not_done"]) == (1, "gain", 0)
    assert row["optimism"] == pytest.approx(row["search"] - row["held_out"])


def test_blocks_are_what_is_independent_not_trials() -> None:
    """Five scenarios with the same luck are no more than one."""
    luck = np.random.default_rng(2).normal(size=(10, 1))
    values = luck + np.arange(5.0)
    expected = mean_interval(luck[:, 0] + 2.0)
    assert block_interval(GAIN, values) == pytest.approx(expected)


def test_held_out_intervals_hold_together_over_candidates_and_references() -> None:
    rng = np.random.default_rng(3)
    asked = made_up(rng, [0.0, 0.1, 0.2], judged=3)
    asked.description["references"] = ["published"]
    alone = winners(made_up(np.random.default_rng(3), [0.0, 0.1, 0.2], judged=3))
    assert (winners(asked)["held_out_high"] > alone["held_out_high"]).all()
    assert winners(asked)["search_high"].tolist() == alone["search_high"].tolist()


@pytest.mark.slow
@pytest.mark.parametrize("searches", [80, 150])
def test_the_winners_curse_shows_in_the_search_interval_and_not_in_the_held_out_one(
    searches: int,
) -> None:
    """Twenty equally good candidates: the luckiest of them is no better than others on
    other seeds.

    Each exceeds the upper end of its own interval with 2.5 %, so that about 0.975^20 =
    60 % of the search intervals of winners cover, not 95 %.
    """
    rng = np.random.default_rng(4)
    tables = [winners(made_up(rng, [0.0] * 20)).iloc[0] for _ in range(searches)]
    held = sum(
        table["held_out_low"] <= 0.0 <= table["held_out_high"] for table in tables
    )
    seen = sum(table["search_low"] <= 0.0 <= table["search_high"] for table in tables)
    assert covers_as_it_should(held, searches, 0.95)
    assert seen <= binom.ppf(1.0 - FALSE_ALARM, searches, 0.6)
    optimism = mean_interval([table["optimism"] for table in tables], 1.0 - FALSE_ALARM)
    largest = 1.8675  # the mean of the largest of twenty normal values
    assert optimism.low <= largest / np.sqrt(8) <= optimism.high


@pytest.mark.slow
def test_simultaneous_held_out_intervals_cover_all_shown_candidates() -> None:
    """At least 95 % by Bonferroni, and no more than independent intervals would."""
    searches, rng = 150, np.random.default_rng(5)
    tables = [winners(made_up(rng, [0.0] * 5, judged=3)) for _ in range(searches)]
    held = sum(
        ((table["held_out_low"] <= 0.0) & (table["held_out_high"] >= 0.0)).all()
        for table in tables
    )
    assert covers_as_it_should(held, searches, (1.0 - 0.05 / 3) ** 3)


@pytest.mark.parametrize("times", slow_but([80], [80, 200]))
@pytest.mark.parametrize(
    "statistic",
    slow_but(
        [Statistic("cvar", 0.3)], [Statistic("cvar", 0.3), Statistic("quantile", 0.25)]
    ),
)
def test_bootstrap_intervals_of_other_statistics_cover(
    statistic: Statistic, times: int
) -> None:
    """Of 40 normal values. Few values make a bootstrap somewhat too narrow: 90 to 97 %
    are accepted.
    """
    objective, rng = Objective("gain", True, statistic), np.random.default_rng(6)
    truth = {"cvar": -1.1590, "quantile": -0.6745}[statistic.kind]
    found = [block_interval(objective, rng.normal(size=(40, 1))) for _ in range(times)]
    held = sum(interval.low <= truth <= interval.high for interval in found)
    assert (
        binom.ppf(FALSE_ALARM / 2, times, 0.90)
        <= held
        <= binom.ppf(1.0 - FALSE_ALARM / 2, times, 0.97)
    )


def test_the_worst_value_has_no_interval_and_no_optimism() -> None:
    worst = Objective("gain", True, Statistic("worst"))
    asked = made_up(np.random.default_rng(7), [0.0, 1.0])
    asked.description["objectives"] = [worst.as_json()]
    row = winners(asked).iloc[0]
    assert not np.isnan(row["held_out"])
    assert np.isnan(
        row[["held_out_low", "held_out_high", "search_low", "optimism"]].to_numpy(float)
    ).all()


def test_optimism_is_positive_where_the_search_promised_too_much_either_way() -> None:
    parts = [
        rows("search", "search", 0, {"loss": np.array([[1.0], [3.0]]), "weight": 0.5})
    ]
    parts.append(
        rows("search", "held_out", 0, {"loss": np.array([[4.0], [6.0]]), "weight": 0.5})
    )
    assert (
        winners(searched(*parts, objectives=(LOSS,), full=2)).iloc[0]["optimism"] == 3.0
    )


def referred(shift: float, noise: float, rng: np.random.Generator) -> MadeUp:
    """A winner that is better than the reference by `shift`, block by block but for
    `noise`.
    """
    luck = rng.normal(size=(20, 1))
    parts = [rows("search", "search", 0, {"gain": luck, "weight": 0.5})]
    parts.append(rows("search", "held_out", 0, {"gain": luck + shift, "weight": 0.5}))
    other = {"gain": luck + noise * rng.normal(size=(20, 1)), "weight": 0.2}
    return searched(
        *parts,
        rows("references", "held_out", 0, other),
        references=["published"],
        full=20,
    )


def test_the_winner_is_compared_with_references_on_the_same_blocks() -> None:
    asked = referred(1.0, 0.1, np.random.default_rng(8))
    (row,) = differences(asked).to_dict("records")
    assert (row["candidate"], row["reference"], row["n"]) == (0, "published", 20)
    assert row["low"] < 1.0 < row["high"]
    assert row["high"] - row["low"] < 0.2
    assert row["variance_reduction"] > 50.0
    (reference,) = references(asked).to_dict("records")
    assert reference["reference"] == "published"
    assert reference["held_out"] == pytest.approx(
        row["difference"] * -1 + winners(asked)["held_out"].iloc[0]
    )
    judged = asked.table[asked.table["phase"] == "held_out"].sort_values("block")
    mine, theirs = (
        judged.loc[judged["run"] == run, "gain"].to_numpy()
        for run in ("search", "references")
    )
    found = (row["difference"], row["low"], row["high"])
    assert found == pytest.approx(mean_interval(mine - theirs)[:3])


@pytest.mark.slow
@pytest.mark.parametrize("times", [80, 150])
def test_the_difference_from_an_equal_reference_is_covered(times: int) -> None:
    rng = np.random.default_rng(9)
    tables = [differences(referred(0.0, 1.0, rng)).iloc[0] for _ in range(times)]
    assert covers_as_it_should(
        sum(row["low"] <= 0.0 <= row["high"] for row in tables), times, 0.95
    )


def test_paired_bootstrap_differences_are_narrow_where_luck_is_shared() -> None:
    rng = np.random.default_rng(10)
    luck = rng.normal(size=(40, 2))
    cvar = Objective("gain", True, Statistic("cvar", 0.2))
    paired = difference_interval(
        cvar, luck + 1.0 + 0.01 * rng.normal(size=luck.shape), luck
    )
    assert paired.low < 1.0 < paired.high
    assert paired.high - paired.low < 0.05
    assert difference_interval(cvar, luck + 1.0, luck).value == pytest.approx(1.0)
    equal = difference_interval(cvar, np.ones((5, 1)), np.zeros((5, 1)))
    assert equal.value == 1.0
    assert np.isnan([equal.low, equal.high]).all()


def test_before_held_out_trials_the_best_are_shown_and_nothing_is_known() -> None:
    asked = made_up(
        np.random.default_rng(11), [float(k) * 9 for k in range(8)], judged=0
    )
    assert shown(asked) == [7, 6, 5, 4, 3]
    table = winners(asked)
    assert table["held_out"].isna().all()
    assert (table["held_out_n"] == 0).all()
    assert winners(
        searched(
            rows("search", "search", 0, {"gain": np.array([[np.nan]]), "weight": 0.1})
        )
    ).empty


def test_a_held_out_trial_without_result_leaves_nothing_known_and_is_counted() -> None:
    parts = [rows("search", "search", 0, {"gain": np.ones((4, 1)), "weight": 0.5})]
    states = np.array([["done"], ["timeout"], ["done"]])
    parts.append(
        rows(
            "search",
            "held_out",
            0,
            {"gain": np.ones((3, 1)), "weight": 0.5, "status": states},
        )
    )
    row = winners(searched(*parts)).iloc[0]
    assert np.isnan(row["held_out"])
    assert row["not_done"] == 1


def test_constraints_are_looked_at_again_on_held_out_seeds() -> None:
    hits = Constraint("hits", 1.0, True, Statistic("worst"))
    parts = [
        rows(
            "search", "search", 0, {"gain": np.ones((4, 1)), "weight": 0.5, "hits": 1.0}
        )
    ]
    parts.append(
        rows(
            "search",
            "held_out",
            0,
            {"gain": np.ones((4, 1)), "weight": 0.5, "hits": 3.0},
        )
    )
    assert winners(searched(*parts, constraints=(hits,))).iloc[0]["violation"] == 2.0


def fronted(
    points: list[tuple[float, float]], noise: float, seed: int = 12, fresh: int = 30
) -> MadeUp:
    rng, parts = np.random.default_rng(seed), []
    luck = rng.normal(size=(fresh, 1))
    for k, (gain, loss) in enumerate(points):
        exact = {
            "gain": np.full((4, 1), gain),
            "loss": np.full((4, 1), k / 100),
            "weight": k / 10,
        }
        exact["gain"] = exact["gain"] * 0 + k
        parts.append(rows("search", "search", k, exact))
        fresh_values = {
            "gain": gain + luck + noise * rng.normal(size=(fresh, 1)),
            "loss": loss + luck + noise * rng.normal(size=(fresh, 1)),
        }
        parts.append(rows("search", "held_out", k, fresh_values | {"weight": k / 10}))
    return searched(*parts, objectives=(GAIN, LOSS))


def test_a_front_says_how_sure_its_members_are_and_where_the_knee_is() -> None:
    table = front(
        fronted([(0.0, 0.0), (8.0, 1.0), (9.0, 9.0), (5.0, 5.0)], 0.5)
    ).set_index("candidate")
    assert table["on_front"].to_dict() == {0: True, 1: True, 2: True, 3: False}
    assert table["share"].to_dict() == {0: 1.0, 1: 1.0, 2: 1.0, 3: 0.0}
    assert table["beaten_by"].to_dict() == {0: -1, 1: -1, 2: -1, 3: 1}
    assert table.index[table["knee"]].tolist() == [1]


def test_of_two_points_equal_but_for_noise_each_is_on_the_front_sometimes() -> None:
    """The second is better in both objectives, in some of the eight tables by what was
    seen as well.
    """
    tables = [
        front(fronted([(0.0, 0.0), (0.1, -0.1)], 2.0, seed, fresh=10))
        for seed in range(8)
    ]
    assert any(not table["on_front"].all() for table in tables)
    assert all(table["share"].between(0.02, 1.0).all() for table in tables)
    assert all((table["beaten_by"] == -1).all() for table in tables)


@pytest.mark.parametrize("second", [(0.1, -50.0), (50.0, -0.1)])
def test_who_is_surely_better_in_one_objective_only_beats_nobody(
    second: tuple[float, float],
) -> None:
    for seed in range(8):
        assert (
            front(fronted([(0.0, 0.0), second], 2.0, seed, fresh=10))["beaten_by"] == -1
        ).all()


def test_a_front_that_nobody_has_judged_is_empty() -> None:
    asked = fronted([(0.0, 0.0), (1.0, 1.0)], 1.0)
    unjudged = MadeUp(
        asked.table[asked.table["phase"] == "search"],
        asked.description,
        asked.distributions,
    )
    assert front(unjudged).empty
