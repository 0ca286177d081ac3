"""Scatter figures: means where they belong, in which unit, of how many trials, with
which correlation.
"""

import numpy as np
import pytest
from matplotlib.axes import Axes

from sweep.analysis import by_point
from sweep.analysis.estimate import rank_estimate
from sweep.errors import ChoiceError
from sweep.figures import heatmap_figure, scatter_figure
from tests.plotted import ascending, legend_texts, made_up, shown, study, titles
from tests.sampled import axis


def dots(axes: Axes) -> np.ndarray:
    """The markers of a panel, x and y, in ascending order."""
    return np.array(
        sorted(tuple(place) for line in axes.lines for place in line.get_xydata())
    )


def test_points_and_intervals_are_those_of_the_table() -> None:
    figure = scatter_figure(study("small"), "speed")
    table = by_point(study("small").trials, ["separation_weight"], ["speed"])
    (axes,) = figure.axes
    np.testing.assert_array_equal(
        dots(axes), table[["separation_weight", "speed"]].to_numpy()
    )
    bounds = [segment[:, 1].tolist() for segment in axes.collections[0].get_segments()]
    np.testing.assert_array_equal(bounds, table[["speed_low", "speed_high"]].to_numpy())
    assert (axes.get_xlabel(), axes.get_ylabel()) == (
        "separation weight",
        "speed (px/step)",
    )
    assert shown(figure).startswith(
        "small: 2 points per panel, 3 trials per point, mean with 95 % confidence"
        " interval"
    )


def test_points_of_one_value_stand_side_by_side() -> None:
    """Where they are told apart by a colour, too, and on a logarithmic axis."""
    for name in ("separation_weight", "alignment_weight"):
        figure = scatter_figure(study("grid"), "speed", name)
        values = np.array([0.5, 1.0, 2.0] if name[0] == "s" else [0.01, 0.1, 1.0])
        for axes in figure.axes:
            lines = [line.get_xdata() for line in axes.lines]
            stands = [
                part[0, 0]
                for lines in axes.collections
                for part in lines.get_segments()
            ]
            assert sorted(np.concatenate(lines)) == pytest.approx(sorted(stands))
            places = np.stack(lines)
            assert (np.abs(np.diff(places, axis=0)) > 0.005 * values).all()
            scale = np.log if axes.get_xscale() == "log" else np.asarray
            middle = scale(places).mean(axis=0)
            assert middle == pytest.approx(scale(values))
            span = np.ptp(scale(values))
            assert (np.abs(scale(places) - middle) <= 0.03 * span + 1e-9).all()


def test_a_grid_has_a_colour_and_panels_for_what_is_on_no_axis() -> None:
    figure = scatter_figure(study("grid"), "speed")
    assert legend_texts(figure) == ["torus", "bounded"]
    assert [axes.get_xlabel() for axes in figure.axes] == ["separation weight"] * 3 + [
        "alignment weight, log scale"
    ] * 3
    assert titles(figure)[:2] == ["alignment weight = 0.01", "alignment weight = 0.1"]
    assert [len(dots(axes)) for axes in figure.axes] == [6] * 6


def test_of_two_axes_the_one_with_words_is_a_colour() -> None:
    figure = scatter_figure(study("grid").where("alignment_weight = 0.1"), "speed")
    assert legend_texts(figure) == ["torus", "bounded"]
    assert [axes.get_xlabel() for axes in figure.axes] == ["separation weight"]


def test_sampled_settings_have_a_panel_each_with_their_rank_correlation() -> None:
    figure = scatter_figure(study("drawn").where(n=6), "speed_mean")
    trials = study("drawn").trials
    points = (
        trials[trials["n"] == 6]
        .groupby("point")[["cohesion_weight", "speed_mean"]]
        .mean()
    )
    found = rank_estimate(
        points["cohesion_weight"].to_numpy(), points["speed_mean"].to_numpy()
    )
    low, high = found.interval()
    said = f"\N{GREEK SMALL LETTER RHO} = {found.value:.2f} [{low:.2f}, {high:.2f}]"
    assert titles(figure)[2] == said.replace("-", "\N{MINUS SIGN}")
    assert [axes.get_xscale() for axes in figure.axes] == ["linear", "linear", "log"]
    assert figure.axes[0].get_ylabel() == "speed, second half (px/step)"
    assert "drawn, n = 6: 30 points per panel, 2 trials per point" in shown(figure)


def test_one_trial_a_point_has_no_interval() -> None:
    figure = scatter_figure(made_up("n: [3, 4]", ascending, replicates=1), "speed")
    assert (
        shown(figure) == "made_up: 2 points per panel, 1 trial per point, no interval"
    )
    figure = heatmap_figure(
        made_up("n: [3, 4], steps: [5, 6]", ascending, replicates=1), "speed"
    )
    assert [
        axes.get_ylabel() for axes in figure.axes if axes.get_label() == "<colorbar>"
    ] == ["speed (px/step)"]


def test_many_points_are_dots_without_intervals() -> None:
    figure = scatter_figure(made_up(axis("random", 100)), "speed")
    assert [len(axes.collections[0].get_offsets()) for axes in figure.axes] == [100] * 3
    assert not any(axes.lines for axes in figure.axes)
    assert "100 points per panel, 2 trials per point, each the mean" in shown(figure)


def test_points_without_a_value_are_left_out_and_trials_not_done_counted() -> None:
    made = made_up(axis("random", 10))
    made.trials.loc[:1, ["status", "speed"]] = "failed", np.nan
    figure = scatter_figure(made, "speed")
    assert "9 points per panel" in shown(figure)
    assert "; 2 of 20 trials not done" in shown(figure)


def test_details_of_a_preset_are_named_along_the_axis() -> None:
    figure = scatter_figure(study("ablated"), "speed")
    names = [label.get_text() for label in figure.axes[0].get_xticklabels()]
    assert (names[0], names[-1]) == ("unchanged", "all")
    assert titles(figure) == []


@pytest.mark.parametrize(
    ("name", "choices", "message"),
    [
        ("grid", {"metric": "sped"}, 'unknown metric "sped"; did you mean "speed"?'),
        (
            "grid",
            {"x": "seperation_weight"},
            'unknown varied parameter "seperation_weight"; did you mean',
        ),
        (
            "grid",
            {"by": "borders", "x": "borders"},
            "by borders, which is on an axis already",
        ),
        (
            "drawn",
            {"by": "cohesion_weight"},
            (
                "by cohesion_weight, which has 30 values; allowed: up to 7; choose one"
                " of n"
            ),
        ),
    ],
)
def test_wrong_choices_say_what_is_allowed(
    name: str, choices: dict, message: str
) -> None:
    with pytest.raises(ChoiceError) as error:
        scatter_figure(study(name), **{"metric": "speed"} | choices)
    assert message in str(error.value)


def test_one_point_has_nothing_to_scatter_against() -> None:
    with pytest.raises(ChoiceError) as error:
        scatter_figure(study("small").where(separation_weight=1), "speed")
    reason = "needs a varied parameter; the study has none"
    assert (error.value.kind, error.value.reason) == ("scatter", reason)
    assert str(error.value) == f"study small: scatter {reason}"


def test_too_many_panels_say_what_to_choose() -> None:
    wide = made_up(
        f"n: {list(range(3, 10))}, steps: {list(range(60, 70))}, {axis('random', 3)}"
    )
    with pytest.raises(
        ChoiceError,
        match=(
            r"scatter has 210 panels, by n \(7 values\) and steps \(10 values\);"
            r" allowed: up to 12"
        ),
    ):
        scatter_figure(wide, "speed")


def test_numbers_too_far_out_for_an_axis_are_named() -> None:
    made = made_up("obstacle_range: [10, 50, 1.0e308, .inf]", ascending)
    figure = scatter_figure(made, "speed")
    figure.draw_without_rendering()
    (axes,) = figure.axes
    np.testing.assert_array_equal(dots(axes), [[0, 0], [1, 1], [2, 2], [3, 3]])
    names = [label.get_text() for label in axes.get_xticklabels()]
    assert names == ["10", "50", "1e+308", "unlimited"]
    assert "= 1.00 " in titles(figure)[0]
