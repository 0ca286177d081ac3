"""What became of candidates, and which of them are chosen."""

import numpy as np
import pandas as pd
import pytest

from sweep.methods.search.objectives import Constraint, Objective, Statistic
from sweep.methods.search.outcome import candidates, chosen
from tests.made_up_searches import GAIN, MEAN, rows, searched

LOSS = Objective("loss", False, MEAN)


def gains(
    candidate: int,
    values: list[float],
    *,
    run: str = "search",
    weight: float | None = None,
    **more: object,
):
    """A candidate with one scenario and the gain of each block."""
    columns = {
        "gain": np.array(values, float)[:, None],
        "weight": candidate / 100 if weight is None else weight,
    }
    batch = int(more.pop("batch", 0))
    return rows(run, "search", candidate, columns | more, batch=batch)


def test_each_candidate_has_its_blocks_its_estimate_and_what_became_of_it() -> None:
    asked = searched(
        gains(0, [1.0, 2.0, 3.0, 6.0]),
        gains(1, [0.0]),
        gains(2, [5.0, 5.0], status=np.array([["done"], ["failed"]])),
        gains(3, [9.0, 1.0], batch=1),
        full=4,
    )
    table = candidates(asked)
    assert list(table.columns) == [
        *(
            "candidate",
            "batch",
            "weight",
            "same_as",
            "blocks",
            "trials",
            "violation",
            "feasible",
            "status",
            "gain",
        )
    ]
    assert table["blocks"].tolist() == [4, 1, 2, 2]
    assert table["status"].tolist() == ["complete", "raced out", "failed", "raced out"]
    assert table["gain"].tolist()[:2] == [3.0, 0.0]
    assert np.isnan(table["gain"][2])
    assert table["feasible"].all()


def test_the_last_batch_of_a_spent_budget_may_have_been_cut_short() -> None:
    parts = (
        gains(0, [1.0] * 4),
        gains(1, [1.0]),
        gains(2, [1.0, 2.0], batch=1),
        gains(3, [3.0], batch=1),
    )
    assert candidates(searched(*parts, budget=8))["status"].tolist() == [
        "complete",
        "raced out",
        *["cut short"] * 2,
    ]
    assert candidates(searched(*parts, budget=9))["status"].tolist() == [
        "complete",
        *["raced out"] * 3,
    ]
    unfinished = searched(*parts, budget=99, finished=False)
    assert candidates(unfinished)["status"].tolist() == [
        "complete",
        "raced out",
        *["cut short"] * 2,
    ]


def test_a_block_counts_when_it_has_run_in_every_scenario() -> None:
    values = {"gain": np.array([[1.0, 3.0], [5.0, 7.0], [9.0, 11.0]]), "weight": 0.5}
    states = np.array([["done", "done"], ["done", "missing"], ["done", "done"]])
    table = candidates(
        searched(rows("search", "search", 0, values | {"status": states}))
    )
    assert table["blocks"].tolist() == [1]
    assert table["trials"].tolist() == [5]
    assert table["gain"].tolist() == [2.0]


def test_trials_that_candidates_share_count_once_against_the_budget() -> None:
    shared = gains(0, [1.0, 2.0], weight=0.5), gains(1, [1.0], weight=0.5, batch=1)
    shared[1]["trial_id"] = shared[0]["trial_id"][:1].to_numpy()
    table = candidates(searched(*shared, budget=3, full=4))
    assert table["same_as"].tolist() == [0, 0]
    assert table["status"].tolist() == ["raced out", "raced out"]


def test_constraints_make_candidates_infeasible_and_so_does_the_unknown() -> None:
    hits = Constraint("hits", 1.0, True, Statistic("worst"))
    asked = searched(
        gains(0, [1.0, 1.0], hits=np.array([[0.0], [3.0]])),
        gains(1, [1.0, 1.0], hits=np.array([[0.0], [1.0]])),
        gains(2, [1.0, 1.0], hits=np.array([[0.0], [np.nan]])),
        constraints=(hits,),
    )
    table = candidates(asked)
    assert table["feasible"].tolist() == [False, True, False]
    assert table["violation"].tolist()[:2] == [2.0, 0.0]
    assert table["status"].tolist() == ["raced out", "raced out", "failed"]


def test_the_winner_is_the_best_with_all_blocks_even_if_fewer_look_better() -> None:
    asked = searched(
        gains(0, [2.0] * 4), gains(1, [3.0] * 4), gains(2, [9.0]), gains(3, [1.0] * 4)
    )
    assert chosen(candidates(asked), [GAIN], 2) == [1, 0]
    lower = Objective("gain", False, MEAN)
    assert chosen(
        candidates(
            searched(*(gains(k, [k + 1.0] * 4) for k in range(3)), objectives=(lower,))
        ),
        [lower],
        5,
    ) == [
        0,
        1,
        2,
    ]


def test_where_none_has_all_blocks_those_with_most_count() -> None:
    assert chosen(
        candidates(searched(gains(0, [2.0, 2.0]), gains(1, [3.0]), full=8)), [GAIN], 5
    ) == [0]


def test_of_equal_candidates_the_first_is_chosen_and_no_setting_twice() -> None:
    parts = [
        gains(k, [1.0] * 4, weight=weight)
        for k, weight in enumerate([0.1, 0.2, 0.1, 0.3])
    ]
    assert chosen(candidates(searched(*parts)), [GAIN], 5) == [0, 1, 3]


def test_one_candidate_wins_and_none_does_where_all_are_infeasible_or_failed() -> None:
    assert chosen(candidates(searched(gains(4, [1.0]))), [GAIN], 5) == [4]
    failed = gains(0, [1.0], status=np.array([["timeout"]]))
    assert chosen(candidates(searched(failed)), [GAIN], 5) == []
    hits = Constraint("hits", 0.0, True, MEAN)
    asked = searched(
        gains(0, [1.0], hits=1.0), gains(1, [1.0], hits=2.0), constraints=(hits,)
    )
    assert chosen(candidates(asked), [GAIN], 5) == []
    for value in (np.nan, np.inf):
        unknown = candidates(searched(gains(0, [value])))
        assert unknown["status"].tolist() == ["failed"]
        assert chosen(unknown, [GAIN], 5) == []


def two(points: list[tuple[float, float]]) -> pd.DataFrame:
    parts = [
        gains(k, [gain] * 4, loss=np.full((4, 1), loss))
        for k, (gain, loss) in enumerate(points)
    ]
    return candidates(searched(*parts, objectives=(GAIN, LOSS)))


def test_of_several_objectives_the_front_is_chosen_best_first_objective_first() -> None:
    table = two([(1.0, 1.0), (3.0, 3.0), (2.0, 5.0), (2.0, 2.0), (3.0, 4.0)])
    assert chosen(table, [GAIN, LOSS], 5) == [1, 3, 0]


@pytest.mark.parametrize(("most", "expected"), [(3, [4, 2, 0]), (1, [2])])
def test_a_long_front_is_thinned_to_what_adds_most(
    most: int, expected: list[int]
) -> None:
    table = two([(0.0, 0.0), (0.1, 2.0), (6.0, 3.0), (6.1, 4.5), (10.0, 10.0)])
    assert chosen(table, [GAIN, LOSS], most) == expected
