"""A spec that is opened on the page comes out of it as it went in, but for what was
changed there.
"""

import random
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from sweep.design.design import expand
from sweep.design.jobs import Jobs, directed
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec, study_with
from sweep.spec.study import Study, parse_spec
from sweep.web import messages
from sweep.web.live_show import Live
from sweep.web.opened import OpenedSpec, opened, opened_again
from sweep.web.state import Range, ViewState, from_opened, from_study
from tests import ROOT
from tests.cases import slow_but
from tests.specs import short

SPECS = sorted(
    path
    for path in (ROOT / "experiments").glob("*/*.yaml")
    if path.name != "published.yaml"
)
SEPARATION = ROOT / "experiments" / "nguyen2024" / "separation.yaml"
DISC = {"disc": {"x": 100.0, "y": 200.0, "radius": 30.0}}


@cache
def spec_of(path: Path) -> OpenedSpec:
    return opened(load_spec(path))


def copied(state: ViewState) -> Study:
    assert state.opened
    return study_with(state.as_text(), state.opened.study.path, state.catalogue)


def survivors(study: Study) -> list[object]:
    """All of a study that a change of one setting has nothing to do with."""
    axes = [
        (one.name, {name: column.tolist() for name, column in one.columns.items()})
        for one in study.axes
    ]
    kept = (study.name, study.record, study.replicates, study.seeds, study.streams)
    policy = (study.policy, study.order, study.time_limit, study.checkpoint)
    return [axes, *kept, *policy, study.require, study.has_design]


def is_in(state: ViewState, study: Study) -> bool:
    """Whether what is shown is a point of a study."""
    return state.job.point in Jobs(study, expand(study)).points


@pytest.mark.parametrize(
    "path",
    slow_but(SPECS[::4], SPECS),
    ids=lambda path: f"{path.parent.name}-{path.stem}",
)
def test_what_was_not_touched_comes_out_byte_by_byte_at_any_trial(path: Path) -> None:
    """A link of a chain is shown as a trial that begins as its settings say."""
    spec, drawn = spec_of(path), random.Random(str(path.name))
    point = drawn.randrange(spec.design.n_points)
    replicate = drawn.randrange(spec.replicates)
    state = from_opened(spec.at(point, replicate))
    assert state.as_text() == spec.study.text
    job = Jobs(spec.study, spec.design)[point * spec.replicates + replicate]
    assert directed(state.job.point, job.direction) == job.point
    for same in ("seed", "literal", "settings", "streams", "obstacles"):
        assert getattr(state.job, same) == getattr(job, same), same
    assert state.job.literal or state.job.replicate == job.replicate


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", SPECS, ids=lambda path: f"{path.parent.name}-{path.stem}"
)
def test_one_changed_setting_leaves_all_else_of_every_spec(path: Path) -> None:
    spec = spec_of(path)
    before = from_opened(spec.at(spec.design.n_points - 1, spec.replicates - 1))
    value = 0.5 * float(before.settings["contact_distance"])
    state = before.with_settings({"contact_distance": value})
    study = copied(state)
    assert survivors(study) == survivors(spec.study)
    assert study.fixed == spec.study.fixed | {"contact_distance": value}
    assert is_in(state, study)
    assert (
        state.with_settings(
            {"contact_distance": before.settings["contact_distance"]}
        ).as_text()
        == spec.study.text
    )


def test_a_changed_setting_leaves_comments_axes_replicates_record_and_name() -> None:
    spec = spec_of(SEPARATION).at(3, 17)
    state = from_opened(spec).with_settings({"cohesion_weight": 2.0})
    study = copied(state)
    assert survivors(study) == survivors(spec.study)
    assert study.document.comment == spec.study.document.comment
    assert is_in(state, study)
    again = opened_again(state.as_text(), state.job.point, 17, BUILT_IN, SEPARATION)
    assert (again.point, again.replicate) == (3, 17)


def test_the_axis_of_a_changed_setting_gives_way_to_its_value() -> None:
    state = from_opened(spec_of(SEPARATION)).with_settings({"separation_weight": 3.0})
    study = copied(state)
    assert study.axes == ()
    assert study.fixed["separation_weight"] == 3
    assert (study.replicates, study.name) == (400, "nguyen2024/separation")
    assert is_in(state, study)


def test_what_was_derived_of_a_changed_setting_stays_as_it_is_shown() -> None:
    """The page computes nothing anew: the spec must not either."""
    text = short(
        "sweep: {n: [5, 6]}",
        "derive: {steps: 2 * n, start_margin: n}",
        "fixed: {dt: 1}",
    )
    state = from_study(parse_spec(text)).with_settings({"n": 9})
    study = copied(state)
    assert (study.axes, study.derive) == ((), {})
    assert (study.fixed["steps"], study.fixed["n"]) == (10, 9)
    assert is_in(state, study)


def test_a_point_that_conditions_reject_comes_out_without_them() -> None:
    text = short("sweep: {n: [5, 6]}", "require: [steps < 8]", "fixed: {steps: 4}")
    state = from_study(parse_spec(text)).with_settings({"steps": 9})
    study = copied(state)
    assert (study.require, study.axes) == ((), ())
    assert is_in(state, study)


def test_a_map_a_seed_plots_and_sweeps_are_added_to_the_spec() -> None:
    spec = spec_of(SEPARATION)
    state = from_opened(spec.at(2, 5)).place([DISC]).with_settings({"seed": 7})
    study = copied(state.follow(("polarization", "speed")))
    assert (study.seed, [*study.maps], study.fixed["map"]) == (7, ["edited"], "edited")
    assert study.record.series == (*spec.study.record.series, "polarization")
    assert [axis.name for axis in study.axes] == ["separation_weight"]
    assert is_in(state, study)
    swept = copied(state.sweep("n", Range(10, 20, 3)))
    assert [axis.name for axis in swept.axes] == ["separation_weight", "n"]
    assert "n" not in swept.fixed


def test_changes_stay_at_another_point_and_replicate() -> None:
    live = Live(from_study(load_spec(SEPARATION)))
    live.handle(messages.Set("cohesion_weight", 2.0))
    live.handle(messages.ShowValue("separation_weight", 1.5))
    live.handle(messages.ShowTrial(3, 17))
    status = live.status()
    assert status["trial"] == {
        "point": 3,
        "replicate": 17,
        "values": {"separation_weight": 1.5},
        "before": (3, 16),
        "after": (3, 18),
    }
    assert live.state.settings["cohesion_weight"] == 2
    (reply,) = live.handle(messages.Spec())
    assert reply["trial"] == "point 3 (of 0 to 4), replicate 17 (of 0 to 399)"
    live.handle(messages.Set("cohesion_weight", 1.0))
    assert live.state.as_text() == SEPARATION.read_text()
    for message, words in (
        (messages.ShowTrial(5, 0), "point: 5 is not in 0 to 4"),
        (messages.ShowTrial(0, 400), "replicate: 400 is not in 0 to 399"),
        (messages.ShowValue("n", 3), 'unknown varying parameter "n"'),
        (messages.ShowValue("separation_weight", 3), "no point has 3"),
    ):
        with pytest.raises(SpecError, match=words):
            live.handle(message)
    live.handle(messages.ChooseModel("patel2023", "as_run"))
    assert live.status()["trial"] is None
    with pytest.raises(SpecError, match="no spec is open"):
        live.handle(messages.ShowTrial(0, 0))


def test_the_nearest_point_has_a_value_that_is_asked_for() -> None:
    spec = opened(parse_spec(short("sweep: {n: [5, 6], steps: [3, 4, 7]}")))
    for name, column in spec.design.columns.items():
        other = column[column != column[0]][0]
        there = spec.having(name, other)
        now = spec.design.settings(there.point)
        assert now[name] == other
        differ = [
            one
            for one in spec.design.columns
            if now[one] != spec.design.settings(0)[one]
        ]
        assert differ == [name]


def test_what_a_page_has_kept_shows_the_same_frames_in_another_session() -> None:
    live = Live(from_study(load_spec(SEPARATION)))
    live.handle(messages.ShowTrial(1, 2))
    for name, value in (("n", 12), ("steps", 9), ("max_force", 0.4)):
        live.handle(messages.Set(name, value))
    live.handle(messages.Shapes([DISC]))
    kept = live.kept()
    other = Live(from_study(parse_spec(short("fixed: {n: 3}"))))
    hello = messages.Hello("x", kept["yaml"], kept["point"], kept["replicate"])
    other.restore(hello)
    assert other.kept() == kept
    assert other.state.job.settings == live.state.job.settings
    for one in (live, other):
        one.run()
        one.advance(9)
    assert np.array_equal(live.bodies, other.bodies)
    before = other.state
    with pytest.raises(SpecError, match="unknown model"):
        other.restore(messages.Hello("x", "study: a\nmodel: no\nreplicates: 1\n"))
    assert other.state is before


def test_a_kept_spec_has_the_files_that_run_already_and_no_other(
    tmp_path: Path,
) -> None:
    for name in ("vortex.py", "vortex.yaml"):
        (tmp_path / name).write_text((ROOT / "examples" / name).read_text())
    ran = tmp_path / "ran"
    (tmp_path / "other.py").write_text(f"open({str(ran)!r}, 'w')")
    state = from_study(load_spec(tmp_path / "vortex.yaml"))
    text = state.as_text()
    assert text == (tmp_path / "vortex.yaml").read_text()
    path, known = tmp_path / "vortex.yaml", state.catalogue
    assert opened_again(text, state.job.point, 0, known, path).job.point == (
        state.job.point
    )
    assert "./vortex.py" in state.with_settings({"n": 17}).as_text()
    other = text.replace("./vortex.py", "./other.py")
    for among in (known, BUILT_IN):
        with pytest.raises(SpecError):
            opened_again(other, "", 0, among, path)
    assert not ran.exists()
