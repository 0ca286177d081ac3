"""The section `refine` of a spec."""

import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

from sweep.errors import SpecError
from sweep.methods.refinement.rule import RefinedAxis
from sweep.spec.schema import json_schema
from sweep.spec.study import parse_spec
from tests.methods.test_refine import LINE, PLANE

VALIDATOR = Draft7Validator(json_schema())


def content(text: str) -> object:
    return YAML(typ="safe", pure=True).load(text)


def changed(old: str, new: str, spec: str = LINE) -> str:
    """A spec with another text in one place."""
    assert old in spec
    return spec.replace(old, new, 1)


def test_a_rule_is_read() -> None:
    refine = parse_spec(PLANE).sections["refine"]
    assert refine
    assert refine.metric == "speed"
    assert refine.at == 2.0
    assert [*refine.scales] == ["cohesion_weight", "separation_weight"]
    scale = refine.scales["cohesion_weight"]
    assert scale == RefinedAxis((0.01, 0.1, 1.0), 2, geometric=True)
    assert (refine.least, refine.most, refine.budget) == (3, 12, 300)
    assert refine.confidence == 0.95
    VALIDATOR.validate(content(PLANE))


def test_the_steepest_place_is_sought_along_one_axis() -> None:
    spec = changed("at: 2", "at: steepest")
    refine = parse_spec(spec).sections["refine"]
    assert refine
    assert refine.steepest
    VALIDATOR.validate(content(spec))
    assert not VALIDATOR.is_valid(content(changed("at: 2", "at: steep")))


def test_a_study_without_the_section_has_no_rule() -> None:
    study = parse_spec(LINE[: LINE.index("refine:")])
    assert study.rule is None
    assert study.most_trials(3) == 9
    assert parse_spec(LINE).most_trials(3) == 300


def test_a_fixed_number_of_trials_needs_no_max() -> None:
    refine = parse_spec(changed(" max: 12,", "")).sections["refine"]
    assert refine
    assert refine.looks == (3,)


def test_whole_numbers_stay_whole() -> None:
    spec = changed("separation_weight: {linspace: [0, 1, 3]}", "n: [10, 40, 45]")
    spec = spec.replace("fixed: {n: 12, ", "fixed: {")
    refine = parse_spec(changed("[separation_weight]", "[n]", spec)).sections["refine"]
    assert refine
    assert refine.scales["n"].integer


AXES = "axes: [separation_weight]"
SWEEP = "separation_weight: {linspace: [0, 1, 3]}"


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (changed("metric: speed", "metric: sped"), 'unknown recorded metric "sped"'),
        (
            changed("metric: speed", "metric: coverage"),
            'metric "coverage" is not recorded',
        ),
        (
            changed("at: 2", "at: -1"),
            "speed is from 0, so the mean never crosses -1",
        ),
        (changed("at: 2", "at: high"), '"at" must be a number, in the unit of the me'),
        (changed("at: 2", "at: high"), "or steepest"),
        (changed("at: 2", "at: steepest", PLANE), '"at: steepest" needs exactly 1'),
        (changed(AXES, "axes: [n]"), 'unknown axis "n"'),
        (changed(AXES, "axes: []"), '"axes" must be a list'),
        (changed("until: 0.02", "until: 2%"), '"until" must be a number'),
        (changed("until: 0.02", "until: 1"), '"until" must be a number'),
        (changed("max: 12", "max: 2"), '"max" must be at least "replicates"'),
        (changed("max: 12", "most: 12"), 'unknown key "most"'),
        (changed(", budget: 300", ""), 'missing "budget"|needs "budget"|"budget"'),
        (changed("replicates: 3", "replicates: 2"), '"replicates" must be an int'),
        (
            changed(
                "replicates: 3",
                "replicates: {until: {metric: speed, half_width: 1}, max: 99}",
            ),
            '"replicates" must be an integer from 3',
        ),
        (changed("replicates: 3", "seeds: [1, 2, 3]"), 'takes no "seeds"'),
        (LINE + "order: coarse\n", 'takes no "order"'),
        (changed(SWEEP, "separation_weight: [1, 0]"), "two ascending values"),
        (changed(SWEEP, "separation_weight: [1]"), "two ascending values"),
        (
            changed(SWEEP, "separation_weight: {uniform: [0, 1], points: 9}"),
            "list of values or a grid",
        ),
        (
            changed(SWEEP, "separation_weight: {values: [0, 1], when: n > 3}"),
            'it has a condition, "when"',
        ),
        (
            changed(SWEEP, "map: [empty, cafeteria]").replace(AXES, "axes: [map]"),
            "the values are no numbers",
        ),
        (
            changed(f"  {SWEEP}", f"- {SWEEP}\n- n: [3, 4]").replace(
                "fixed: {n: 12, ", "fixed: {"
            ),
            "unites several designs",
        ),
    ],
)
def test_what_is_not_allowed_is_said(spec: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        parse_spec(spec)


def test_all_mistakes_are_said_at_once() -> None:
    spec = changed("metric: speed", "metric: sped").replace("max: 12", "max: 2")
    with pytest.raises(SpecError) as caught:
        parse_spec(changed(AXES, "axes: [nothing]", spec))
    assert len(caught.value.mistakes) == 3


@pytest.mark.parametrize(
    "spec",
    [
        changed("replicates: 3", "seeds: [1, 2, 3]"),
        LINE + "order: coarse\n",
        changed("until: 0.02", "until: 2"),
        changed(", budget: 300", ""),
        changed(
            "replicates: 3",
            "replicates: {until: {metric: speed, half_width: 1}, max: 9}",
        ),
    ],
)
def test_editors_mark_what_is_not_allowed(spec: str) -> None:
    assert [*VALIDATOR.iter_errors(content(spec))]
