"""What `sweep.load` gives: the study, what its search found, which settings matter."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pandas as pd
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text

import sweep
from sweep.errors import ChoiceError
from sweep.figures import (
    heatmap_figure,
    narrowing_figure,
    parallel_figure,
    pareto_figure,
    scatter_figure,
)
from sweep.loaded import LoadedStudy
from sweep.methods.search.asked_trials import read_asked
from sweep.methods.search.held_out import front, winners
from sweep.methods.search.outcome import candidates
from sweep.methods.sensitivity import morris, rank_correlations, sensitivity, sobol
from tests.plotted import study
from tests.sampled import axis, study_of
from tests.searches import TINY, asked_by
from tests.studies import SMALL, launched


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
    with pytest.raises(ChoiceError, match="a search cannot be restricted by where"):
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


@pytest.fixture(scope="module")
def piloted(tmp_path_factory: pytest.TempPathFactory) -> LoadedStudy:
    folder = tmp_path_factory.mktemp("piloted")
    launched(SMALL.replace("replicates: 3", "replicates: 6"), folder)
    return sweep.load("small", folder)


def test_over_half_is_asked_for_alike_everywhere(piloted: LoadedStudy) -> None:
    whole = loaded("drawn")
    first = next(iter(whole.metrics))
    column = f"{first}_mean"
    table = whole.table(first, over="half")
    assert column in table
    same = pd.testing.assert_frame_equal
    same(table, whole.table(first, half=True))
    same(whole.means(first, over="half"), whole.means(column))
    same(
        whole.sensitivity(first, over="half", resamples=20),
        whole.sensitivity(column, resamples=20),
    )
    needs = piloted.power({"speed": "5%"}, over="half")
    same(needs, piloted.power({"speed": "5%"}, half=True))
    assert set(needs["metric"]) == {"speed_mean"}
    place, one = whole.store.folder.parent, whole.name
    sides = (f"{one}:n=6", f"{one}:n=12", first)
    half = sweep.compare(*sides, results=place, over="half").rows
    same(half, sweep.compare(*sides, results=place, half=True).rows)
    assert set(half["metric"]) == {column}


def test_another_name_of_the_last_half_says_how_it_is_asked_for() -> None:
    whole = loaded("drawn")
    first = next(iter(whole.metrics))
    said = f'"{first}_mean" is the mean of {first} over the second half; use'
    said += f' {first} with over="half", in a command --over half'
    sides = (f"{whole.name}:n=6", f"{whole.name}:n=12")
    asking: list[Callable[[], object]] = [
        lambda: whole.table([f"{first}_mean"]),
        lambda: whole.power({f"{first}_mean": "5%"}),
        lambda: sweep.compare(
            *sides, f"{first}_mean", results=whole.store.folder.parent
        ),
    ]
    for ask in asking:
        with pytest.raises(ChoiceError, match=re.escape(said)):
            ask()
    with pytest.raises(ChoiceError, match='"haf"; did you mean "half"'):
        whole.table(first, over="haf")
    with pytest.raises(ChoiceError, match='"haf"; did you mean "half"'):
        whole.means(first, over="haf")


@pytest.mark.parametrize(
    "draw",
    [
        heatmap_figure,
        scatter_figure,
        parallel_figure,
        narrowing_figure,
        partial(pareto_figure, second="dispersion"),
    ],
)
def test_figures_over_half_are_those_of_the_means(
    draw: Callable[..., Figure], piloted: LoadedStudy
) -> None:
    stored = piloted if draw is narrowing_figure else study("drawn")
    metric = stored.metrics[0]

    def texts(figure: Figure) -> list[str]:
        return [one.get_text() for one in figure.findobj(Text)]

    half = draw(stored, metric, over="half")
    others = {"second": "dispersion_mean"} if isinstance(draw, partial) else {}
    assert texts(half) == texts(draw(stored, f"{metric}_mean", **others))
    assert texts(half) != texts(draw(stored, metric))
