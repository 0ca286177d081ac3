"""What a report says of a search: honest words, settings to paste, and JSON that other
programs read.
"""

import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from kernels.catalogue import BUILT_IN
from sweep.analysis.notation import with_interval
from sweep.methods.search import report
from sweep.methods.search.objectives import Constraint, Objective, Statistic
from sweep.methods.search.sentences import (
    edges,
    thin_tail,
    verdict,
)
from sweep.spec.settings import Setting, settings_of
from sweep.spec.strict_yaml import parse_document
from sweep.tables import Report, TextTable
from tests.made_up_searches import GAIN, MEAN, MadeUp, rows, searched
from tests.reports import as_text

LOSS = Objective("loss", False, MEAN)
ABOUT = {
    "batch": 12,
    "level": 0.1,
    "scenarios": 1,
    "options": {},
    "repeated": {"search": 2},
}


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch):
    """The report of a made-up search as text, and as JSON."""
    study = SimpleNamespace(
        name="my/gains",
        units={"gain": "%"},
        provenance={"model": "aziel_chen2025", "preset": "as_run"},
        settings=settings_of("aziel_chen2025", BUILT_IN),
    )

    def of(asked: MadeUp) -> tuple[str, dict]:
        columns = {"weight": "cohesion_weight"}
        about = (
            ABOUT
            | asked.description
            | {
                "parameters": ["cohesion_weight"],
                "ranges": {"cohesion_weight": {"uniform": [0.0, 1.0]}},
            }
        )
        monkeypatch.setattr(
            report,
            "read_asked",
            lambda _study: MadeUp(
                asked.table.rename(columns=columns), about, asked.distributions
            ),
        )
        found = report.search_report(study)
        return as_text(found), json.loads(found.to_json())

    return of


def candidate(
    number: int,
    gain: float,
    *,
    weight: float = 0.5,
    blocks: int = 4,
    fresh: int = 12,
    **more: object,
) -> pd.DataFrame:
    """A candidate with that gain but for small noise, and with held-out blocks if
    `fresh` is not zero.
    """
    rng = np.random.default_rng(number)
    parts = []
    for phase, n in (("search", blocks), ("held_out", fresh)):
        columns = {
            "gain": gain + 0.1 * rng.normal(size=(n, 1)),
            "weight": weight + number / 1000,
        }
        if n:
            parts.append(rows("search", phase, number, columns | more))
    return pd.concat(parts, ignore_index=True)


def reference(gain: float, fresh: int = 12) -> pd.DataFrame:
    values = gain + 0.1 * np.random.default_rng(99).normal(size=(fresh, 1))
    return rows("references", "held_out", 0, {"gain": values, "weight": 0.3})


def test_it_says_in_how_many_trials_an_objective_is_undefined(said) -> None:
    gains = np.array([[5.0], [np.nan], [5.1], [4.9]])
    unknown = rows("search", "search", 1, {"gain": gains, "weight": 0.2})
    text, _ = said(searched(candidate(0, 5.0), unknown))
    told = (
        "note        gain has no value in 5 % of the done trials; a candidate of such"
    )
    assert told in text
    text, _ = said(searched(candidate(0, 5.0)))
    assert "has no value" not in text


def test_it_says_what_was_searched_and_what_became_of_candidates(said) -> None:
    failed = candidate(2, 9.0, blocks=1, fresh=0, status=np.array([["failed"]]))
    text, found = said(
        searched(
            candidate(0, 5.0),
            candidate(1, 4.0, blocks=1, fresh=0),
            failed,
            budget=600,
            rejected={"search": 3},
        )
    )
    assert "search      my/gains: aziel_chen2025 as_run, cohesion_weight" in text
    assert "objective   mean gain, to be large" in text
    assert (
        "sampler     tpe, batches of 12, racing at 0.1; up to 4 blocks per candidate"
        in text
    )
    assert "budget      6 of 600 trials spent" in text
    assert (
        "candidates  3 asked: 1 complete, 1 raced out, 1 failed; 3 more rejected by the"
        " spec; 2 more were proposed before" in text
    )
    assert found["spent"] == 6
    assert [row["status"] for row in found["candidates"]] == [
        "complete",
        "raced out",
        "failed",
    ]


def test_the_settings_of_the_winner_can_be_pasted_into_a_spec(said) -> None:
    text, found = said(searched(candidate(0, 5.0, weight=0.123456789)))
    block = text[text.index("fixed:") :].split("\n\n")[0]
    assert parse_document(block, Path("report")).value == {
        "fixed": {"cohesion_weight": 0.123457}
    }
    assert found["best"] == {"candidate": 0, "cohesion_weight": 0.123456789}


def test_estimates_come_with_intervals_and_how_much_too_good_the_search_was(
    said,
) -> None:
    text, found = said(searched(candidate(0, 5.0), candidate(1, 4.0)))
    first, second = found["winners"]
    assert first["candidate"] == 0
    assert second["held_out_low"] < 4.0 < second["held_out_high"]
    assert (
        with_interval(first["held_out"], first["held_out_low"], first["held_out_high"])
        in text
    )
    assert "gain (%), 95 % confidence intervals over blocks" in text


@pytest.mark.parametrize(
    ("gain", "words"),
    [
        (4.0, "The winner is better than published in gain by {} % points"),
        (6.0, "The winner is worse than published in gain by {} % points"),
        (
            5.0,
            (
                "The winner is not shown to differ from published in gain: the"
                " difference is {} % points"
            ),
        ),
    ],
)
def test_references_are_compared_in_plain_words(said, gain: float, words: str) -> None:
    text, found = said(
        searched(candidate(0, 5.0), reference(gain), references=["published"])
    )
    change = found["differences"][0]
    numbers = [change["difference"], change["low"], change["high"]]
    if gain == 6.0:
        numbers = [-numbers[0], -numbers[2], -numbers[1]]
    assert words.format(with_interval(*numbers)) in text
    assert found["references"][0]["reference"] == "published"
    assert found["differences"][0]["n"] == 12


def test_less_is_better_where_the_objective_says_so() -> None:
    change = {"difference": -2.0, "low": -3.0, "high": -1.0}
    assert (
        verdict(LOSS, change, "px", "The winner", "it")
        == "The winner is better than it in loss by 2.0 (1.0 to 3.0) px"
    )
    assert "is worse than" in verdict(GAIN, change, "", "A", "B")
    assert "without a confidence interval" in verdict(
        GAIN, change | {"low": np.nan, "high": np.nan}, "", "A", "B"
    )
    assert "held-out results are missing" in verdict(
        GAIN, dict.fromkeys(change, np.nan), "", "A", "B"
    )


def test_a_search_that_is_not_finished_says_so(said) -> None:
    text, found = said(searched(candidate(0, 5.0, blocks=2, fresh=0), finished=False))
    assert (
        "note        The search is not finished: repeat the command to resume" in text
    )
    assert "No candidate has all 4 blocks, the best has 2" in text
    assert "No held-out trials have run" in text
    assert len(found["warnings"]) == 3
    assert found["winners"][0]["held_out"] is None


def test_few_held_out_blocks_and_missing_results_are_said(said) -> None:
    text, _ = said(searched(candidate(0, 5.0, fresh=3)))
    assert "There are 3 held-out blocks only" in text
    parts = (
        candidate(0, 5.0, fresh=0),
        rows(
            "search",
            "held_out",
            0,
            {"gain": np.ones((12, 1)), "weight": 0.5, "status": states()},
        ),
    )
    text, found = said(searched(*parts))
    assert "Candidate 0: 1 held-out trials have no result." in text
    assert found["winners"][0]["held_out"] is None


def test_a_tail_of_few_blocks_is_said(said) -> None:
    cvar = Objective("gain", True, Statistic("cvar", 0.2))
    text, _ = said(searched(candidate(0, 5.0, fresh=40), objectives=(cvar,)))
    assert "The CVaR 0.2 of gain rests on few of 40 held-out blocks" in text
    assert "use 50 held-out replicates." in text
    assert (
        "rests on few"
        not in said(searched(candidate(0, 5.0, fresh=50), objectives=(cvar,)))[0]
    )
    assert thin_tail(Objective("gain", True, Statistic("quantile", 0.9)), 99)
    assert thin_tail(Objective("gain", True, Statistic("quantile", 0.9)), 101) == ""


def states() -> np.ndarray:
    return np.array([["done"]] * 11 + [["diverged"]])


def test_without_a_feasible_candidate_there_is_no_winner(said) -> None:
    hits = Constraint("hits", 0.0, True, Statistic("worst"))
    text, found = said(
        searched(candidate(0, 5.0, fresh=0, hits=2.0), constraints=(hits,))
    )
    assert "There is no winner: no candidate is feasible" in text
    assert "worst hits at most 0" in text
    assert "1 not feasible" in text
    assert found["best"] is None
    assert found["winners"] == []


def test_constraints_that_held_out_seeds_violate_are_said(said) -> None:
    hits = Constraint("hits", 0.0, True, MEAN)
    parts = (
        candidate(0, 5.0, fresh=0, hits=0.0),
        candidate(0, 5.0, hits=2.0).query("phase == 'held_out'"),
    )
    text, _ = said(searched(*parts, constraints=(hits,)))
    assert "Candidate 0 violates a constraint on held-out seeds, by 2." in text


def test_a_winner_at_the_edge_of_a_range_is_a_warning(said) -> None:
    text, _ = said(searched(candidate(0, 5.0, weight=0.99)))
    assert (
        "cohesion_weight = 0.99 is at the upper end of its range, 0 to 1: widen the"
        in text
    )
    assert "widen" not in said(searched(candidate(0, 5.0)))[0]


def test_an_edge_is_one_only_where_the_model_allows_more() -> None:
    settings = {
        name: Setting(name, "float", "", "", low=0.0, high=10.0)
        for name in ("a", "b", "c", "d", "e")
    }
    ranges = {
        "a": {"uniform": [0.0, 1.0]},
        "b": {"loguniform": [0.001, 1.0]},
        "c": {"integers": [2, 3]},
        "d": {"integers": [1, 9]},
        "e": {"choice": ["x", "y"]},
    }
    assert (
        edges({"a": 0.0, "b": 0.01, "c": 2, "d": 5, "e": "x"}, ranges, settings) == []
    )
    found = edges(
        {"a": 0.999, "b": 0.00101, "c": 3, "d": 1, "e": "y"}, ranges, settings
    )
    assert [sentence.split(",")[0] for sentence in found] == [
        "a = 0.999 is at the upper end of its range",
        "b = 0.00101 is at the lower end of its range",
        "d = 1 is at the lower end of its range",
    ]
    assert edges({"a": 0.5}, {"a": {"uniform": [0.5, 0.5]}}, settings) == []


def test_a_front_names_its_knee_and_how_sure_it_is(said) -> None:
    parts = []
    for k, (gain, loss) in enumerate([(0.0, 0.0), (8.0, 1.0), (9.0, 9.0)]):
        for phase, n in (("search", 4), ("held_out", 12)):
            columns = {
                "gain": np.full((n, 1), gain),
                "loss": np.full((n, 1), loss),
                "weight": 0.3 + k / 10,
            }
            parts.append(rows("search", phase, k, columns))
    text, found = said(searched(*parts, objectives=(GAIN, LOSS)))
    assert "# candidate 1, the knee of the front" in text
    assert [row["knee"] for row in found["front"]] == [
        row["candidate"] == 1 for row in found["front"]
    ]
    assert (
        "objective   mean gain, to be large\n            mean loss, to be small" in text
    )
    assert "on the held-out front" in text
    assert "yes, its knee" in text
    for heading in (line for line in text.splitlines() if line.startswith("┃")):
        names = [name.strip() for name in heading.strip("┃").split("┃")]
        assert len(set(names)) == len(names)
        assert "" not in names


def test_no_cell_is_cut_off() -> None:
    """A cell that is wider than the pipe takes several lines."""
    table = TextTable(["candidate", "held out"], [["7", "9" * 300]])
    assert as_text(Report(pd.DataFrame(), {}, [table])).count("9") == 300


def test_what_common_seeds_save_is_a_dash_where_it_is_not_known(said) -> None:
    parts = []
    for run, phase in (
        ("search", "search"),
        ("search", "held_out"),
        ("references", "held_out"),
    ):
        noise = np.random.default_rng(len(parts)).normal(size=(12, 1))
        parts.append(rows(run, phase, 0, {"gain": noise, "loss": noise, "weight": 0.3}))
    tail = Objective("loss", False, Statistic("cvar", 0.5))
    text, _ = said(searched(*parts, objectives=(GAIN, tail), references=["usual"]))
    saved = [
        line.split("│")[-2].strip()
        for line in text.splitlines()
        if line.startswith("│ 0") and "usual" in line
    ]
    assert saved[1] == "-" != saved[0]


def test_repetitions_are_compared_with_random_search(said) -> None:
    parts = [candidate(0, 5.0)]
    for kind, gain in (("repetition", 7.0), ("random", 5.0)):
        for k in range(1, 4):
            columns = {"gain": np.full((4, 1), gain + k / 10), "weight": 0.5}
            parts += [
                rows(f"{kind} {k}", phase, 0, columns)
                for phase in ("search", "held_out")
            ]
    text, found = said(searched(*parts, budget=600))
    assert (
        "3 repetitions of the search against 3 random searches of 600 trials each"
        in text
    )
    assert (
        "The search is better than random search in gain by 2.00 (1.77 to 2.23) %"
        " points" in text
    )
    assert found["against_random"]["difference"] == pytest.approx(2.0)
    few, _ = said(
        searched(
            *(part for part in parts if not part["run"].iloc[0].endswith(("2", "3")))
        )
    )
    assert "too few to compare" in few
