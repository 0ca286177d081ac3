"""The section `realities` of a spec."""

import numpy as np
import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

from sweep.design.design import expand
from sweep.errors import SpecError
from sweep.spec.schema import json_schema
from sweep.spec.study import parse_spec

VALIDATOR = Draft7Validator(json_schema())
SPEC = """\
study: robots
model: nguyen2024
fixed: {steps: 10, packet_loss: 0.1}
realities: {position_noise: {normal: [5, 1]}, packet_loss: {uniform: [0, 0.5]},
  draws: 20}
sweep: {separation_weight: [1, 2]}
replicates: 2
"""
LOSS = "packet_loss: {uniform: [0, 0.5]}"


def changed(old: str, new: str) -> str:
    assert old in SPEC
    return SPEC.replace(old, new, 1)


def columns(spec: str) -> dict[str, np.ndarray]:
    """The parameters that vary, a value per point."""
    return expand(parse_spec(spec)).columns


def test_the_design_world_is_first_and_draws_are_common_to_all_points() -> None:
    VALIDATOR.validate(YAML(typ="safe", pure=True).load(SPEC))
    drawn = columns(SPEC)
    loss = drawn["packet_loss"].reshape(21, 2)
    assert drawn["separation_weight"].tolist() == 21 * [1.0, 2.0]
    assert loss[0].tolist() == [0.1, 0.1]
    assert drawn["position_noise"][:2].tolist() == [0.0, 0.0]
    assert (loss[:, 0] == loss[:, 1]).all()
    assert len({*loss[:, 0]}) == 21
    assert 0.0 <= loss.min() < loss.max() <= 0.5


def test_more_draws_and_imperfections_change_no_draw() -> None:
    loss = columns(SPEC)["packet_loss"]
    more = columns(changed("draws: 20", "draws: 40"))["packet_loss"]
    assert more[:42].tolist() == loss.tolist()
    spec = changed("draws: 20", "motor_lag: {uniform: [0, 5]}, draws: 20")
    assert columns(spec)["packet_loss"].tolist() == loss.tolist()
    other = columns(SPEC + "seed: 2\n")["packet_loss"]
    assert not (other[2:] == loss[2:]).any()


def test_conditions_and_derived_parameters_hold() -> None:
    spec = (
        SPEC + "require: [packet_loss < 0.25]\nderive: {motor_lag: 10 * packet_loss}\n"
    )
    drawn = columns(spec)
    assert 2 < len(drawn["packet_loss"]) < 42
    assert drawn["packet_loss"].max() < 0.25
    np.testing.assert_array_equal(drawn["motor_lag"], 10 * drawn["packet_loss"])


def test_repeated_draws_count_once() -> None:
    spec = changed(
        "position_noise: {normal: [5, 1]}, packet_loss: {uniform: [0, 0.5]}",
        "n: {integers: [10, 40]}",
    ).replace("draws: 20", "draws: 200")
    design = expand(parse_spec(spec))
    numbers = design.columns["n"].reshape(-1, 2)[:, 0]
    assert sorted({*numbers[1:]}) == sorted(numbers[1:].tolist())
    assert design.duplicates == 201 - len(numbers)


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (changed(",\n  draws: 20", ""), 'missing "draws": the number of realities'),
        (changed("draws: 20", "draws: 9"), '"draws" must be an integer from 10'),
        (
            changed("packet_loss: {u", "packet_los: {u"),
            'unknown parameter "packet_los"; did you mean "packet_loss"?',
        ),
        (
            "\n".join(
                "realities: {draws: 20}" if "realities" in line else line
                for line in SPEC.splitlines()
                if "draws: 20" not in line
            ),
            '"realities" has no imperfection',
        ),
        (changed("[0, 0.5]", "[0, 2]"), "uniform: 2 is not allowed for packet_loss"),
        (changed("uniform", "unifrom"), "unifrom"),
        (
            changed("{separation_weight: [1, 2]}", "{packet_loss: [0, 0.5]}"),
            '"packet_loss" already has a value, under fixed',
        ),
        (
            SPEC + "derive: {packet_loss: separation_weight / 9}\n",
            '"packet_loss" already has a value, under fixed',
        ),
        (
            changed(
                "position_noise: {normal: [5, 1]}", "map: {choice: [empty, maze]}"
            ).replace(f", {LOSS}", ""),
            "only 2 different realities besides the design world",
        ),
        (
            SPEC + "refine: {metric: speed, at: 3}\n",
            'a study with "realities" takes no "refine"',
        ),
    ],
)
def test_what_the_section_refuses(spec: str, message: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_spec(spec)
    assert message in str(refused.value)


def test_two_mistakes_are_told_together() -> None:
    spec = changed("packet_loss: {u", "packet_los: {u").replace("draws: 20", "draws: 9")
    with pytest.raises(SpecError) as refused:
        parse_spec(spec)
    assert "packet_los" in str(refused.value)
    assert '"draws"' in str(refused.value)


def test_an_editor_knows_the_distributions() -> None:
    for wrong in (
        changed("uniform", "unifrom"),
        changed("packet_loss: {uniform", "packet_los: {uniform"),
        changed(",\n  draws: 20", ""),
    ):
        assert [*VALIDATOR.iter_errors(YAML(typ="safe", pure=True).load(wrong))], wrong
