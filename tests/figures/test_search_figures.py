"""The figures of a search draw what its table says, and say what they count."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.errors import ChoiceError
from sweep.methods.search import figure as history_module
from sweep.methods.search import figure_layout as layout_module
from sweep.methods.search import figure_repetitions as runs_module
from sweep.methods.search.figure import front_figure, history_figure
from sweep.methods.search.figure_repetitions import (
    comparison_figure,
    hypervolume_figure,
)
from sweep.methods.search.objectives import Constraint, Objective, Statistic
from tests.made_up_searches import GAIN, MEAN, MadeUp, rows, searched

LOSS = Objective("loss", False, MEAN)
HITS = Constraint("hits", 0.0, True, Statistic("worst"))


class MadeUpStudy(SimpleNamespace):
    """What the figures need of a stored study."""

    __hash__ = object.__hash__


@pytest.fixture
def drawn(monkeypatch: pytest.MonkeyPatch):
    """A figure of a made-up search, laid out."""
    study = MadeUpStudy(
        name="my/gains", units={"gain": "%", "loss": "px"}, metrics=["gain", "loss"]
    )

    def of(figure: Any, asked: MadeUp) -> Figure:
        for module in (history_module, layout_module, runs_module):
            monkeypatch.setattr(module, "read_asked", lambda _study: asked)
        found: Figure = figure(study)
        found.draw_without_rendering()
        return found

    return of


def labels(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def line(axes: Axes, label: str) -> tuple[list[float], list[float]]:
    """The coordinates of what is drawn under a label."""
    (found,) = [one for one in axes.lines if one.get_label() == label]
    return [float(x) for x in found.get_xdata()], [float(y) for y in found.get_ydata()]


def candidate(
    number: int,
    gain: float,
    batch: int = 0,
    blocks: int = 4,
    run: str = "search",
    **more: object,
) -> pd.DataFrame:
    columns = {"gain": np.full((blocks, 1), gain), "weight": number / 10}
    return rows(run, "search", number, columns | more, batch=batch)


def judged(
    number: int, gain: float, run: str = "search", **more: object
) -> pd.DataFrame:
    values = gain + 0.1 * np.random.default_rng(number).normal(size=(12, 1))
    return rows(
        run,
        "held_out",
        number,
        {"gain": values - values.mean() + gain, "weight": number / 10} | more,
    )


def test_values_of_runs_lie_side_by_side() -> None:
    axes = Figure().subplots()
    for place, values in ((2, [1.0, 3.0, 2.0]), (3, [5.0])):
        runs_module._strip(axes, place, np.array(values), "k", "normal")
    several, _, one, _ = (line.get_xdata() for line in axes.lines)
    assert np.asarray(several) == pytest.approx([1.8, 2.0, 2.2])
    assert np.asarray(one) == pytest.approx([3.0])


def test_a_history_has_every_candidate_the_winner_by_then_and_what_is_held_out(
    drawn,
) -> None:
    parts = [
        candidate(0, 3.0, hits=0.0),
        candidate(1, 2.0, blocks=1, hits=0.0),
        candidate(2, 5.0, 1, hits=0.0),
    ]
    parts += [candidate(3, 9.0, 1, hits=1.0), candidate(4, 1.0, 1, blocks=1, hits=0.0)]
    parts += [judged(2, 4.0, hits=0.0), judged(0, 2.5, run="references", hits=0.0)]
    figure = drawn(
        history_figure, searched(*parts, constraints=(HITS,), references=["published"])
    )
    (axes,) = figure.axes
    assert line(axes, "4 blocks") == ([2.5, 8.0], [3.0, 5.0])
    assert line(axes, "fewer blocks")[1] == [2.0]
    assert line(axes, "not feasible")[1] == [9.0]
    assert line(axes, "winner by then") == ([5.0, 14.0], [3.0, 5.0])
    assert line(axes, "winner, held out")[1] == [pytest.approx(4.0)]
    assert line(axes, "published, held out")[1] == [pytest.approx(2.5)]
    assert line(axes, "winner, held out")[0][0] > 14.0
    assert (
        "my/gains: 5 candidates, 14 trials; 1 held out, 12 blocks each, simultaneous"
        " 95 %" in said(figure)
    )
    assert axes.get_ylabel() == "gain (%)\nmore is better"


@pytest.mark.parametrize(("held_out", "beyond"), [(9.5, [2.75]), (1.5, None)])
def test_no_held_out_interval_lies_beyond_the_worst_candidates(
    drawn, held_out: float, beyond: list[float] | None
) -> None:
    """With four gains from 2 to 5 the axis has room for three of them, and for what is
    held out.
    """
    parts = [candidate(k, 2.0 + k) for k in range(4)]
    figure = drawn(history_figure, searched(*parts, judged(3, held_out)))
    ends = [] if beyond is None else line(figure.axes[0], "worse than this")[1]
    assert ends == (beyond or [])
    assert ("worse than this" in labels(figure)) == (beyond is not None)


def said(figure: Figure) -> str:
    return " ".join(figure.get_supxlabel().split())


def test_failed_candidates_are_counted_and_a_search_without_winner_is_drawn(
    drawn,
) -> None:
    parts = [
        candidate(0, 3.0, hits=1.0),
        candidate(1, 2.0, blocks=1, hits=0.0, status="failed"),
    ]
    figure = drawn(history_figure, searched(*parts, constraints=(HITS,)))
    assert "2 candidates, 1 failed and not drawn" in said(figure)
    assert "not feasible" in labels(figure)


def two(judge: bool = True) -> MadeUp:
    points = [(0.0, 0.0), (8.0, 1.0), (9.0, 9.0), (5.0, 5.0)]
    parts = [candidate(k, gain, loss=loss) for k, (gain, loss) in enumerate(points)]
    if judge:
        parts += [
            judged(k, gain, loss=np.full((12, 1), loss))
            for k, (gain, loss) in enumerate(points[:3])
        ]
        parts.append(judged(0, 4.0, run="references", loss=2.0))
    return searched(*parts, objectives=(GAIN, LOSS), references=["published"])


def test_a_front_has_intervals_both_ways_its_knee_and_the_references(drawn) -> None:
    figure = drawn(front_figure, two())
    (axes,) = figure.axes
    x, y = line(axes, "chosen, held out")
    assert sorted(zip(np.round(x, 6), np.round(y, 6), strict=True)) == [
        (0.0, 0.0),
        (8.0, 1.0),
        (9.0, 9.0),
    ]
    assert line(axes, "knee") == ([pytest.approx(8.0)], [pytest.approx(1.0)])
    assert line(axes, "published, held out") == (
        [pytest.approx(4.0)],
        [pytest.approx(2.0)],
    )
    assert line(axes, "candidates") == ([0.0, 8.0, 9.0, 5.0], [0.0, 1.0, 9.0, 5.0])
    assert (
        "4 candidates on the seeds of the search; 3 held out, 12 blocks each"
        in said(figure)
    )
    assert axes.get_xlabel() == "gain (%)\nmore is better"


def test_a_history_and_a_front_that_nobody_has_judged_are_drawn(drawn) -> None:
    assert "front, held out" not in labels(drawn(history_figure, two(judge=False)))
    figure = drawn(front_figure, two(judge=False))
    assert labels(figure) == ["candidates"]
    assert "no held-out trials" in said(figure)


def test_three_objectives_have_a_panel_each_pair(drawn) -> None:
    parts = [
        candidate(k, float(k), loss=float(k), effort=float(3 - k)) for k in range(4)
    ]
    wanted = (GAIN, LOSS, Objective("effort", False, MEAN))
    assert len(drawn(front_figure, searched(*parts, objectives=wanted)).axes) == 3


def repeated(several: bool = False) -> MadeUp:
    parts = [candidate(0, 1.0, loss=2.0), candidate(1, 3.0, 1, loss=1.0)]
    for kind, better in (("repetition", 2.0), ("random", 0.0)):
        for k in range(1, 4):
            run = f"{kind} {k}"
            parts += [
                candidate(0, 1.0, run=run, loss=2.0),
                candidate(1, 3.0 + better + k, 1, run=run, loss=1.0),
            ]
            parts.append(judged(1, 3.0 + better + k, run=run, loss=1.0))
    return searched(*parts, objectives=(GAIN, LOSS) if several else (GAIN,), budget=8)


def test_a_comparison_has_the_mean_best_so_far_and_a_point_a_run(drawn) -> None:
    figure = drawn(comparison_figure, repeated())
    left, right = figure.axes
    assert line(left, "search") == ([4.0, 8.0], [1.0, 7.0])
    assert line(left, "random search") == ([4.0, 8.0], [1.0, 5.0])
    assert [sorted(np.round(one.get_ydata(), 6)) for one in right.lines[::2]] == [
        [6.0, 7.0, 8.0],
        [4.0, 5.0, 6.0],
    ]
    assert (
        "3 repetitions and 3 random searches of 8 trials each; means with 95 %"
        " confidence intervals over runs" in said(figure)
    )
    assert left.get_ylabel() == "best gain (%)"


def test_a_comparison_names_the_statistic(drawn) -> None:
    asked = repeated()
    tail = Objective("gain", True, Statistic("quantile", 0.25))
    asked.description["objectives"] = [tail.as_json()]
    assert (
        drawn(comparison_figure, asked).axes[0].get_ylabel()
        == "best quantile 0.25 of gain (%)"
    )


def test_several_objectives_are_compared_by_hypervolume(drawn) -> None:
    figure = drawn(comparison_figure, repeated(several=True))
    assert figure.axes[0].get_ylabel() == "hypervolume,\ngain (%) x loss (px)"
    assert line(figure.axes[0], "search")[1] == [0.0, 6.0]
    figure = drawn(hypervolume_figure, repeated(several=True))
    assert line(figure.axes[0], "the search") == ([4.0, 8.0], [0.0, 2.0])
    assert "from the worst values seen: gain 1, loss 2" in said(figure)
    assert (
        "3 repetitions and 3 random searches of 8 trials each; on the seeds of the"
        " search" in said(figure)
    )


def test_the_hypervolume_of_a_search_alone_has_room_above_it_and_begins_at_no_trials(
    drawn,
) -> None:
    parts = [candidate(0, 1.0, loss=2.0), candidate(1, 3.0, 1, loss=1.0)]
    figure = drawn(
        hypervolume_figure, searched(*parts, objectives=(GAIN, LOSS), budget=8)
    )
    (axes,) = figure.axes
    assert axes.get_xlim()[0] == axes.get_ylim()[0] == 0.0
    assert axes.get_ylim()[1] > max(line(axes, "the search")[1]) == 2.0
    assert ": 8 trials; on the seeds of the search" in said(figure)


@pytest.mark.parametrize(
    ("figure", "message"),
    [
        (front_figure, "front needs two objectives; allowed for a single"),
        (hypervolume_figure, "hypervolume needs two objectives; allowed for a single"),
        (comparison_figure, "has no repetitions; run the search with --repetitions 10"),
    ],
)
def test_a_figure_that_does_not_suit_a_search_says_so(
    drawn, figure: Any, message: str
) -> None:
    with pytest.raises(ChoiceError, match=message):
        drawn(figure, searched(candidate(0, 1.0)))
