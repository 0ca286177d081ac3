"""The figure of half widths against the number of trials."""

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import by_point, mean_interval
from sweep.errors import ChoiceError
from sweep.figures import narrowing_figure
from sweep.figures.planning import Choices
from sweep.figures.saving import save
from sweep.methods.adaptive import figure as narrowing
from sweep.methods.adaptive.figure import half_widths, narrowing_layout
from sweep.methods.adaptive.figure import marks as marks_of
from sweep.tables.stored_study import StoredStudy
from tests.plotted import legend_texts, shown, study


def having(change: Callable[[pd.DataFrame], pd.DataFrame]) -> StoredStudy:
    """The study of nine trials a point with other trials."""
    part = copy.copy(study("repeated"))
    part.trials = change(part.trials.copy())
    return part


def widths(part: StoredStudy) -> dict[tuple[str, int], float]:
    table = half_widths(narrowing_layout(part, "speed", by=None))
    return {(point, n): half for point, n, half in table.to_numpy()}


def test_each_width_is_that_of_the_first_replicates() -> None:
    part = having(lambda trials: trials.sort_values("speed"))
    found, points = widths(part), study("repeated").points.index
    assert found.keys() == {(point, n) for point in points for n in (3, 4, 6, 8, 9)}
    for (point, n), half in found.items():
        trials = study("repeated").trials
        values = trials.loc[trials["point"] == point, "speed"][:n]
        of = part.distributions["speed"]
        _, low, high, _ = mean_interval(values, distribution=of)
        assert half == pytest.approx((high - low) / 2.0, rel=1e-9)  # sums, reordered


def test_trials_without_a_value_do_not_count() -> None:
    def change(trials: pd.DataFrame) -> pd.DataFrame:
        trials.loc[0, "status"] = "failed"
        trials.loc[1, "speed"] = np.nan
        return trials

    first, second = study("repeated").points.index
    found = widths(having(change))
    assert [n for point, n in found if point == first] == [3, 4, 6, 7]
    assert [n for point, n in found if point == second] == [3, 4, 6, 8, 9]


def test_the_line_has_the_slope_of_independent_values() -> None:
    """It goes through the median of the largest number of trials."""
    shown = marks_of(study("repeated"), Choices(("speed",))).panels[0]
    x, y = np.array(shown.line.x), np.array(shown.line.y)
    assert np.diff(np.log(y)) / np.diff(np.log(x)) == pytest.approx(-0.5)
    assert (x[0], x[-1]) == (3, 9)
    assert y[-1] == pytest.approx(shown.marks.query("x == 9")["y"].median())


def test_what_the_figure_says() -> None:
    figure = narrowing_figure(study("repeated"), "speed")
    (axes,) = figure.axes
    assert axes.get_ylabel() == "half-width of speed (px/step)"
    assert legend_texts(figure) == ["torus", "bounded", "slope \N{MINUS SIGN}1/2"]
    assert "2 points, 9 trials per point" in shown(figure)
    (lines,) = axes.collections
    assert len(lines.get_segments()) == 2


def test_numbers_of_a_short_axis_have_no_powers() -> None:
    figure = narrowing_figure(study("repeated"), "speed")
    (axes,) = figure.axes
    axes.set_ylim(3.5, 7.5)
    figure.draw_without_rendering()
    labels = {label.get_text() for label in axes.get_yticklabels(which="both")}
    assert {"4", "5", "6", "7"} <= labels
    assert not any("$" in label for label in labels)  # raised, smaller letters


def test_one_point_does_not_stretch_the_axis() -> None:
    def change(trials: pd.DataFrame) -> pd.DataFrame:
        torus = trials["borders"] == "torus"
        tiny = 1.0 + 1e-8 * trials["replicate"]
        return trials.assign(speed=tiny.where(torus, trials["replicate"]))

    part = having(change)
    figure = narrowing_figure(part, "speed")
    (axes,) = figure.axes
    widths = half_widths(narrowing_layout(part, "speed", by=None))["half"]
    assert axes.get_ylim()[0] == widths[widths > 1e-3].min()
    assert "1 point has half-widths below the axis" in shown(figure)
    (panel,) = marks_of(part, Choices(("speed",))).panels
    assert panel.y.low == axes.get_ylim()[0]
    plain = marks_of(study("repeated"), Choices(("speed",)))
    assert plain.panels[0].y.low is None
    assert "below the axis" not in plain.note


@pytest.mark.parametrize("value", [1.0, np.nan])
def test_points_without_a_width_are_counted(value: float) -> None:
    """All their values are equal, or there is none."""
    part = having(lambda trials: trials.assign(speed=value))
    figure = narrowing_figure(part, "speed")
    assert ("2 points have no half-width above 0" in shown(figure)) is (value == 1.0)
    assert marks_of(part, Choices(("speed",))).panels[0].marks.empty


@pytest.mark.parametrize("end", [np.nan, np.inf])
def test_widths_that_are_not_known_are_counted_and_the_file_is_written(
    end: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As those of equal values of a metric whose range nothing bounds."""

    def unknown(*about: Any, **more: Any) -> pd.DataFrame:
        return by_point(*about, **more).assign(speed_low=-end, speed_high=end)

    monkeypatch.setattr(narrowing, "by_point", unknown)
    figure = narrowing_figure(study("repeated"), "speed")
    assert "2 points have no half-width above 0" in shown(figure)
    assert save(figure, tmp_path / "widths", formats=("png",))


def test_of_few_trials_there_is_none() -> None:
    with pytest.raises(ChoiceError, match=r"needs 6 trials per point; .* at most 3"):
        narrowing_layout(study("small"), "speed", by=None)


def test_the_note_counts_one_point_as_one() -> None:
    one = study("repeated").where(borders="torus")
    assert ": 1 point, 9 trials per point" in marks_of(one, Choices(("speed",))).note
