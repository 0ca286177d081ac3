"""The picture of what numerics do to claims: where each estimate lies, what is said."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from sweep.published.claims import Claim
from sweep.published.margins import LOOK
from sweep.published.numerics_figure import BELOW, numerics_figure
from sweep.published.turned import DocumentVariants, Estimated, Turned
from sweep.published.verdicts import Above, Expectation, Value
from tests.published.test_scorecard import row


def claim(name: str, expect: Expectation) -> Claim:
    return replace(row(expect, 1.0, 2.0).claim, id=name)


def estimated(ours: float) -> Estimated:
    return Estimated(ours=ours, low=ours - 0.5, high=ours + 0.5, trials=1200)


CLAIMS = [
    claim("number", Value(10.0, 0.5, None, 1.5, "x")),
    claim("gone", Value(10.0, 0.5, None, 1.5, "x")),
    claim("bound", Above(1.0)),
    claim("untested", Above(1.0)),
]
BASE = {"number": estimated(11.0), "gone": estimated(10.0), "bound": estimated(2.0)}
FOUND = DocumentVariants(
    "",
    {"number": "confirmed", "gone": "confirmed", "bound": "confirmed"},
    {
        "numerics": {
            "dt-half": Turned(
                "half the dt",
                None,
                {"number": "refuted"},
                {"gone": "no such frame"},
                {"number": estimated(13.0), "bound": estimated(2.0)},
            ),
            "seed-other": Turned("another seed", None, {}, {}, BASE),
        }
    },
    BASE,
)


@pytest.fixture(scope="module")
def figure() -> Figure:
    return numerics_figure("A title", CLAIMS, FOUND, 7)


def panels(figure: Figure) -> list[Axes]:
    """The panels, those of a variant below each other."""
    numbers, half_numbers, bounds, half_bounds = (
        figure.axes[place] for place in (0, 1, 2, 3)
    )
    return [numbers, bounds, half_numbers, half_bounds]


def marks(axes: Axes) -> list[tuple[float, float, str, str]]:
    """Place, height, colour and marker of each estimate."""
    return [
        (
            float(np.ravel(line.get_xdata())[0]),
            float(np.ravel(line.get_ydata())[0]),
            str(line.get_color()),
            str(line.get_marker()),
        )
        for line in axes.lines
        if np.shape(line.get_ydata()) == np.shape(line.get_xdata()) == (1,)
    ]


def test_a_column_has_each_claim_with_and_without_its_variant(figure: Figure) -> None:
    numbers, bounds, *_ = panels(figure)
    assert [one.get_title() for one in panels(figure)[::2]] == [
        "dt-half\nhalf the dt",
        "seed-other\nanother seed",
    ]
    assert numbers.get_title(loc="left").startswith("A title")
    names = [
        label.get_text()
        for axes in (numbers, bounds)
        for label in axes.get_yticklabels()
    ]
    assert names == ["number", "gone", "bound"]
    half = BELOW / 2
    places = [mark[:2] for mark in marks(numbers)]
    assert np.array(places) == pytest.approx(
        np.array([(0.5, -half), (1.5, half), (0.0, 1 - half)])
    )
    # Of a bound the unit is half the width of the interval without a change.
    assert [x for x, *_ in marks(bounds)] == [pytest.approx(2.0), pytest.approx(2.0)]


def test_what_turns_has_the_look_of_its_verdict_and_a_ground(figure: Figure) -> None:
    numbers, bounds, other, _ = panels(figure)
    assert [mark[2:] for mark in marks(numbers)][1] == LOOK["refuted"]
    assert marks(bounds)[1][2:] == LOOK["confirmed"]
    grounds = [len(axes.patches) - 1 for axes in (numbers, bounds, other)]
    assert grounds == [1, 0, 0]


def test_what_is_not_judged_says_so(figure: Figure) -> None:
    said = [[text.get_text() for text in axes.texts] for axes in panels(figure)]
    assert said == [["not judged"], [], [], []]


def test_the_last_column_has_numbers_with_their_trials(figure: Figure) -> None:
    texts = [
        label.get_text()
        for axes in panels(figure)[2:]
        for child in axes.child_axes
        for label in child.get_yticklabels()
    ]
    assert texts == [
        "11  (10 ± 1.5), n = 1,200",
        "10  (10 ± 1.5), n = 1,200",
        "2  (> 1), n = 1,200",
    ]
