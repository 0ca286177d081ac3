"""The JSON Schema of one spec knows what the files beside it bring."""

import json
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

from sweep.own_code.reading import load_spec, schema_for
from sweep.spec.schema import json_schema
from tests.commands import sweep
from tests.other_packages import ENTRIES, VORTEX
from tests.specs import SHORT

MODEL = VORTEX.replace('name="vortex"', 'name="grid"')
"""Its name is one that the schema has for a way to write an axis."""
METRICS = (
    ENTRIES
    + """
METRICS = {"rightwards": METRIC}
MAPS = {"pillar": MAP}
STARTS = {"still": START}
SAMPLERS = {"evenly": SAMPLER}
"""
)
SPEC = """
study: own
model: ./vortex.py
preset: standard
seed: 1
replicates: 2
fixed: {n: 5, map: pillar, start_draws: still}
sweep:
  cohesion_weight: [0.01, 0.02]
  both: {sample: evenly, points: 3, max_speed: {uniform: [2, 4]}}
record: {metrics: [./mine.py, speed], series: [rightwards]}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a spec and the files that it names."""
    (tmp_path / "vortex.py").write_text(MODEL)
    (tmp_path / "mine.py").write_text(METRICS)
    (tmp_path / "spec.yaml").write_text(SPEC)
    return tmp_path


def is_valid(schema: Any, text: str) -> bool:
    return Draft7Validator(schema).is_valid(YAML(typ="safe", pure=True).load(text))


def test_a_spec_that_loads_is_valid(folder: Path) -> None:
    load_spec(folder / "spec.yaml")
    schema = schema_for(folder / "spec.yaml")
    Draft7Validator.check_schema(schema)
    assert is_valid(schema, SPEC)
    about = schema["definitions"]["grid.derived"]["properties"]["cohesion_weight"]
    assert "standard: " in about["description"]


MISTAKES = (
    ("preset: standard", "preset: standrad"),
    ("n: 5,", "nn: 5,"),
    ("n: 5,", "n: 0,"),
    ("map: pillar", "map: pilar"),
    ("start_draws: still", "start_draws: stil"),
    ("cohesion_weight: [", "cohesion_wait: ["),
    ("cohesion_weight: [0.01", "cohesion_weight: [-1"),
    ("sample: evenly", "sample: oddly"),
    ("series: [rightwards]", "series: [rightward]"),
)


def test_mistakes_in_what_the_files_bring_are_invalid(folder: Path) -> None:
    schema = schema_for(folder / "spec.yaml")
    for right, wrong in MISTAKES:
        assert SPEC.count(right) == 1
        assert not is_valid(schema, SPEC.replace(right, wrong)), wrong


def test_names_are_free_where_another_file_may_bring_them(folder: Path) -> None:
    schema = schema_for(folder / "spec.yaml")
    named = SPEC.replace("series: [rightwards]", "series: [leftwards]")
    assert not is_valid(schema, named)
    assert is_valid(schema, named.replace("./mine.py", "./theirs.py"))
    other = named.replace("./vortex.py", "./other.py").replace("pillar", "tower")
    assert is_valid(schema, other)


def test_a_spec_that_is_wrong_elsewhere_has_a_schema(folder: Path) -> None:
    wrong = SPEC.replace("seed: 1", "seeed: 1").replace("standard", "standrad")
    (folder / "spec.yaml").write_text(wrong)
    schema = schema_for(folder / "spec.yaml")
    assert is_valid(schema, SPEC)
    assert not is_valid(schema, wrong)


def test_a_spec_without_files_has_the_schema_of_all(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SHORT)
    assert schema_for(tmp_path / "spec.yaml", code=False) == json_schema()


def test_the_command_prints_it(folder: Path) -> None:
    shown = sweep(folder, "schema", "--spec", "spec.yaml").stdout
    assert json.loads(shown) == schema_for(folder / "spec.yaml")
    refused = sweep(folder, "schema", "--spec", "spec.yaml", "--no-code")
    assert refused.returncode == 2
    assert refused.stderr.startswith('spec.yaml:3: the spec runs code from "./vor')


def test_a_sampler_of_a_file_is_valid_in_any_schema(folder: Path) -> None:
    drawn = SPEC.replace("sample: evenly", "sample: ./mine.py:evenly")
    (folder / "spec.yaml").write_text(drawn)
    load_spec(folder / "spec.yaml")
    assert is_valid(schema_for(folder / "spec.yaml"), drawn)
    usual = drawn.replace("./vortex.py", "nguyen2024").replace("standard", "as_run")
    usual = usual.replace("map: pillar, ", "")
    plain = usual.replace("start_draws: still", "steps: 9").replace("max_s", "start_s")
    assert is_valid(json_schema(), plain)
    assert not is_valid(json_schema(), plain.replace("./mine.py:evenly", "evenly"))
