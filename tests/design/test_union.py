"""The points of several designs, united: each runs once, whichever design has it."""

import re
from pathlib import Path

import pytest

from sweep.design.design import Design, expand
from sweep.design.jobs import Jobs
from sweep.design.plan import make_plan
from sweep.errors import ChoiceError, SpecError
from sweep.methods.sensitivity import sensitivity
from sweep.spec.settings import Value
from sweep.spec.study import parse_spec
from tests.spec.test_schema import VALIDATOR, content
from tests.specs import short, short_study
from tests.studies import SMALL, launched

TWO = """
sweep:
  - {n: [3, 4], separation_weight: [0.5, 1]}
  - {n: [4, 5]}
"""


def rows(design: Design, *names: str) -> list[tuple[Value, ...]]:
    return [
        tuple(design.settings(point)[name] for name in names)
        for point in range(design.n_points)
    ]


def ids(text: str) -> set[str]:
    study = short_study(text)
    return set(Jobs(study, expand(study)).table()["trial_id"].to_pylist())


def test_a_point_of_two_designs_is_run_once() -> None:
    design = expand(short_study(TWO))
    assert rows(design, "n", "separation_weight") == [
        (3, 0.5),
        (3, 1.0),
        (4, 0.5),
        (4, 1.0),
        (5, 1.0),
    ]
    assert design.duplicates == 1
    assert "merged     1 equal points" in make_plan(short_study(TWO), 1).as_text()


def test_trials_are_those_of_the_studies_of_each_design() -> None:
    one = ids("sweep: {n: [3, 4], separation_weight: [0.5, 1]}")
    other = ids("sweep: {n: [4, 5]}")
    assert ids(TWO) == one | other
    assert len(one & other) == 2
    assert ids("sweep: [{n: [4, 5]}]") == other


def test_a_map_brings_its_size_where_another_design_sweeps_the_width() -> None:
    spec = short("sweep: [{map: [field]}, {map: [empty], width: [9]}]")
    design = expand(parse_spec(spec.replace("nguyen2024", "rustamani2024")))
    assert rows(design, "map", "width", "height") == [
        ("field", 30.0, 10.0),
        ("empty", 9.0, 10.0),
    ]


def test_conditions_and_derived_settings_hold_for_all_designs() -> None:
    text = """
derive: {steps: 2 * n}
require: [n != 4]
sweep:
  - {n: [3, 4]}
  - {n: {values: [4, 5]}, drag: {values: [0.5], when: n > 4}}
"""
    design = expand(short_study(text))
    assert rows(design, "n", "steps", "drag") == [(3, 6, 0.1), (5, 10, 0.5)]
    assert [one.count for one in design.rejected] == [1]


@pytest.mark.parametrize(
    ("sweep", "said"),
    [
        ("sweep: []", '6: "sweep" must be a list with at least one value'),
        ("sweep: [{n: [3]}, 5]", '6: "sweep" must be a mapping'),
        (
            "sweep:\n  - {n: [3]}\n  - {m: [3]}\n  - {speed: [3]}",
            '8: unknown parameter "m".*\n.*9: unknown parameter "speed"',
        ),
        (
            "fixed: {n: 3}\nsweep:\n  - {drag: [0]}\n  - {n: [3]}",
            '9: "n" already has a value, under fixed.n',
        ),
        (
            "sweep:\n  - {n: [3]}\n"
            "  - {steps: {values: [1], when: drag > 0}, drag: [1]}",
            '8: when cannot use "drag" here: "drag" is swept by drag',
        ),
        (
            "sweep:\n  - {n: [3]}\n  - {all: {ablate: as_written}}",
            '8: "all" has ablate, which excludes several designs',
        ),
        (
            "sweep:\n  - {n: [3]}\n  - g: {sample: morris, points: 2,"
            " drag: {uniform: [0, 1]}, cohesion_weight: {uniform: [0, 1]}}",
            '8: "g" is a morris sample, which excludes several designs',
        ),
        (
            "sweep:\n  - both: {zip: {n: [3], steps: [1]}}\n"
            "  - both: {zip: {n: [3], drag: [1]}}",
            '8: "both" is also an axis of another design',
        ),
    ],
)
def test_mistakes_are_said_with_their_lines(sweep: str, said: str) -> None:
    with pytest.raises(SpecError, match=re.compile(rf"spec.yaml:{said}", re.S)):
        expand(short_study(sweep))


def test_tables_have_all_points_and_samples_are_not_analysed(tmp_path: Path) -> None:
    united = SMALL.replace(
        "sweep:\n  separation_weight: [0.5, 1]",
        "sweep:\n  - {separation_weight: [0.5, 1]}\n"
        "  - {cohesion_weight: {uniform: [0, 1], points: 2}}",
    )
    study = launched(united, tmp_path)
    assert len(study.points) == 4
    assert study.varied == ["separation_weight", "cohesion_weight"]
    assert list(study.axes) == ["cohesion_weight", "separation_weight"]
    with pytest.raises(ChoiceError, match="the study joins 2 designs"):
        sensitivity(study, "speed")


def test_editors_know_several_designs() -> None:
    assert VALIDATOR.is_valid(content(short(TWO)))
    assert not VALIDATOR.is_valid(content(short("sweep: [{n: [3]}, {m: [3]}]")))
    assert not VALIDATOR.is_valid(content(short("sweep: []")))
