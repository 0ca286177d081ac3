"""Spreads of parameters: settings that are known where a spec names them."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.design.jobs import Jobs, stream
from sweep.design.plan import make_plan
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec, study_of
from sweep.spec.settings import Value, settings_of
from sweep.spec.study import Study, parse_spec
from sweep.store.rows import trials_schema
from sweep.trial.simulation import Simulation
from tests import ROOT

HEAD: dict[str, Any] = {"study": "s", "model": "nguyen2024", "replicates": 2}
SMALL = {"n": 8, "steps": 5}
USED = {
    "nguyen2024": "separation_range",
    "aziel_chen2025": "perception_range",
    "rustamani2024": "look_ahead",
    "patel2023": "max_speed",
    "nanobot": "min_speed",
    "vicsek1995": "noise",
    "dorsogna2006": "mass",
    "couzin2002": "max_turn",
    "cucker_smale2007": "strength",
    "strombom2014": "flight_strength",
    "vasarhelyi2018": "friction_gain",
}
"""A parameter of each model that may differ; `update`, `dt` and `n` never may."""


def study(**more: Any) -> Study:
    return parse_spec(HEAD | {"fixed": SMALL} | more)


def values(one: Study, name: str) -> list[Value]:
    """Those of a setting at the points of a study."""
    design = expand(one)
    return [design.settings(point)[name] for point in range(design.n_points)]


def said(**more: Any) -> str:
    with pytest.raises(SpecError) as error:
        expand(study(**more))
    return str(error.value)


@pytest.mark.parametrize("model", MODELS)
def test_every_model_has_parameters_that_may_differ(model: str) -> None:
    settings = settings_of(model, BUILT_IN)
    assert f"{USED[model]}_spread" in settings.spreads
    for name in ("dt", "update", "n", "motor_lag"):
        assert f"{name}_spread" not in settings.spreads
        assert f"{name}_spread" in settings.refused
    for name, spread in settings.spreads.items():
        parameter = settings[spread.spread_of]
        assert (name, parameter.kind) == (f"{parameter.name}_spread", "float")
        assert parameter.name in MODELS[model].params._fields
    assert not settings.spreads.keys() & settings.keys()


def test_a_spread_is_a_setting_of_those_that_name_it_alone() -> None:
    """So others have the columns and ids that they had."""
    name = "drag_spread"
    without, with_it = study(), study(fixed=SMALL | {name: 0.2})
    assert name not in without.settings
    assert [*with_it.settings] == [*without.settings, name]
    columns = [set(trials_schema(one, {}).names) for one in (without, with_it)]
    assert columns[1] - columns[0] == {name}
    assert with_it.preset_settings[name] == 0.0


@pytest.mark.parametrize(
    "more",
    [
        {"sweep": {"drag_spread": [0, 0.1, 0.2]}},
        {"sweep": {"drag_spread": {"linspace": [0, 0.2, 3]}}},
        {"sweep": {"z": {"zip": {"drag_spread": [0, 0.1, 0.2], "drag": [0, 0.1, 0]}}}},
        {"sweep": [{"drag_spread": [0, 0.1]}, {"drag_spread": [0.2]}]},
        {"sweep": {"drag": [0, 0.5, 1]}, "derive": {"drag_spread": "drag / 5"}},
    ],
)
def test_spreads_are_swept_and_derived(more: dict[str, Any]) -> None:
    found = values(study(**more), "drag_spread")
    assert found == pytest.approx([0, 0.1, 0.2])


def test_designs_of_which_one_has_a_spread_are_united() -> None:
    one = study(sweep=[{"drag": [0.0, 0.1]}, {"drag_spread": [0.3]}])
    assert values(one, "drag_spread") == [0.0, 0.0, 0.3]


def test_a_condition_may_ask_for_a_spread() -> None:
    assert values(study(require=["drag_spread < 1"]), "drag_spread") == [0.0]


def test_a_detail_may_be_a_spread() -> None:
    details = {"unlike": {"drag_spread": 0.2}, "slow": {"max_force": 0.1}}
    one = study(sweep={"detail": {"ablate": details}})
    assert values(one, "drag_spread") == [0.0, 0.2, 0.0, 0.2]
    for spread in (0.0, 11.0):
        words = "changes no value" if spread == 0.0 else "from 0 to 10"
        wrong = {"ablate": {"unlike": {"drag_spread": spread}}}
        assert words in said(sweep={"detail": wrong})


def test_a_search_may_seek_a_spread_and_run_over_one() -> None:
    search = {
        "objectives": {"speed": {"maximize": "mean"}},
        "budget": 24,
        "parameters": {"drag_spread": {"uniform": [0, 0.5]}},
        "over": {"max_force_spread": [0, 0.1]},
    }
    found = study(search=search)
    assert {"drag_spread", "max_force_spread"} < found.settings.keys()
    assert found.preset_settings["max_force_spread"] == 0.0


def test_no_spread_is_the_same_point_as_no_word_of_it() -> None:
    """And another spread is another one, with the same start, made alike."""
    without, zero, some = (
        Jobs(one, expand(one))[0]
        for one in (
            study(),
            study(fixed=SMALL | {"drag_spread": 0}),
            study(fixed=SMALL | {"drag_spread": 0.2}),
        )
    )
    assert without.trial_id == zero.trial_id
    assert zero.trial_id != some.trial_id
    for purpose in ("start", "made"):
        keys = [stream(job, purpose).generate_state(4) for job in (zero, some)]
        assert (keys[0] == keys[1]).all()
    assert Simulation(zero).flight.work.robots.rows == ()
    assert len(Simulation(some).flight.work.robots.rows[0]) == 8


def test_lasting_streams_know_spreads() -> None:
    lasting = {"noise": "lasting", "start": "lasting", "world": "lasting"}
    jobs = [
        Jobs(one, expand(one))[0]
        for one in (
            study(fixed={"n": 8, "steps": steps, "drag_spread": 0.1}, streams=lasting)
            for steps in (5, 6)
        )
    ]
    states = [stream(job, "made").generate_state(4) for job in jobs]
    np.testing.assert_array_equal(*states)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("dt_spread", 'parameter "dt_spread" cannot be used: nguyen2024 does not read'),
        ("update_spread", "update is not a real number, which a factor could"),
        (
            "n_spread",
            "n is not a parameter of nguyen2024 itself; parameters that may differ:"
            " separation",
        ),
        ("motor_lag_spread", "motor_lag is not a parameter of nguyen2024"),
        ("drg_spread", 'unknown parameter "drg_spread"; did you mean "drag_spread"?'),
    ],
)
def test_what_cannot_differ_is_refused_with_the_reason(name: str, words: str) -> None:
    assert words in said(fixed=SMALL | {name: 0.1})
    assert words in said(sweep={name: [0.1]})


def test_potentials_are_not_recorded_of_robots_that_differ_in_them() -> None:
    on = {"record": {"metrics": ["potential"]}, "model": "patel2023"}
    wrong = said(**on, fixed=SMALL | {"cohesion_weight_spread": 0.1})
    assert "cohesion_weight_spread gives each robot a separate pair potential" in wrong
    assert "but potential need a common potential" in wrong
    expand(study(**on, fixed=SMALL | {"cohesion_weight_spread": 0}))
    expand(study(**on, fixed=SMALL | {"max_speed_spread": 0.1}))


def test_a_spread_of_what_no_factor_changes_is_noted() -> None:
    fixed = SMALL | {"drag_spread": 0.2, "drag": 0}
    found = make_plan(study(fixed=fixed), 1).notes
    assert any(
        "drag_spread changes nothing: no point has 0 < abs(d" in x for x in found
    )


def test_a_model_of_ones_own_needs_nothing_but_the_call() -> None:
    """And without it the error names the line."""
    folder = ROOT / "examples"
    spec = HEAD | {
        "model": "./vortex.py",
        "fixed": SMALL | {"swirl_weight_spread": 0.1},
    }
    one = study_of(spec, folder / "spec.yaml")
    simulation = Simulation(Jobs(one, expand(one))[0])
    (table,) = simulation.flight.work.robots.rows
    assert len(set(table.swirl_weight)) == 8
    assert set(table.max_speed) == {3.0}


def test_a_model_that_reads_no_robots_parameters_is_told_how(tmp_path: Path) -> None:
    text = (ROOT / "examples/vortex.py").read_text()
    text = text.replace("params_of(params, work, i)", "params")
    (tmp_path / "alike.py").write_text(text)
    spec = HEAD | {"model": "./alike.py", "fixed": SMALL | {"max_speed_spread": 0.1}}
    with pytest.raises(SpecError) as error:
        study_of(spec, tmp_path / "spec.yaml")
    assert "write `robot = params_of(params, work, i)`" in str(error.value)


def test_a_parameter_that_has_the_name_of_something_in_a_record_is_told_so(
    tmp_path: Path,
) -> None:
    """NumPy would give kernels the size of the record for that of the robot. Without
    spreads such a model flies.
    """
    text = Path("examples/vortex.py").read_text(encoding="utf-8")
    named = text.replace("max_speed", "size")
    assert named.count("size") > 2
    (tmp_path / "vortex.py").write_text(named, encoding="utf-8")
    spec = "study: my/a\nmodel: ./vortex.py\nfixed: {n: 5, steps: 2%s}\nreplicates: 1\n"
    path = tmp_path / "spec.yaml"
    path.write_text(spec % "", encoding="utf-8")
    expand(load_spec(path))
    for name in ("size", "swirl_weight"):
        path.write_text(spec % f", {name}_spread: 0.1", encoding="utf-8")
        with pytest.raises(SpecError) as error:
            load_spec(path)
        words = "size is an attribute of NumPy records: rename the parameter"
        assert f'spec.yaml:3: parameter "{name}_spread" cannot be used: {words}' in str(
            error.value
        )
