"""What is on the screen is a spec: what is copied from it is the same trial."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.errors import SpecError
from sweep.spec.settings import Value, preset_settings
from sweep.spec.study import parse_spec
from sweep.web.state import MOST_STORED, Range, ViewState, begin, from_study
from tests import builders
from tests.specs import EVERYTHING, GAINS, short
from tests.studies import SMALL

DISC = {"disc": {"x": 100.1, "y": 200.2, "radius": 30.3}}
RECTANGLE = {"rectangle": {"x": 300.0, "y": 400.0, "width": 50.5, "height": 1 / 3}}
OWN = short(
    "maps:",
    "  room: {size: [90, 60], shapes: [{disc: {x: 3, y: 4, radius: 0.7}}]}",
    "fixed: {map: room, n: 5}",
)


def copied(state: ViewState) -> Job:
    """The first trial of the spec that is copied from a state."""
    study = parse_spec(state.as_text())
    return Jobs(study, expand(study))[0]


@pytest.mark.parametrize(("model", "preset"), builders.PRESETS)
def test_a_preset_as_it_is_becomes_a_spec_of_the_same_trial(
    model: str, preset: str
) -> None:
    state = begin(model, preset, seed=7)
    assert state.fixed == {}
    assert state.settings == preset_settings(model, preset, BUILT_IN)
    assert copied(state) == state.job


def test_what_differs_from_the_preset_is_fixed_and_nothing_else() -> None:
    state = begin("nguyen2024", "as_run").with_settings(
        {"cohesion_weight": 0.3, "n": 40.0, "seed": 9}
    )
    assert state.as_spec()["fixed"] == {"cohesion_weight": 0.3, "n": 40}
    assert (state.seed, state.job.seed) == (9, 9)
    assert copied(state) == state.job
    assert state.with_settings({"cohesion_weight": 1}).fixed == {"n": 40}


TORUS, BLIND = {"borders": "torus"}, {"borders": "torus", "minimum_image": False}


@pytest.mark.parametrize(
    ("preset", "changes", "fixed", "across"),
    [
        ("as_written", [TORUS], TORUS, True),
        ("as_written", [TORUS, {"minimum_image": False}], BLIND, False),
        ("as_written", [BLIND], BLIND, False),
        ("as_written", [BLIND, {"minimum_image": True}], TORUS, True),
        ("as_written", [BLIND, {"borders": "bounded"}], {"borders": "bounded"}, False),
        ("as_run", [{"minimum_image": True}], {"minimum_image": True}, True),
        (
            "as_run",
            [{"minimum_image": True}, {"borders": "open"}],
            {"borders": "open"},
            False,
        ),
        ("as_run", [{"borders": "open"}, TORUS], {}, False),
    ],
)
def test_a_torus_that_is_chosen_is_periodic(
    preset: str, changes: list[dict[str, Value]], fixed: dict[str, Value], across: bool
) -> None:
    """The torus of a preset is that of the preset again."""
    state = begin("nguyen2024", preset)
    for one in changes:
        state = state.with_settings(one)
    assert state.fixed == fixed
    assert state.settings["minimum_image"] is across
    assert copied(state) == state.job


@pytest.mark.parametrize("minimum_image", ["", ", minimum_image: false"])
@pytest.mark.parametrize("preset", ["as_written", "as_run"])
def test_a_torus_that_is_opened_stays_as_it_is(preset: str, minimum_image: str) -> None:
    text = short(f"fixed: {{borders: torus{minimum_image}}}")
    study = parse_spec(text.replace("as_run", preset))
    state = from_study(study)
    assert state.settings["minimum_image"] is not bool(minimum_image)
    for changed in (state, state.with_settings({"n": 5})):
        same = state.settings | {"n": changed.settings["n"]}
        assert copied(changed).settings == changed.settings == same
    turned = state.with_settings({"minimum_image": bool(minimum_image)})
    assert copied(turned).settings == turned.settings
    assert turned.settings["minimum_image"] is bool(minimum_image)


@pytest.mark.parametrize(
    "text",
    [EVERYTHING, GAINS, OWN, short("streams: {start: independent}", "fixed: {n: 7}")],
)
def test_a_study_is_shown_from_its_first_trial(text: str) -> None:
    study = parse_spec(text)
    job, state = Jobs(study, expand(study))[0], from_study(study)
    for same in (
        "point",
        "seed",
        "literal",
        "settings",
        "streams",
        "obstacles",
        "model",
        "preset",
    ):
        assert (
            getattr(copied(state), same)
            == getattr(state.job, same)
            == getattr(job, same)
        ), same


FINITE = st.floats(1, 799)


@settings(max_examples=15)
@given(
    st.lists(
        st.tuples(st.booleans(), FINITE, FINITE, FINITE, FINITE), min_size=1, max_size=3
    )
)
def test_shapes_keep_every_bit_in_a_copied_spec(
    drawn: list[tuple[bool, float, float, float, float]],
) -> None:
    shapes: list[Any] = [
        {"disc": {"x": x, "y": y / 2, "radius": a}}
        if is_disc
        else {"rectangle": {"x": x, "y": y / 2, "width": a, "height": b}}
        for is_disc, x, y, a, b in drawn
    ]
    state = begin("aziel_chen2025", "as_run").place(shapes)
    assert state.shapes == shapes
    assert copied(state) == state.job
    assert from_study(parse_spec(state.as_text())).shapes == shapes


def test_a_map_of_its_own_without_obstacles_is_shown() -> None:
    spec = short(
        "fixed: {n: 5, map: room}", "maps:", "  room: {size: [90, 60], shapes: []}"
    )
    state = from_study(parse_spec(spec))
    assert state.shapes == []
    assert (state.settings["width"], state.settings["height"]) == (90, 60)
    assert parse_spec(state.as_text()).maps["room"].obstacles == ()


def test_shapes_replace_those_of_a_map_and_none_are_an_empty_world() -> None:
    state = begin("aziel_chen2025", "as_run").place([DISC, RECTANGLE])
    assert state.settings["map"] == "edited"
    assert len(state.job.obstacles or ()) == 2
    empty = state.place([])
    assert (empty.settings["map"], empty.shapes, empty.job.obstacles) == (
        "empty",
        None,
        None,
    )
    assert (empty.settings["width"], empty.settings["height"]) == (800, 600)
    assert copied(empty) == empty.job


def test_an_edited_map_can_get_another_size() -> None:
    state = (
        begin("nguyen2024", "as_run")
        .place([DISC])
        .with_settings({"width": 500, "n": 30})
    )
    assert (state.settings["width"], state.settings["height"], state.settings["n"]) == (
        500.0,
        740.0,
        30,
    )
    assert copied(state) == state.job
    with pytest.raises(
        SpecError, match="the disc is outside the world, which is 50 x 740"
    ):
        state.with_settings({"width": 50})


def test_a_map_brings_its_own_size_and_another_one_gives_it_back() -> None:
    state = begin("rustamani2024", "as_run").with_settings({"map": "field"})
    assert (state.settings["width"], state.settings["height"]) == (30.0, 10.0)
    assert copied(state) == state.job
    edited = state.place([{"disc": {"x": 20.0, "y": 5.0, "radius": 1.0}}])
    assert edited.settings["width"] == 30.0
    assert edited.with_settings({"map": "arena"}).settings["width"] == 10.0


def test_a_spec_that_sweeps_has_the_range_in_place_of_the_value() -> None:
    state = begin("nguyen2024", "as_run").with_settings({"cohesion_weight": 0.3})
    swept = state.sweep("cohesion_weight", Range(0.0, 1.0, 5)).sweep(
        "n", Range(10, 20, 4)
    )
    study = parse_spec(swept.as_text())
    columns = expand(study).columns
    assert sorted(set(columns["cohesion_weight"].tolist())) == [0, 0.25, 0.5, 0.75, 1]
    assert sorted(set(columns["n"].tolist())) == [10, 13, 17, 20]
    assert (study.replicates, study.record.trajectories) == (10, False)
    assert swept.job == state.job
    assert swept.sweep("n", None).sweep("cohesion_weight", None) == state


@pytest.mark.parametrize(
    ("name", "range_", "words"),
    [
        (
            "cohesion_wieght",
            Range(0, 1, 3),
            'unknown parameter "cohesion_wieght"; did you mean "cohesion_weight"',
        ),
        ("update", Range(0, 1, 3), "update: a range needs a parameter with numbers"),
        (
            "cohesion_weight",
            Range(0, 1, 1),
            "1 points are not allowed; use 2 to 1,000",
        ),
        ("cohesion_weight", Range(-1, 1, 3), "cohesion_weight; allowed: a number from"),
    ],
)
def test_a_range_that_cannot_be_swept_is_refused(
    name: str, range_: Range, words: str
) -> None:
    with pytest.raises(SpecError, match=words):
        begin("nguyen2024", "as_run").sweep(name, range_)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"cohesion_wieght": 1},
            'unknown parameter "cohesion_wieght"; did you mean "cohesion_weight"',
        ),
        (
            {"cohesion_weight": -1},
            "-1 is not allowed for cohesion_weight; allowed: a number from 0",
        ),
        ({"n": 200_000}, "200,000 boids are too many for the simulator; use at most"),
        ({"n": 2.5}, "2.5 is not allowed for n"),
        ({"seed": -1}, "seed"),
        ({"seed": "x"}, "'x' is not allowed; use an integer from 0"),
        ({"map": "cafetria"}, 'unknown map "cafetria"; did you mean "cafeteria"'),
        ({"map": "arena"}, "map arena is measured in m"),
        ({"map": "cafeteria", "width": 900}, "map cafeteria is 800 x 600"),
        ({"start_margin": 600}, "start_margin leaves boids no room"),
    ],
)
def test_what_a_spec_would_not_accept_is_refused(
    changes: dict[str, Any], words: str
) -> None:
    with pytest.raises(SpecError, match=words):
        begin("nguyen2024", "as_run").with_settings(changes)


@pytest.mark.parametrize(
    ("shapes", "words"),
    [
        (
            [{"disk": {"x": 1, "y": 1, "radius": 1}}],
            'unknown key "disk"; did you mean "disc"',
        ),
        ([{"disc": {"x": 1, "y": 1}}], 'missing key "radius"'),
        (
            [{"disc": {"x": 1, "y": 1, "radius": -1}}],
            '"radius" must be a number above 0',
        ),
        ([{"disc": {"x": 1, "y": "one", "radius": 1}}], '"y" must be a number'),
        ([7], "must be a mapping"),
    ],
)
def test_what_is_no_shape_is_refused(shapes: list[Any], words: str) -> None:
    with pytest.raises(SpecError, match=words):
        begin("nguyen2024", "as_run").place(shapes)


def test_an_unknown_model_or_preset_is_refused() -> None:
    with pytest.raises(
        SpecError, match='unknown model "nguyen"; did you mean "nguyen2024"'
    ):
        begin("nguyen", "as_run")
    with pytest.raises(
        SpecError, match='unknown preset of nanobot "as_ran"; did you mean "as_run"'
    ):
        begin("nanobot", "as_ran")


def test_a_literal_seed_stays_one() -> None:
    state = from_study(
        parse_spec(short("fixed: {n: 5}").replace("replicates: 2", "seeds: [27, 729]"))
    )
    assert state.as_spec()["seeds"] == [27]
    assert state.with_settings({"seed": 729}).job.literal
    first = copied(state)
    assert (first.seed, first.literal, first.point) == (27, True, state.job.point)


def test_the_plotted_metrics_are_recorded_frame_by_frame() -> None:
    state = begin("patel2023", "as_run").follow(("potential", "speed"))
    record = parse_spec(state.as_text()).record
    assert (record.series, record.every, record.trajectories) == (
        ("potential", "speed"),
        1,
        True,
    )
    with pytest.raises(SpecError, match='unknown metric "sped"; did you mean "speed"'):
        state.follow(("sped",))
    assert parse_spec(state.follow(()).as_text()).record.series == ()


def test_trajectories_too_large_to_want_are_left_out() -> None:
    state = begin("nguyen2024", "as_run").with_settings(
        {"n": 1000, "steps": MOST_STORED // 1000 + 1}
    )
    assert "trajectories" not in state.as_spec()["record"]
    assert state.with_settings({"n": 999}).as_spec()["record"]["trajectories"]


def test_a_copied_spec_fits_into_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    state = begin("aziel_chen2025", "as_run")
    monkeypatch.setattr("sweep.web.state.MOST_BYTES", 2000)
    assert len(state.place([DISC] * 10).as_text()) < 2000
    with pytest.raises(
        SpecError, match=r"larger than 2,000 bytes, because the map has too many shapes"
    ):
        state.place([DISC] * 40).as_text()


def test_copies_of_different_screens_are_different_studies() -> None:
    state = begin("nguyen2024", "as_run")
    names = [state.as_spec()["study"], state.with_settings({"n": 5}).as_spec()["study"]]
    assert len(set(names)) == 2
    assert state.as_spec()["study"] == names[0]


def test_a_file_has_the_name_of_the_opened_spec_while_its_trial_is_shown() -> None:
    state = from_study(parse_spec(SMALL))
    assert state.study == "small"
    assert replace(state, plots=("dispersion",)).study == "small"
    assert state.with_settings({"n": 5}).study.startswith("view/nguyen2024-")


@pytest.mark.parametrize("model", MODELS)
def test_noise_is_common_so_that_a_longer_run_is_the_same_run(model: str) -> None:
    state = begin(model, "as_run")
    longer = state.with_settings({"steps": 2 * int(state.settings["steps"])})
    assert state.job.streams == longer.job.streams
    assert state.job.streams.noise == "common"
    assert state.job.point != longer.job.point
    assert json.dumps(longer.as_spec())
    assert np.array_equal(state.job.obstacles is None, longer.job.obstacles is None)
