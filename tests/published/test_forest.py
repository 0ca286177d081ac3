"""The picture of all claims: where each row lies, and how it looks."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sweep.published.claims import Kind
from sweep.published.forest import forest_figure
from sweep.published.judging import Row
from sweep.published.margins import EDGE, LOOK
from sweep.published.measures import Call
from sweep.published.verdicts import (
    Above,
    Below,
    Expectation,
    Value,
    Within,
    untestable,
)
from tests.published.test_scorecard import row


def named(name: str, expect: Expectation, kind: Kind, *values: float) -> Row:
    found = row(expect, *values)
    claim = replace(found.claim, id=name, kind=kind, measure=Call("f", "normal"))
    return found._replace(claim=claim)


ROWS = [
    named("margin", Value(10.0, 0.5, None, 1.5, "x"), "number", 10.9, 11.0, 11.1),
    named("far", Value(10.0, 0.0, None, 0.1, "x"), "number", 10.9, 11.0, 11.1),
    named("range", Within(0.0, 4.0), "fit", 0.9, 1.0, 1.1),
    named("above", Above(1.0), "number", 1.9, 2.0, 2.1),
    named("below", Below(1.0), "reading", 1.9, 2.0, 2.1),
    named("none", Above(0.0), "number", 1.0, 2.0)._replace(
        verdict=untestable("no idea"), measured=None
    ),
]


@pytest.fixture(scope="module")
def figure() -> Figure:
    return forest_figure("A title", ROWS, 7)


def marks(figure: Figure) -> dict[str, Line2D]:
    """The mark of each row, by its name."""
    found = {}
    for axes in figure.axes:
        names = [label.get_text() for label in axes.get_yticklabels()]
        for line in axes.lines:
            place = np.atleast_1d(line.get_ydata())
            if len(place) == 1 and line.get_marker() not in (None, "None", ""):
                found[names[int(place[0])]] = line
    return found


def test_each_tested_row_is_in_the_panel_of_its_unit(figure: Figure) -> None:
    panels = [
        [label.get_text() for label in axes.get_yticklabels()] for axes in figure.axes
    ]
    assert panels == [["margin", "far", "range"], ["above", "below"]]
    assert figure.axes[0].get_title() == "A title"


@pytest.mark.parametrize(
    ("name", "place"),
    [
        ("margin", 1.0 / 2.0),  # a margin of 1.5 and a rounding of 0.5
        ("range", -1.0 / 2.0),
        ("far", EDGE),
    ],
)
def test_numbers_and_ranges_are_in_margins(
    figure: Figure, name: str, place: float
) -> None:
    assert float(np.ravel(marks(figure)[name].get_xdata())[0]) == pytest.approx(place)


def test_bounds_are_in_half_widths_and_what_is_expected_is_right(
    figure: Figure,
) -> None:
    """Ours is beyond one bound, and short of the other by as much."""
    found = marks(figure)
    above, below = (
        float(np.ravel(found[name].get_xdata())[0]) for name in ("above", "below")
    )
    half = ROWS[3].verdict.noticeable
    assert half
    assert above == pytest.approx(min(1.0 / half, EDGE))
    assert below == pytest.approx(-above)


def test_marks_tell_verdicts_fits_and_what_is_far_off(figure: Figure) -> None:
    found = marks(figure)
    looks = {
        name: (line.get_color(), line.get_marker()) for name, line in found.items()
    }
    assert looks["above"] == LOOK["confirmed"]
    assert looks["below"] == LOOK["refuted"]
    assert looks["far"] == (LOOK["refuted"][0], ">")
    assert found["range"].get_markerfacecolor() == "white"
    assert found["margin"].get_markerfacecolor() != "white"
