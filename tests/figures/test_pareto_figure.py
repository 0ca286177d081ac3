"""Pareto figures: which way is better, both intervals, and the points that no other
beats.
"""

import numpy as np
import pytest

from kernels.metrics import METRICS
from sweep.analysis import by_point
from sweep.errors import ChoiceError
from sweep.figures import parallel_figure, pareto_figure
from sweep.figures.directions import direction
from tests.plotted import legend_texts, shown, study, titles


@pytest.mark.parametrize(
    ("text", "high"),
    [("speed", True), ("speed+", True), ("speed-", False), ("speed_mean-", False)],
)
def test_the_direction_of_a_metric(text: str, high: bool) -> None:
    assert direction(study("grid"), text) == (text.rstrip("+-"), high)


def test_of_harm_less_is_better() -> None:
    assert not direction(study("covering"), "coverage_cv").high
    assert not direction(study("covering"), "collisions_mean").high
    assert {about.better for about in METRICS.values()} == {"high", "low", "neither"}
    for name in ("flock_radius", "flock_count", "polarization"):
        assert METRICS[name].better == "neither"


def test_of_a_search_its_objectives_say_which_way_is_better() -> None:
    """By itself a flock radius has no direction; the search makes it small."""
    found = study("searched")
    assert not direction(found, "flock_radius").high
    assert not direction(found, "flock_radius_mean").high
    assert direction(found, "flock_radius+").high
    assert direction(found, "speed").high
    axes = pareto_figure(found).axes[0]
    assert axes.get_xlabel() == "flock radius (px), less is better"
    assert axes.get_ylabel() == "speed (px/step), more is better"
    assert (
        legend_texts(parallel_figure(found, "flock_radius"))[0]
        == "5 % with the lowest flock radius (px)"
    )


@pytest.mark.parametrize("signs", ["++", "+-", "-+", "--"])
def test_the_front_is_what_no_point_beats(signs: str) -> None:
    figure = pareto_figure(study("grid"), "speed" + signs[0], "dispersion" + signs[1])
    table = by_point(study("grid").trials, [], ["speed", "dispersion"])
    better = table[["speed", "dispersion"]].to_numpy() * [
        1 if sign == "+" else -1 for sign in signs
    ]
    beaten = [
        ((better >= row).all(axis=1) & (better > row).any(axis=1)).any()
        for row in better
    ]
    wanted = (
        table.loc[~np.array(beaten), ["speed", "dispersion"]]
        .sort_values("speed")
        .to_numpy()
    )
    points, front = figure.axes[0].lines
    np.testing.assert_array_equal(front.get_xydata(), wanted)
    assert len(points.get_xydata()) == len(table) == 18
    words = {"+": "more", "-": "less"}
    assert (
        figure.axes[0].get_xlabel() == f"speed (px/step), {words[signs[0]]} is better"
    )
    assert (
        figure.axes[0].get_ylabel() == f"dispersion (px), {words[signs[1]]} is better"
    )


def test_both_intervals_are_drawn() -> None:
    figure = pareto_figure(study("grid"), "speed", "dispersion")
    table = by_point(
        study("grid").trials,
        [],
        ["speed", "dispersion"],
        distributions=study("grid").distributions,
    )
    across, up = figure.axes[0].collections
    np.testing.assert_array_equal(
        [part[:, 0] for part in across.get_segments()],
        table[["speed_low", "speed_high"]],
    )
    ends = table[["dispersion_low", "dispersion_high"]]
    np.testing.assert_array_equal([part[:, 1] for part in up.get_segments()], ends)
    assert shown(figure).startswith(
        "grid: 18 points per panel, 3 trials per point, means with 95 % confidence"
        " intervals, not simultaneous dispersion: 2 to 5 skewed values"
    )


def test_where_settings_are_sampled_listed_ones_have_fronts_of_their_own() -> None:
    figure = pareto_figure(study("drawn"), "speed", "dispersion-")
    assert legend_texts(figure) == ["6", "12", "not dominated"]
    assert len(figure.axes[0].lines) == 4
    assert titles(figure) == []


def test_by_default_more_coverage_and_a_smaller_cv_are_better() -> None:
    figure = pareto_figure(study("covering"))
    labels = (figure.axes[0].get_xlabel(), figure.axes[0].get_ylabel())
    assert labels == ("coverage (%), more is better", "coverage cv, less is better")


@pytest.mark.parametrize(
    ("metrics", "message"),
    [
        (
            [],
            (
                "pareto needs two metrics and has 0; name two metrics with directions,"
                " for example speed+ dispersion+"
            ),
        ),
        (["speed"], "pareto needs two metrics and has 1"),
        (
            ["speed+", "speed-"],
            "pareto with speed twice; allowed: two different metrics",
        ),
        (["sped+", "dispersion"], 'unknown metric "sped"; did you mean "speed"?'),
    ],
)
def test_wrong_metrics_say_what_is_allowed(metrics: list[str], message: str) -> None:
    with pytest.raises(ChoiceError) as error:
        pareto_figure(study("grid"), *metrics)
    assert message in str(error.value)
