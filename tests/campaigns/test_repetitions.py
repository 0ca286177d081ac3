"""Repetitions of a search against random search, and the best so far."""

import numpy as np
import pandas as pd
import pytest
from scipy.stats import binom

from sweep.methods.search.objectives import Constraint, Objective
from sweep.methods.search.repetitions import (
    AgainstRandom,
    against_random,
    best_so_far,
    reference_point,
    runs,
)
from tests.made_up_searches import GAIN, MEAN, MadeUp, rows, searched

LOSS = Objective("loss", False, MEAN)
FALSE_ALARM = 1e-4
"""Chance that a correct interval fails the test of its coverage."""


def run_of(
    name: str, values: list[float], held_out: float, batch: int | None = None
) -> list[pd.DataFrame]:
    """Candidates with these values in two blocks, the best of them judged with the
    value `held_out`.
    """
    parts = [
        rows(
            name,
            "search",
            k,
            {"gain": np.full((2, 1), value), "weight": k / 10},
            batch=k if batch is None else batch,
        )
        for k, value in enumerate(values)
    ]
    winner = int(np.argmax(values))
    return [
        *parts,
        rows(
            name,
            "held_out",
            winner,
            {"gain": np.full((3, 1), held_out), "weight": winner / 10},
        ),
    ]


def test_runs_come_in_the_order_of_their_numbers() -> None:
    parts = [part for k in (10, 2, 1) for part in run_of(f"repetition {k}", [1.0], 1.0)]
    asked = searched(
        *parts, *run_of("search", [1.0], 1.0), *run_of("random 0", [1.0], 1.0)
    )
    assert runs(asked, "repetition") == [
        "repetition 1",
        "repetition 2",
        "repetition 10",
    ]
    assert runs(asked, "random") == ["random 0"]


def test_winners_are_compared_by_their_held_out_values() -> None:
    parts = [
        run_of("repetition 1", [1.0, 9.0], 5.0),
        run_of("repetition 2", [1.0], 7.0),
        run_of("random 0", [99.0], 2.0),
    ]
    parts.append(run_of("random 1", [99.0], 3.0))
    found = against_random(searched(*(part for run in parts for part in run), full=2))
    assert (found.quantity, found.maximize, found.without) == ("gain", True, (0, 0))
    assert (found.search.tolist(), found.random.tolist()) == ([5.0, 7.0], [2.0, 3.0])
    assert found.estimate.value == 3.5


def test_a_run_without_winner_is_counted() -> None:
    hits = Constraint("hits", 0.0, True, MEAN)
    parts = [part.assign(hits=0.0) for part in run_of("repetition 1", [1.0], 5.0)]
    parts += [part.assign(hits=0.0) for part in run_of("random 0", [1.0], 5.0)]
    parts += [
        rows(
            "random 1",
            "search",
            0,
            {"gain": np.ones((2, 1)), "weight": 0.1, "hits": 1.0},
        )
    ]
    found = against_random(searched(*parts, constraints=(hits,), full=2))
    assert found.without == (0, 1)
    assert len(found.random) == 1
    assert not found.estimate.testable


def test_where_there_is_no_difference_its_interval_covers_zero() -> None:
    """Welch's, of ten runs a side of which one kind scatters twice as much."""
    times, rng = 1000, np.random.default_rng(1)
    pairs = [(2.0 * rng.normal(size=10), rng.normal(size=10)) for _ in range(times)]
    bounds = [
        AgainstRandom("gain", True, *pair, (0, 0)).estimate.interval() for pair in pairs
    ]
    covered = sum(low <= 0.0 <= high for low, high in bounds)
    assert (
        binom.ppf(FALSE_ALARM / 2, times, 0.95)
        <= covered
        <= binom.ppf(1.0 - FALSE_ALARM / 2, times, 0.95)
    )


def test_the_best_so_far_after_each_batch_with_the_trials_spent() -> None:
    parts = [
        rows(
            "search",
            "search",
            k,
            {"gain": np.array(values)[:, None], "weight": k / 10},
            batch=batch,
        )
        for k, (batch, values) in enumerate(
            [(0, [1.0, 3.0]), (0, [9.0]), (1, [1.0, 2.0]), (2, [3.0, 3.0])]
        )
    ]
    table = best_so_far(searched(*parts, full=2))
    assert table["trials"].tolist() == [3, 5, 7]
    assert table["candidate"].tolist() == [0, 0, 3]
    assert table["value"].tolist() == [2.0, 2.0, 3.0]


def test_without_batches_a_candidate_is_a_step_and_shared_trials_count_once() -> None:
    parts = run_of("random 0", [2.0, 1.0, 3.0, 9.0], 0.0, batch=-1)
    parts[1]["trial_id"] = parts[0]["trial_id"].to_numpy()
    table = best_so_far(searched(*parts, full=2), "random 0")
    assert table["step"].tolist() == [0, 1, 2, 3]
    assert table["trials"].tolist() == [2, 2, 4, 6]
    assert table["value"].tolist() == [2.0, 2.0, 3.0, 9.0]


def test_nothing_is_known_before_there_is_a_feasible_candidate() -> None:
    hits = Constraint("hits", 0.0, True, MEAN)
    parts = [
        rows(
            "search",
            "search",
            k,
            {"gain": np.ones((2, 1)), "weight": 0.1 * k, "hits": 1.0 - k},
            batch=k,
        )
        for k in (0, 1)
    ]
    table = best_so_far(searched(*parts, constraints=(hits,), full=2))
    assert table["candidate"].tolist() == [-1, 1]
    assert np.isnan(table["value"][0])


def two_objectives() -> MadeUp:
    points = {
        "search": [(0.0, 9.0), (4.0, 4.0), (6.0, 6.0)],
        "repetition 1": [(6.0, 2.0)],
        "random 0": [(5.0, 3.0)],
    }
    parts = []
    for run, values in points.items():
        for k, (gain, loss) in enumerate(values):
            columns = {
                "gain": np.full((2, 1), gain),
                "loss": np.full((2, 1), loss),
                "weight": k / 10,
            }
            parts.append(rows(run, "search", k, columns, batch=k))
            parts.append(rows(run, "held_out", k, columns))
    return searched(*parts, objectives=(GAIN, LOSS), full=2)


def test_hypervolumes_of_all_runs_have_the_worst_values_seen_as_reference() -> None:
    asked = two_objectives()
    assert reference_point(asked) == pytest.approx([0.0, 9.0])
    assert best_so_far(asked)["value"].tolist() == [0.0, 20.0, 26.0]
    found = against_random(asked)
    assert (found.quantity, found.maximize) == ("hypervolume", True)
    assert (found.search.tolist(), found.random.tolist()) == ([42.0], [30.0])
