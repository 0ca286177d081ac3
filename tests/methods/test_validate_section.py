"""The section `validate` of a spec, and the studies that follow from it."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

from kernels.catalogue import BUILT_IN
from kernels.settings import Demand
from sweep.campaigns.launching import check_launches
from sweep.errors import SpecError
from sweep.methods.robustness.variants import named_variants, unjudged
from sweep.own_code.reading import with_variants
from sweep.spec.schema import json_schema
from sweep.spec.settings import Setting
from sweep.spec.study import Study, parse_spec
from tests.studies import SMALL

VALIDATED = SMALL + "validate: {dt: [1, 1/2, 1/4], search: all_pairs, update: both}\n"
VALIDATOR = Draft7Validator(json_schema())


def changed(*pairs: tuple[str, str], spec: str = VALIDATED) -> str:
    """A spec with other texts in some places."""
    for old, new in pairs:
        assert old in spec
        spec = spec.replace(old, new, 1)
    return spec


def variants(spec: str = VALIDATED) -> dict[str, Study]:
    """The variants of a study by their names below it."""
    first, *others = with_variants(parse_spec(spec))
    return {one.name.removeprefix(f"{first.name}/"): one for one in others}


def names(study: Study) -> dict[str, str]:
    """The variants of a study with what differs."""
    return named_variants(study, study.sections["validate"])


def test_a_study_without_the_section_has_no_variants() -> None:
    study = parse_spec(SMALL)
    assert (study.sections, with_variants(study)) == ({}, [study])


def test_each_part_of_the_section_asks_for_variants() -> None:
    assert names(parse_spec(VALIDATED)) == {
        "dt-1of2": "dt 1/2",
        "dt-1of4": "dt 1/4",
        "all-pairs": "all pairs",
        "update-synchronous": "synchronous updates",
    }
    assert [*variants()] == [*names(parse_spec(VALIDATED))]
    VALIDATOR.validate(YAML(typ="safe", pure=True).load(VALIDATED))


def test_a_share_of_a_step_is_a_text_or_a_number() -> None:
    spec = changed(("[1, 1/2, 1/4]", '[0.5, "1 / 4", 0.3333333]'))
    assert [*variants(spec)][:3] == ["dt-1of2", "dt-1of3", "dt-1of4"]


def test_shorter_steps_are_more_of_them_for_the_same_time() -> None:
    """nguyen2024 as_run loses a share of 0.1 of its velocity in each step, and draws a
    random acceleration within 0.2 in each.
    """
    study = variants(changed(("every: 2}", "every: 2}\ntime_limit: 9")))["dt-1of4"]
    values = study.preset_settings | study.fixed
    assert (values["dt"], values["steps"], study.record.every) == (0.25, 36, 8)
    assert (values["equilibrium_steps"], study.time_limit) == (120, 36)
    assert (1 - float(values["drag"])) ** 4 == pytest.approx(0.9, rel=1e-14)
    assert values["wander_range"] == pytest.approx(0.4, rel=1e-15)
    assert values["separation_range"] == 50.0, "what does not act once a step stays"
    assert "validate" not in study.sections


def test_the_others_differ_in_one_thing_each() -> None:
    made = variants()
    first = parse_spec(VALIDATED)
    assert made["all-pairs"].neighbour_search == "all_pairs"
    assert made["all-pairs"].fixed == first.fixed
    assert made["update-synchronous"].fixed == first.fixed | {"update": "synchronous"}
    assert {one.neighbour_search for one in (first, made["dt-1of2"])} == {"grid"}


def test_what_is_counted_in_steps_changes_wherever_it_stands() -> None:
    axis = changed(("steps: 9", "n: 12"), ("{n: 12, n: 12}", "{n: 12}"))
    axis = changed(("[0.5, 1]", "[0.5, 1]\n  steps: {linspace: [4, 12, 3]}"), spec=axis)
    (found,) = (one for one in variants(axis)["dt-1of2"].axes if one.name == "steps")
    assert found.columns["steps"].tolist() == [8, 16, 24]
    derived = changed((", steps: 9", ""), spec=VALIDATED) + "derive: {steps: 3 * n}\n"
    assert variants(derived)["dt-1of4"].derive["steps"].text == "(3 * n) * 4"


def test_lists_that_vary_together_change_by_their_rules() -> None:
    spec = changed(("steps: 9", "n: 12"), ("{n: 12, n: 12}", "{n: 12}"))
    both = "[0.5, 1]\n  both: {zip: {steps: [4, 6], drag: [0, 0.19]}}"
    study = variants(changed(("[0.5, 1]", both), spec=spec))["dt-1of2"]
    (found,) = (one for one in study.axes if one.name == "both")
    assert found.columns["steps"].tolist() == [8, 12]
    assert found.columns["drag"] == pytest.approx([0.0, 0.1])


def test_links_of_a_chain_take_as_long_with_shorter_steps() -> None:
    chain = "{values: [0.5, 1], continue: up, hold: 7}"
    spec = changed(("[0.5, 1]", chain), (", steps: 9", ""))
    study = variants(spec)["dt-1of4"]
    (axis,) = study.axes
    assert axis.continued is not None
    assert (axis.continued.hold, study.fixed["dt"]) == (28, 0.25)


@pytest.mark.parametrize("parts", [1, 2, 7])
def test_a_rule_says_what_a_setting_becomes(parts: int) -> None:
    def of(value: float, **about: Any) -> float:
        return Setting("s", "float", "parameters", "", **about).in_parts(value, parts)

    assert of(3.0) == 3.0
    assert of(3, in_steps=True) == 3 * parts
    assert of(3.0, each_step="time") == 3.0 / parts
    kept = (1.0 - of(0.3, each_step="share")) ** parts
    assert kept == pytest.approx(0.7, rel=1e-14)
    assert of(1.0, each_step="share") == 1.0
    noise = of(3.0, each_step="noise")
    assert noise == pytest.approx(3.0 * math.sqrt(parts), rel=1e-15)


def test_the_variance_of_a_damped_random_velocity_converges() -> None:
    """Of a velocity that gets a random acceleration and loses a share in each step: the
    variance after 20 steps comes nearer to its limit by half with each halving of the
    step, as an error of the first order does. A tenth is left for the next order.
    """
    drag, wander = (
        Setting("s", "float", "parameters", "", each_step=one)
        for one in ("share", "noise")
    )

    def variance(parts: int) -> float:
        lost, width, found = drag.in_parts(0.1, parts), wander.in_parts(0.2, parts), 0.0
        for _ in range(20 * parts):
            found = (found + (width / parts) ** 2 / 3.0) * (1.0 - lost) ** 2
        return found

    one, two, four, eight = map(variance, (8, 16, 32, 64))
    assert (one - two) / (two - four) == pytest.approx(2.0, rel=0.1)
    assert (two - four) / (four - eight) == pytest.approx(2.0, rel=0.1)


def test_what_one_step_changes_is_not_judged_with_another_step() -> None:
    recorded = "record: {metrics: [turn_rate, speed], derive: {"
    recorded += "a: turn_rate / speed, b: speed * dt, c: speed + 1}}"
    spec = changed(("record: {series: [speed], every: 2}", recorded))
    study = parse_spec(spec)
    assert unjudged(study, study.sections["validate"], "dt-1of2") == [
        "turn_rate",
        "a",
        "b",
    ]
    assert unjudged(study, study.sections["validate"], "update-synchronous") == []


DT = "dt: [1, 1/2, 1/4]"
VICSEK = (
    "study: s\nmodel: vicsek1995\nfixed: {n: 9, steps: 5}\nsweep: {noise: [0, 1]}\n"
    "replicates: 3\n"
)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (changed((DT, "dt: [2]")), '"dt" must be a fraction of the time step'),
        (changed((DT, "dt: [1/65]")), '"dt" must be a fraction of the time step'),
        (changed((DT, "dt: [true]")), '"dt" must be a fraction of the time step'),
        (changed((DT, "dt: [1/0]")), '"dt" must be a fraction of the time step'),
        (changed((DT, "dt: [1/2, 0.5]")), '0.5 is listed twice in "dt"'),
        (changed((DT, "td: [1/2]")), 'unknown key "td". Allowed: dt, search, update'),
        (changed(("all_pairs", "all_pears")), 'did you mean "all_pairs"'),
        (changed(("update: both", "update: one")), 'updates "one". Allowed: both'),
        (SMALL + "validate: {dt: [1]}\n", '"validate" changes nothing'),
        (changed(("[0.5, 1]", "[1]")), "there is nothing to conclude"),
        (
            VICSEK + "validate: {dt: [1/2]}\n",
            "model vicsek1995 has no time step that could be shorter",
        ),
        (
            VALIDATED + "refine: {metric: speed, at: 2, axes: [separation_weight],"
            " until: 0.1, budget: 9}\n",
            'a study with "validate" takes no "refine"',
        ),
        (changed(("seed: 5", "neighbour_search: all\nseed: 5")), "Allowed: grid"),
    ],
)
def test_what_cannot_be_is_refused(spec: str, message: str) -> None:
    with pytest.raises(SpecError, match=message):
        parse_spec(spec)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (changed(("steps: 9", "steps: 600000000")), "1200000000 is not allowed for st"),
        (
            VALIDATED + "derive: {wander_range: 1 / steps}\n",
            '"1 / steps" uses steps, which a shorter step changes',
        ),
        (
            changed(("[0.5, 1]", "[0.5, 1]\n  update: [sequential, synchronous]")),
            '"update" already varies in the study',
        ),
        (
            changed(
                (
                    "[0.5, 1]",
                    "[0.5, 1]\n  both: {zip: {dt: [1, 2],"
                    " drag: {linspace: [0, 0.1, 2]}}}",
                )
            ),
            '"drag" changes with the step, but its axis has more than a list',
        ),
    ],
)
def test_a_variant_that_cannot_be_is_refused_with_its_line(
    spec: str, message: str
) -> None:
    study = parse_spec(spec)
    line = study.document.lines["validate",]
    with pytest.raises(SpecError, match=message) as caught:
        with_variants(study)
    assert str(caught.value).startswith(f"spec.yaml:{line}: ")


def test_all_mistakes_of_variants_are_said_at_once() -> None:
    axes = "[0.5, 1]\n  update: [sequential, synchronous]"
    spec = changed(("[0.5, 1]", axes), ("steps: 9", "steps: 600000000"))
    with pytest.raises(SpecError) as caught:
        with_variants(parse_spec(spec))
    assert len(caught.value.mistakes) == 2


def test_what_only_the_points_show_names_the_variant() -> None:
    nguyen = BUILT_IN.models["nguyen2024"]
    at_once = Demand("update == 'synchronous'", "boids wait for each other")
    strict = nguyen._replace(demands=(*nguyen.demands, at_once))
    known = replace(BUILT_IN, models={**BUILT_IN.models, "nguyen2024": strict})
    spec = changed(("steps: 9", "steps: 9, update: synchronous"))
    studies = with_variants(parse_spec(spec, Path("s.yaml"), known))
    with pytest.raises(SpecError) as caught:
        check_launches(studies)
    said = "boids wait for each other where update = sequential"
    assert str(caught.value) == f"s.yaml (update-sequential):4: {said}"
