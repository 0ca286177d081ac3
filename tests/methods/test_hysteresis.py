"""Figures of loops between way up and way down."""

from pathlib import Path

import numpy as np
import pytest

from sweep.errors import ChoiceError
from sweep.figures import KINDS, Choices, hysteresis_figure
from sweep.methods.hysteresis import find_loops, loop_rows
from sweep.tables.stored_study import StoredStudy
from tests.campaigns.test_chains import CHAINED
from tests.studies import SMALL, launched

GROUPS = CHAINED.replace("sweep:", "sweep:\n  cohesion_weight: [0.01, 0.02]")


@pytest.fixture(scope="module")
def study(tmp_path_factory: pytest.TempPathFactory) -> StoredStudy:
    """Two groups of three chains."""
    return launched(GROUPS, tmp_path_factory.mktemp("chains"))


def values_of(study: StoredStudy, way: str, weight: float, cohesion: float) -> list:
    """The speeds at a value on one way, by the replicate."""
    chosen = study.where(direction=way, cohesion_weight=cohesion).trials
    return chosen[chosen["separation_weight"] == weight]["speed"].tolist()


def test_loops_have_the_links_of_their_chains(study: StoredStudy) -> None:
    found = find_loops(study, "speed")
    assert [one.settings for one in found] == [
        {"cohesion_weight": 0.01},
        {"cohesion_weight": 0.02},
    ]
    for one in found:
        assert one.values.tolist() == [0.5, 1.0, 2.0]
        assert (one.loop.chains, one.incomplete) == (3, 0)
        for place, weight in enumerate(one.values.tolist()):
            cohesion = float(str(one.settings["cohesion_weight"]))
            for way, rows in (("up", one.up), ("down", one.down)):
                assert [*rows[:, place]] == values_of(study, way, weight, cohesion)
        areas = np.trapezoid(one.down - one.up, one.values, axis=1)
        assert one.loop.area.value == pytest.approx(areas.mean(), rel=1e-12)
    rows = loop_rows(found)
    assert rows["area"].tolist() == [one.loop.area.value for one in found]


def test_a_panel_has_both_ways(study: StoredStudy) -> None:
    figure = hysteresis_figure(study, "speed")
    assert len(figure.axes) == 2
    (one, _) = find_loops(study, "speed")
    up, down = figure.axes[0].lines
    assert [*up.get_xdata()] == [*down.get_xdata()] == [0.5, 1.0, 2.0]
    assert up.get_ydata() == pytest.approx(one.up.mean(axis=0), rel=1e-12)
    assert down.get_ydata() == pytest.approx(one.down.mean(axis=0), rel=1e-12)
    assert figure.axes[0].get_xlabel() == "separation weight"
    assert figure.axes[0].get_ylabel() == "mean speed (px/step)"
    assert "cohesion weight = 0.01" in figure.axes[0].get_title()
    assert "area " in figure.axes[0].get_title()
    assert "3 trials per value and direction, one per" in figure.get_supxlabel()
    planned = KINDS["hysteresis"].figures(study, Choices(("speed",), half=True))
    assert [one.metric for one in planned] == ["speed_mean"]


def test_directions_are_never_averaged_together(study: StoredStudy) -> None:
    table = study.kept_apart
    assert table == ["direction"]


def test_a_study_without_both_ways_has_no_loop(tmp_path: Path) -> None:
    for text in (SMALL, CHAINED.replace("both", "up")):
        with pytest.raises(ChoiceError, match='no axis has "continue: both"'):
            find_loops(launched(text, tmp_path))


def test_a_loop_needs_two_values(study: StoredStudy) -> None:
    with pytest.raises(ChoiceError, match="needs 2 values of separation_weight"):
        find_loops(study.where(separation_weight=1), "speed")
    with pytest.raises(ChoiceError, match='did you mean "speed"'):
        find_loops(study, "sped")
