"""The JSON Schema accepts what loads and refuses what editors should mark."""

import copy
import json
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.own_code.reading import load_spec
from sweep.spec.schema import json_schema
from sweep.spec.settings import Settings, settings_of
from sweep.spec.study import parse_spec
from sweep.spec.study_folder import MOST_NAME, OWN, why_no_name
from tests import ROOT
from tests.cases import slow_but
from tests.specs import EVERYTHING, GAINS, SEPARATION, SHORT, short

EXPERIMENTS = ROOT / "experiments"
VALIDATOR = Draft7Validator(json_schema())
TABLE = "sweep: {g: {sample: table, file: gains.csv, columns: {drag: k}}}"


def content(text: str) -> Any:
    return YAML(typ="safe", pure=True).load(text)


def test_schema_is_valid_and_plain_json() -> None:
    Draft7Validator.check_schema(json_schema())
    assert json.loads(json.dumps(json_schema(), allow_nan=False)) == json_schema()


@pytest.mark.parametrize(
    "text",
    [SEPARATION, GAINS, EVERYTHING, SHORT],
    ids=["separation", "gains", "everything", "short"],
)
def test_what_loads_is_valid(text: str) -> None:
    parse_spec(text)
    VALIDATOR.validate(content(text))


def test_tables_are_valid() -> None:
    VALIDATOR.validate(content(short(TABLE)))


ROOM = "maps: {room: {size: [9, 9], shapes: [{disc: {x: 1, y: 2, radius: 3}}]}}"
LAB = "maps: {lab: {image: lab.png, resolution: 0.05}, floor: {ros: floor.yaml}}"


@pytest.mark.parametrize(
    "lines",
    [
        (ROOM, "fixed: {map: room}"),
        (LAB, "sweep: {map: [lab, empty]}"),
        (LAB, "sweep: {z: {zip: {map: [lab, floor], n: [1, 2]}}}"),
        ("sweep: {detail: {ablate: as_written, when: n > 1}}",),
        ("sweep: {real: {ablate: {a: {drag: 0.5}, b: {dt: 2}}, leave_out: true}}",),
        ("record: {last_states: true}", "streams: {noise: lasting}"),
        ("record: {last_states: true}", "streams: {start: lasting, noise: common}"),
        ("record: {last_states: false}", "streams: {start: independent}"),
        ("record: {trajectories: true}",),
        (
            (
                "sweep: {j: {sample: saltelli, points: 8, second_order: false, drag:"
                " {uniform: [0, 1]}}}"
            ),
        ),
        ("sweep: {j: {sample: morris, points: 8, levels: 6, n: {integers: [3, 6]}}}",),
    ],
    ids=" ".join,
)
def test_maps_ablations_and_trajectories_are_valid(lines: tuple[str, ...]) -> None:
    VALIDATOR.validate(content(short(*lines)))


@pytest.mark.parametrize("model", MODELS)
def test_every_preset_value_is_valid(model: str) -> None:
    for preset in MODELS[model].presets:
        values = MODELS[model].preset_values(preset)
        fixed = {name: values[name] for name in settings_of(model, BUILT_IN)}
        head = content(SHORT) | {"model": model, "preset": preset}
        VALIDATOR.validate(head | {"fixed": fixed})
        VALIDATOR.validate(
            head | {"sweep": {name: [value] for name, value in fixed.items()}}
        )


@pytest.mark.parametrize("key", ["study", "model", "replicates"])
def test_missing_keys_are_invalid(key: str) -> None:
    spec = copy.deepcopy(content(SHORT))
    del spec[key]
    assert not VALIDATOR.is_valid(spec)


@pytest.mark.parametrize(
    "line",
    [
        "sweeep: {n: [1]}",
        "record: {last_states: true}",
        "record: {last_states: true}\nstreams: {noise: independent}",
        "record: {last_states: true}\nstreams: {start: common}",
        "record: {last_states: true}\nstreams: {start: independent, noise: common}",
        "fixed: {nn: 1}",
        "fixed: {perception_range: 1}",
        "fixed: {n: 0}",
        "fixed: {n: 1.5}",
        "fixed: {drag: 2}",
        "fixed: {width: 0}",
        "fixed: {map: cafetria}",
        "fixed: {minimum_image: 1}",
        "fixed: {map: room}",
        "sweep: {map: [room]}",
        "maps: {Room: {image: lab.png, resolution: 1}}",
        "maps: {empty: {image: lab.png, resolution: 1}}",
        "maps: {room: {image: lab.png}}",
        "maps: {room: {image: lab.png, resolution: 0}}",
        "maps: {room: {size: [9], shapes: [{disc: {x: 1, y: 2, radius: 3}}]}}",
        "maps: {room: {size: [9, 9], shapes: [{disc: {x: 1, y: 2}}]}}",
        "maps: {room: {ros: floor.yaml, resolution: 1}}",
        "sweep: {detail: {ablate: as_ritten}}",
        "sweep: {detail: {ablate: as_written, points: 3}}",
        "sweep: {real: {ablate: {}}}",
        "sweep: {real: {ablate: {a: {}}}}",
        "sweep: {real: {ablate: {a: {drag: 7}}}}",
        "sweep: {real: {ablate: {a: {drag: [1]}}}}",
        "sweep: {real: {ablate: as_written, leave_out: 1}}",
        "record: {trajectories: 1}",
        "sweep: {n: []}",
        "sweep: {n: 5}",
        "sweep: {drag: [0, 7]}",
        "sweep: {drag: [0, 0]}",
        "sweep: {drag: {values: [7]}}",
        "sweep: {drag: {linspace: [0, 1]}}",
        "sweep: {drag: {uniform: [0, 1]}}",
        "sweep: {drag: {values: [0], points: 3}}",
        "sweep: {drag: {uniform: [0, 1], normal: [0, 1], points: 3}}",
        "sweep: {x: [1]}",
        "sweep: {j: {sample: random, drag: {uniform: [0, 1]}}}",
        "sweep: {j: {sample: sobool, points: 3, drag: {uniform: [0, 1]}}}",
        "sweep: {j: {sample: lhs, points: 3, drag: {choice: [7]}}}",
        "sweep: {j: {sample: table}}",
        "sweep: {j: {sample: saltelli, points: 1, drag: {uniform: [0, 1]}}}",
        "sweep: {j: {sample: saltelli, points: 8, levels: 4, drag: {uniform: [0, 1]}}}",
        (
            "sweep: {j: {sample: saltelli, points: 8, when: n > 1, drag: {uniform: [0,"
            " 1]}}}"
        ),
        "sweep: {j: {sample: morris, points: 8, levels: 5, drag: {uniform: [0, 1]}}}",
        "sweep: {z: {zip: {nn: [1]}}}",
        "sweep: {z: {zip: {n: []}}}",
        "sweep: {z: {zip: {drag: [7]}}}",
        "sweep: {z: {zip: {drag: {uniform: [0, 1]}}}}",
        "sweep: {n: {zip: {drag: [1]}}}",
        "sweep: {j: {sample: random, points: 3, drag: [0, 1]}}",
        "sweep: {j: {sample: table, file: t.csv, columns: [nn]}}",
        "sweep: {j: {sample: table, file: t.csv, columns: {nn: k}}}",
        "derive: {map: n}",
        "derive: {n: 5}",
        "require: n > 1",
        "seeds: [1]",
        "streams: {start: shared}",
        "record: {metrics: [polarisation]}",
        "record: {every: 0}",
        "time_limit: 0",
        "threads: 2",
        "checkpoint: 0",
        "checkpoint: true",
    ],
)
def test_mistakes_are_invalid(line: str) -> None:
    assert not VALIDATOR.is_valid(content(short(line)))


def test_study_names_cannot_leave_the_results() -> None:
    for name in ("../up", "/root", "a//b", "a/../b"):
        assert not VALIDATOR.is_valid(content(SHORT) | {"study": name})


@pytest.mark.parametrize(
    "name", ["con", "a/CON", "Nul.txt", "lpt9/b", "a.", "a./b", "com", "my/console"]
)
def test_study_names_are_those_of_folders_on_every_system(name: str) -> None:
    """As the reader has it. On Windows a folder has no name of a device, and none that
    ends in a dot.
    """
    allowed = not why_no_name(name)
    assert allowed == (name in ("com", "my/console"))
    assert VALIDATOR.is_valid(content(SHORT) | {"study": name}) == allowed


@pytest.mark.parametrize("name", [*OWN, f"code-{'0a' * 32}.json"])
def test_no_study_has_a_name_that_results_use(name: str) -> None:
    """In small or capital letters, and as any part of a name; the schema, the reader,
    `sweep rename` and `sweep load --as` refuse the same.
    """
    other = name if name.startswith("code-") else name.title()
    for study in (name, f"my/{name}", f"{name}/x", f"my/{other}/x"):
        assert "is reserved for files of results" in why_no_name(study)
        assert not VALIDATOR.is_valid(content(SHORT) | {"study": study})
    for study in (f"{name}s", f"my/a{name}"):
        assert not why_no_name(study)
        assert VALIDATOR.is_valid(content(SHORT) | {"study": study})


@pytest.mark.parametrize("length", [MOST_NAME, MOST_NAME + 1])
def test_names_of_studies_are_as_long_as_the_reader_allows(length: int) -> None:
    study = "x" * length
    allowed = not why_no_name(study)
    assert allowed == (length == MOST_NAME)
    assert VALIDATOR.is_valid(content(SHORT) | {"study": study}) == allowed


def test_fields_are_described_with_unit_and_presets() -> None:
    about = json_schema()["definitions"]["nguyen2024.derived"]["properties"]
    described = "range of the separation rule (Eq. 4) (px)."
    presets = "as_written: 50.0, as_run: 50.0"
    assert about["separation_range"] == {"description": f"{described} {presets}"}


def places(name: str, value: Any) -> list[dict[str, Any]]:
    """Parts of a spec, in each of which a setting stands in another place."""
    asked = {"objectives": {"speed": {"minimize": "mean"}}, "budget": 9}
    search = asked | {"parameters": {"n": {"integers": [1, 9]}}}
    drawn = {"sample": "lhs", "points": 3, name: {"choice": [value]}}
    return [
        {"fixed": {name: value}},
        {"sweep": {name: [value]}},
        {"sweep": {name: {"values": [value]}}},
        {"sweep": {"z": {"zip": {name: [value]}}}},
        {"sweep": {"j": drawn}},
        {"search": asked | {"parameters": {name: {"choice": [value]}}}},
        {"search": search | {"over": {name: [value]}}},
        {"search": search | {"references": {"r": {name: value}}}},
    ]


def settings(model: str) -> Settings:
    """All that a spec of a model may name."""
    return settings_of(model, BUILT_IN).of_study(())


NAMES = sorted({name for model in MODELS for name in settings(model)})


@pytest.mark.parametrize("model", slow_but(["strombom2014"], MODELS))
def test_each_place_takes_the_settings_of_the_model_and_no_others(model: str) -> None:
    head = content(SHORT) | {"model": model}
    preset = MODELS[model].preset_values("as_run")
    for name in NAMES:
        for part in places(name, preset.get(name, 1)):
            assert VALIDATOR.is_valid(head | part) == (name in settings(model)), part


@pytest.mark.parametrize("model", MODELS)
def test_no_place_takes_what_a_setting_cannot_be(model: str) -> None:
    head = content(SHORT) | {"model": model}
    for part in places("n", 0) + places("update", "sequental") + places("dt", "1"):
        assert not VALIDATOR.is_valid(head | part), part


@pytest.mark.parametrize("model", MODELS)
def test_editors_suggest_and_describe_the_settings_of_the_model(model: str) -> None:
    """They take names and texts from `properties`, and follow references."""
    part = json_schema()["definitions"]
    derived = part[f"{model}.derived"]["properties"]
    about = derived | part[f"{model}.about"]["properties"]
    values = part[f"{model}.settings"]["properties"]
    assert set(about) == set(values) == set(settings(model))
    assert set(derived) == set(about) - {"map"}
    assert all(text["description"] for text in about.values())


def schemas(part: Any) -> Iterator[dict[str, Any]]:
    """All mappings in a schema."""
    if isinstance(part, dict):
        yield part
    for inner in part.values() if isinstance(part, dict) else part:
        if isinstance(inner, dict | list):
            yield from schemas(inner)


def test_nothing_stands_beside_a_reference_as_draft_07_ignores_it() -> None:
    referring = [part for part in schemas(json_schema()) if "$ref" in part]
    assert referring
    assert all(len(part) == 1 for part in referring)


def test_what_has_a_name_is_used_and_what_is_used_has_one() -> None:
    named = {f"#/definitions/{name}" for name in json_schema()["definitions"]}
    assert {part["$ref"] for part in schemas(json_schema()) if "$ref" in part} == named


def test_what_is_large_stands_once() -> None:
    """Apart from what two models may have in common.

    These are texts that describe a parameter with the values of the presets, and an
    axis that ablates, which has the names of the presets.
    """
    texts = [
        json.dumps(part, sort_keys=True)
        for part in schemas(json_schema())
        if set(part) != {"description"}
    ]
    twice = {text for text, count in Counter(texts).items() if count > 1}
    assert {text for text in twice if len(text) > 200 and "ablate" not in text} == set()


@pytest.mark.parametrize(
    "path",
    sorted(
        path for path in EXPERIMENTS.glob("*/*.yaml") if path.name != "published.yaml"
    ),
    ids=lambda path: f"{path.parent.name}-{path.stem}",
)
def test_the_specs_of_the_experiments_load_and_are_valid(path: Path) -> None:
    expand(load_spec(path))
    VALIDATOR.validate(content(path.read_text(encoding="utf-8")))
