"""The section `sizes` of a spec."""

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
study: sized
model: vicsek1995
fixed: {steps: 10}
sizes: {n: [40, 100, 400]}
sweep: {noise: [1, 2]}
replicates: 2
"""
N = "n: [40, 100, 400]"


def changed(old: str, new: str) -> str:
    assert old in SPEC
    return SPEC.replace(old, new, 1)


def test_worlds_grow_with_the_root_of_n() -> None:
    VALIDATOR.validate(YAML(typ="safe", pure=True).load(SPEC))
    study = parse_spec(SPEC)
    columns = expand(study).columns
    assert columns["n"].tolist() == [40, 40, 100, 100, 400, 400]
    assert columns["noise"].tolist() == 3 * [1.0, 2.0]
    # The preset has 100 boids in a world of 5 x 5.
    assert columns["width"].tolist() == np.sqrt(columns["n"] / 4.0).tolist()
    assert columns["height"].tolist() == columns["width"].tolist()
    assert [axis.name for axis in study.axes] == ["sizes", "noise"]


def test_points_are_those_that_derive_writes() -> None:
    spec = changed("sizes: {n: [40, 100, 400]}\n", "")
    spec = spec.replace("sweep: {", "sweep: {n: [40, 100, 400], ")
    spec += "derive: {width: sqrt(n / 4), height: sqrt(n / 4)}\n"
    one, other = expand(parse_spec(SPEC)), expand(parse_spec(spec))
    assert [one.settings(point) for point in range(6)] == [
        other.settings(point) for point in range(6)
    ]


def test_a_density_of_ones_own_and_the_shape_of_the_preset() -> None:
    columns = expand(parse_spec(changed(N, f"{N}, density: 0.4"))).columns
    area = columns["width"] * columns["height"]
    assert columns["n"] / area == pytest.approx(0.4, rel=1e-12)
    spec = changed(N, N + ", density: 0.01").replace("vicsek1995", "nanobot")
    study = parse_spec(spec.replace("sweep: {noise: [1, 2]}\n", ""))
    columns = expand(study).columns
    preset = study.preset_settings
    shape = float(preset["width"]) / float(preset["height"])
    assert columns["width"] / columns["height"] == pytest.approx(shape, rel=1e-12)


def test_the_box_can_stay() -> None:
    design = expand(parse_spec(changed(N, f"{N}, keep: box")))
    assert [*design.columns] == ["n", "noise"]
    assert design.base["width"] == 5.0
    spec = changed(N, f"{N}, keep: box").replace("fixed: {", "fixed: {width: 7, ")
    assert expand(parse_spec(spec)).base["width"] == 7.0


def test_each_of_several_designs_has_all_sizes() -> None:
    spec = changed("{noise: [1, 2]}", "[{noise: [1, 2]}, {noise: [2, 3]}]")
    design = expand(parse_spec(spec))
    assert design.n_points == 9
    assert design.duplicates == 3


def test_sizes_alone_are_a_study() -> None:
    assert expand(parse_spec(changed("sweep: {noise: [1, 2]}\n", ""))).n_points == 3


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (changed("40, 100, 400", "400, 40"), "ascending, not \\[400, 40\\]"),
        (changed("40, 100, 400", "40"), "two or more numbers of boids"),
        (changed("40, 100, 400", "40, 40"), '40 is listed twice in "n"'),
        (changed("40, 100, 400", "0, 40.5"), '"n" must be an integer from 1'),
        (changed(N, f"{N}, keep: densty"), 'did you mean "density"'),
        (changed(N, f"{N}, kep: box"), 'unknown key "kep"; did you mean "keep"'),
        (changed(N, "keep: box"), 'missing key "n" in "sizes"'),
        (changed(N, f"{N}, density: 0"), '"density" must be a number above 0'),
        (changed(N, f"{N}, keep: box, density: 1"), '"keep: box" keeps width and'),
        (changed("fixed: {", "fixed: {n: 5, "), '"n" already has a value'),
        (changed("fixed: {", "fixed: {width: 5, "), '"width" already has a value'),
        (changed("fixed: {", "fixed: {map: cafeteria, "), 'map "cafeteria" has a'),
        (
            changed("{noise: [1, 2]}", "{map: [empty, cafeteria]}"),
            'map "cafeteria" has a fixed width and height, which',
        ),
        (
            changed("{noise: [1, 2]}", "{sizes: {zip: {noise: [1, 2]}}}"),
            'an axis of "sweep" is also named "sizes"',
        ),
        (
            changed("40, 100, 400", f"40, {10**12}"),
            "1000000000000 is not allowed for n",
        ),
    ],
)
def test_what_is_wrong_is_said(spec: str, message: str) -> None:
    with pytest.raises(SpecError, match=message) as said:
        parse_spec(spec)
    assert str(said.value).startswith("spec.yaml:")


def test_a_search_takes_no_sizes() -> None:
    spec = changed(
        "sweep: {noise: [1, 2]}\n",
        "search: {maximise: polarization, over: {noise: [1]}, among:"
        " {max_speed: {uniform: [0.1, 1]}}, budget: 4}\n",
    )
    with pytest.raises(SpecError, match='a study with "search" takes no "sizes"'):
        parse_spec(spec)
