"""Parallel coordinates: an axis a setting, a line a point, the best in colour."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from sweep.errors import ChoiceError
from sweep.figures import VERMILION, parallel_figure
from tests.plotted import legend_texts, made_up, shown, study, titles
from tests.sampled import SETTINGS, axis


def test_every_sampled_setting_and_the_metric_is_an_axis() -> None:
    figure = parallel_figure(study("drawn"), "speed")
    names = [
        label.get_text().replace("\n", " ")
        for label in figure.axes[0].get_xticklabels()
    ]
    assert names == [
        "separation weight",
        "alignment weight",
        "cohesion weight",
        "speed (px/step)",
    ]
    assert titles(figure) == ["n = 6", "n = 12"]
    assert shown(figure) == "drawn: 30 points per panel, each the mean of 2 trials"


@pytest.mark.parametrize(
    ("metric", "sign", "word"), [("speed", -1, "highest"), ("speed-", 1, "lowest")]
)
def test_lines_are_points_and_the_best_twentieth_is_in_colour(
    metric: str, sign: int, word: str
) -> None:
    made = made_up(axis("random", 50))
    figure = parallel_figure(made, metric)
    others, best = figure.axes[0].collections
    assert to_hex(best.get_edgecolor()[0]) == VERMILION.lower()
    points = made.trials.groupby("point", sort=False)[[*SETTINGS, "speed"]].mean()
    chosen = points.iloc[
        np.argsort(sign * points["speed"].to_numpy(), kind="stable")[:3]
    ]
    span = points.max() - points.min()
    wanted = ((chosen - points.min()) / span).to_numpy()
    np.testing.assert_allclose([line[:, 1] for line in best.get_segments()], wanted)
    assert len(others.get_segments()) == 47
    assert legend_texts(figure)[0] == f"5 % with the {word} speed (px/step)"


def test_what_is_drawn_logarithmically_has_a_logarithmic_axis() -> None:
    figure = parallel_figure(study("drawn").where(n=6), "speed")
    weights = (
        study("drawn")
        .trials.groupby("point", sort=False)
        .first()
        .query("n == 6")["cohesion_weight"]
    )
    heights = np.sort(
        np.concatenate(
            [
                [line[2, 1] for line in part.get_segments()]
                for part in figure.axes[0].collections
            ]
        )
    )
    logs = np.sort(np.log(weights))
    np.testing.assert_allclose(heights, (logs - logs[0]) / (logs[-1] - logs[0]))
    assert {text.get_text() for text in figure.axes[0].texts} >= {"0.1", "1"}


def test_points_without_a_value_are_left_out_and_counted() -> None:
    made = made_up(axis("random", 10))
    made.trials.loc[:1, "speed"] = np.nan
    assert (
        "9 points per panel, each the mean of 0 to 2 trials; 1 without a value left out"
        in shown(parallel_figure(made, "speed"))
    )


def test_without_a_sample_there_is_nothing_to_draw() -> None:
    with pytest.raises(
        ChoiceError,
        match=(
            "study grid: parallel needs an axis that samples parameters; the study has"
            " no such axis"
        ),
    ):
        parallel_figure(study("grid"), "speed")


def test_numbers_too_far_out_for_an_axis_are_named() -> None:
    drawn = axis("random", 8)[:-1] + ", obstacle_range: {choice: [10, .inf]}}"
    figure = parallel_figure(made_up(drawn), "speed")
    texts = [text.get_text() for text in figure.axes[0].texts]
    named = [text for text in texts if text in ("10", "unlimited", "inf")]
    assert named == ["10", "unlimited"]
