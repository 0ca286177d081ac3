"""What `sweep.load` gives: the study, what its search found, which settings matter."""

from pathlib import Path

import pandas as pd
import pytest

import sweep
from sweep.campaigns.loaded import LoadedStudy
from sweep.campaigns.search.asked_trials import read_asked
from sweep.campaigns.search.held_out import front, winners
from sweep.campaigns.search.outcome import candidates
from sweep.errors import ChoiceError
from sweep.tables.sensitivity import morris, rank_correlations, sensitivity, sobol
from tests.plotted import study
from tests.sampled import axis, study_of
from tests.searches import TINY, asked_by


def loaded(name: str) -> LoadedStudy:
    stored = study(name)
    return sweep.load(name, stored.store.folder.parent)


def test_what_a_search_found_is_that_of_its_tables() -> None:
    found, asked = loaded("searched").search, read_asked(study("searched"))
    pd.testing.assert_frame_equal(found.candidates, candidates(asked))
    pd.testing.assert_frame_equal(found.winners, winners(asked))
    pd.testing.assert_frame_equal(found.front, front(asked))
    assert len(found.differences) > 0


def test_a_study_that_is_no_search_or_a_part_of_one_says_so() -> None:
    with pytest.raises(ChoiceError, match="study small: not a search"):
        _ = loaded("small").search
    part = loaded("searched").where(n=12)
    with pytest.raises(ChoiceError, match="a search is a whole: ask it before where"):
        _ = part.search


def test_one_objective_has_no_front(tmp_path: Path) -> None:
    asked_by(TINY, tmp_path)
    with pytest.raises(ChoiceError, match="study tiny: a front needs two objectives"):
        _ = sweep.load("tiny", tmp_path).search.front


def test_a_part_of_a_loaded_study_is_one() -> None:
    whole = loaded("drawn")
    part = whole.where(n=6)
    assert type(part) is type(whole)
    table = part.sensitivity("speed", resamples=20)
    assert set(table["trials"]) == {60}
    assert set(whole.sensitivity("speed", resamples=20)["n"]) == {6, 12}


@pytest.mark.parametrize(
    ("sample", "analysis", "same"),
    [
        ("morris", None, morris),
        ("random", None, rank_correlations),
        ("morris", "ranks", rank_correlations),
        ("saltelli", None, sobol),
    ],
)
def test_the_analysis_is_that_for_which_the_sample_was_made(
    sample: str, analysis: str | None, same: object
) -> None:
    made = study_of(axis(sample, 4))
    found = sensitivity(made, "speed", analysis=analysis, resamples=10)
    pd.testing.assert_frame_equal(found, same(made, "speed", resamples=10))
