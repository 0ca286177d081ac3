"""Points are chosen by their settings in one way, and a study is restricted to them."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from sweep.analysis import by_point, contrast
from sweep.errors import ChoiceError
from sweep.figures import metric_curves
from sweep.methods.adaptive import stopping
from sweep.tables.choosing import Chooser, spelled
from tests.plotted import made_up, shown, study

CHOOSER = Chooser(
    {
        "n": np.array([50, 50, 100, 100]),
        "drag": np.array([0.1, 3 * 0.1, 0.1, 3 * 0.1]),
        "map": np.array(["empty", "arena", "empty", "arena"], object),
        "walls": np.array([True, False, True, True]),
        "detail": np.array(["", "drag", "update", "all"], object),
        "steps": 600,
        "fov": np.inf,
    },
    4,
    "made_up",
    ["speed", "speed_mean"],
)


@pytest.mark.parametrize(
    ("texts", "found"),
    [
        (["n=50"], {"n": 50.0}),
        (["map=empty,n=50"], {"map": "empty", "n": 50.0}),
        (["map = empty ", " n= 50"], {"map": "empty", "n": 50.0}),
        (["walls=True", "steps=600"], {"walls": True, "steps": 600.0}),
        (["walls=yes", "detail="], {"walls": True, "detail": ""}),
        (["fov=.inf,drag=3e-1"], {"fov": np.inf, "drag": 0.3}),
        ([], {}),
    ],
)
def test_texts_are_read_as_what_the_setting_is(
    texts: list[str], found: dict[str, object]
) -> None:
    assert CHOOSER.read(texts) == found
    assert CHOOSER.having(CHOOSER.read(texts)).any()


@pytest.mark.parametrize(
    ("settings", "points"),
    [
        ({}, [0, 1, 2, 3]),
        ({"n": 50}, [0, 1]),
        ({"n": np.int64(100), "walls": np.bool_(True)}, [2, 3]),
        ({"drag": 0.3}, [1, 3]),
        ({"drag": np.float64(0.1), "map": "empty", "n": 50.0}, [0]),
        ({"detail": ["drag", "all"]}, [1, 3]),
        ({"n": (50, 100), "detail": np.array(["", "all"])}, [0, 3]),
        ({"n": pd.Series([50]), "steps": 600, "fov": np.inf}, [0, 1]),
    ],
)
def test_points_have_all_settings_and_one_of_several_values(
    settings: dict[str, object], points: list[int]
) -> None:
    assert np.flatnonzero(CHOOSER.having(settings)).tolist() == points


@pytest.mark.parametrize(
    ("texts", "message"),
    [
        (
            ["n"],
            '"n" chooses nothing; allowed: SETTING=VALUE[,SETTING=VALUE], for example'
            " n=50",
        ),
        (["n=50,"], '"" chooses nothing; allowed: SETTING=VALUE'),
        (["=3"], '"=3" chooses nothing; allowed: SETTING=VALUE'),
        (["n=50", "n=100"], "n is given twice; allowed: one value"),
        (["maps=empty"], 'unknown parameter "maps"; did you mean "map"?'),
        (
            ["colour=red"],
            'unknown parameter "colour". Allowed: n, drag, map, walls, detail, steps,'
            " fov (the study varies n, drag, map, walls, detail)",
        ),
        (
            ["map=emty"],
            'no point has map = emty; did you mean "empty"? Values of map: empty,'
            " arena",
        ),
        (
            ["speed=1"],
            "speed is a metric, but points are chosen by parameters (the study varies",
        ),
        (["n=60"], "no point has n = 60; values of n: 50, 100"),
        (["n=many"], "no point has n = many; values of n: 50, 100"),
        (["walls=1"], "no point has walls = 1; values of walls: true, false"),
        (
            ["detail=none"],
            'no point has detail = none; values of detail: "", drag, update, all',
        ),
        (["steps=60"], "no point has steps = 60; values of steps: 600"),
        (
            ["n=50,walls=true,map=arena"],
            "no point with n = 50, walls = true has map = arena; values of map: empty",
        ),
    ],
)
def test_what_no_point_has_is_refused_with_what_there_is(
    texts: list[str], message: str
) -> None:
    with pytest.raises(ChoiceError) as error:
        CHOOSER.having(CHOOSER.read(texts))
    assert error.value.reason.startswith(message)
    assert error.value.study == "made_up"
    assert str(error.value) == f"study made_up: {error.value.reason}"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"n": True}, "no point has n = true; values of n: 50, 100"),
        ({"walls": 1}, "no point has walls = 1; values of walls: true, false"),
        ({"map": 3}, "no point has map = 3; values of map: empty, arena"),
        ({"n": "50"}, "no point has n = 50; values of n: 50, 100"),
        ({"n": []}, "n has an empty list of values; give a value"),
        ({"n": [50, 60]}, "no point has n = 60; values of n: 50, 100"),
    ],
)
def test_a_value_is_of_the_type_of_its_setting(
    settings: dict[str, object], message: str
) -> None:
    with pytest.raises(ChoiceError) as error:
        CHOOSER.having(settings)
    assert error.value.reason == message


def test_of_many_numbers_the_closest_are_named_and_each_is_found_as_spelled() -> None:
    values = np.random.default_rng(5).uniform(0, 1e-3, 100)
    chooser = Chooser({"drag": values}, 100)
    with pytest.raises(ChoiceError) as error:
        chooser.having({"drag": values.max() + 1.0})
    closest = ", ".join(map(spelled, sorted(values)[:-4:-1]))
    assert error.value.reason.endswith(f"; the closest of 100 values: {closest}")
    for place, value in enumerate(values):
        found = chooser.having(chooser.read([f"drag={spelled(value)}"]))
        assert np.flatnonzero(found).tolist() == [place]


def test_a_restricted_study_has_the_tables_of_its_trials_alone() -> None:
    grid = study("grid")
    part = grid.where(borders="torus", separation_weight=[0.5, 2])
    trials = grid.trials
    mask = (trials["borders"] == "torus") & trials["separation_weight"].isin([0.5, 2])
    pd.testing.assert_frame_equal(
        part.trials, trials[mask].reset_index(drop=True), check_exact=True
    )
    series = grid.series[grid.series["trial_id"].isin(part.trials["trial_id"])]
    pd.testing.assert_frame_equal(part.series, series.reset_index(drop=True))
    assert part.plan["trial_id"].to_pylist() == part.trials["trial_id"].tolist()
    assert part.varied == ["separation_weight", "alignment_weight"]
    assert (part.units, part.metrics) == (grid.units, grid.metrics)
    assert part.statuses() == {"done": 18}
    assert (part.apart(), part.whole, grid.whole) == (0, grid, grid)
    assert repr(part) == (
        "<StoredStudy grid where borders = torus, separation_weight = 0.5 or 2:"
        " 18 trials>"
    )
    assert len(grid.trials) == 54


def test_a_restricted_study_is_restricted_further() -> None:
    grid = study("grid")
    part = grid.where(borders="torus").where(separation_weight=2)
    both = grid.where(borders="torus", separation_weight=2)
    pd.testing.assert_frame_equal(part.trials, both.trials)
    assert part.chosen == both.chosen == {"borders": "torus", "separation_weight": 2}
    assert grid.where() is grid
    with pytest.raises(ChoiceError) as error:
        part.where(borders="bounded")
    assert error.value.reason.endswith("= bounded; values of borders: torus")


def test_a_setting_that_is_the_same_everywhere_can_be_named() -> None:
    assert len(study("grid").where(n=12).trials) == 54
    with pytest.raises(ChoiceError, match="no point has n = 13; values of n: 12"):
        study("grid").where(n=13)


@pytest.mark.parametrize("name", ["small", "grid", "drawn", "covering", "flying"])
def test_every_table_is_restricted_whether_read_before_or_after(name: str) -> None:
    whole = study(name)
    wanted = whole.trials["point"].iloc[0]
    settings = whole.points.loc[wanted, whole.varied].to_dict()
    for part in (whole.where(**settings), _read(whole).where(**settings)):
        assert set(part.trials["point"]) == {wanted}
        for table in (part.series, part.heatmaps, part.trajectories):
            assert set(table["trial_id"]) <= set(part.trials["trial_id"])
        assert len(part.series) == _rows(whole, "series", part)
        assert len(part.heatmaps) == _rows(whole, "heatmaps", part)
        assert len(part.trajectories) == _rows(whole, "trajectories", part)


def _read(whole: Any) -> Any:
    assert [len(whole.series), len(whole.heatmaps), len(whole.trajectories)]
    return whole


def _rows(whole: Any, table: str, part: Any) -> int:
    return int(getattr(whole, table)["trial_id"].isin(part.trials["trial_id"]).sum())


def test_details_are_a_setting_like_others() -> None:
    ablated = study("ablated")
    part = ablated.where(detail="drag")
    assert set(part.trials["drag"]) == {0.0}
    assert set(part.details("as_written")) == {"drag"}
    assert part.varied == []
    assert set(ablated.where(detail=["", "all"]).details("as_written")) == {"", "all"}


def test_where_restricts_what_analysis_and_figures_take() -> None:
    part = study("grid").where(borders="torus")
    rows = by_point(part.trials, part.varied, ["speed"])
    assert len(rows) == 9
    first, second = ({"separation_weight": weight} for weight in (2, 1))
    change = contrast(part, "speed", a=first, b=second, unit="replicate")
    whole = contrast(
        study("grid").trials[study("grid").trials["borders"] == "torus"],
        "speed",
        a=first,
        b=second,
        unit="replicate",
    )
    assert change.value == whole.value
    figure = metric_curves(part.where(alignment_weight=1), "separation_weight")
    assert shown(figure).startswith("grid, borders = torus, alignment weight = 1: 3")
    several = metric_curves(part.where(alignment_weight=[1, 0.1]), "alignment_weight")
    assert "alignment weight = 1 or 0.1" in shown(several)


def test_the_rule_of_a_study_is_seen_for_the_points_that_are_left() -> None:
    made = made_up("n: [3, 4], separation_weight: [0, 1]", lambda s: np.zeros(len(s)))
    made.provenance["until"] = {
        "metric": "speed",
        "half_width": 0.1,
        "confidence": 0.95,
        "nominal_confidence": 0.97,
        "min": 2,
        "max": 2,
        "looks": [2],
    }
    part = made.where(n=3)
    assert stopping(part)["point"].tolist() == list(part.points.index)
    assert len(stopping(part)) == 2 < len(stopping(made)) == 4
