"""A spec loads exactly, or is refused with one sentence that says what, where and what
is allowed.
"""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from kernels.catalogue import BUILT_IN
from kernels.models import MODELS
from sweep.errors import SpecError
from sweep.own_code.reading import load_spec
from sweep.spec.distributions import MOST
from sweep.spec.settings import settings_of
from sweep.spec.study import RecordSpec, Streams, parse_spec
from tests.specs import EVERYTHING, GAINS, SEPARATION, SHORT, short, short_study

SETTINGS = settings_of("nguyen2024", BUILT_IN)


def test_first_example_loads() -> None:
    study = parse_spec(SEPARATION)
    assert (study.name, study.model, study.preset) == (
        "nguyen2024/separation",
        "nguyen2024",
        "as_run",
    )
    assert study.fixed == {"n": 200, "steps": 500}
    (axis,) = study.axes
    assert axis.columns["separation_weight"].tolist() == [0.5, 0.75, 1.0, 1.5, 2.0]
    assert (study.replicates, study.seeds, study.seed) == (100, None, 2024)
    assert study.record.series == (
        "speed",
        "flock_radius",
        "turn_rate_unwrapped",
        "dispersion",
    )
    assert study.record.metrics == MODELS["nguyen2024"].metrics
    assert study.text == SEPARATION


def test_second_example_loads() -> None:
    study = parse_spec(GAINS)
    assert [len(axis) for axis in study.axes] == [4, 2, 2000]
    gains = study.axes[2].columns
    assert list(gains) == ["cohesion_weight", "alignment_weight", "separation_weight"]
    assert 0 <= gains["alignment_weight"].min() < 0.001
    assert 0.099 < gains["alignment_weight"].max() < 0.1
    assert study.seeds == (27, 729, 4913)
    assert study.streams == Streams("common", "common", "independent")


def test_everything_loads() -> None:
    study = parse_spec(EVERYTHING)
    assert study.fixed == {
        "obstacle_range": float("inf"),
        "update": "sequential",
        "n": 10,
        "minimum_image": False,
    }
    assert study.record == RecordSpec(("coverage", "speed"), ("speed",), 10, True)
    assert study.streams == Streams("independent", "common", "common")
    assert study.time_limit == 60.0
    assert study.axes[2].columns["perception_range"].tolist() == [10.0, 100.0, 1000.0]
    assert sorted(study.axes[5].columns["priority"].tolist()) == [
        "obstacle_first",
        "separation_first",
    ]
    assert study.axes[5].merged == 2


@pytest.mark.parametrize(
    ("line", "seconds"),
    [("", 60.0), ("checkpoint: 0.5", 0.5), ("checkpoint: false", None)],
)
def test_checkpoints_come_every_minute_or_as_the_spec_says(
    line: str, seconds: float | None
) -> None:
    assert parse_spec(short(line)).checkpoint == seconds


def test_file_and_text_and_mapping_are_the_same_study(tmp_path: Path) -> None:
    path = tmp_path / "spec.yaml"
    path.write_text(SEPARATION)
    mapping = {
        "study": "nguyen2024/separation",
        "model": "nguyen2024",
        "preset": "as_run",
        "fixed": {"n": 200, "steps": 500},
        "sweep": {"separation_weight": [0.5, 0.75, 1, 1.5, 2]},
        "replicates": 100,
        "seed": 2024,
    }
    from_file, from_mapping = load_spec(path), parse_spec(mapping)
    assert from_file.text == SEPARATION
    assert from_file.path == path
    assert from_file.fixed == from_mapping.fixed
    assert parse_spec(from_mapping.text).axes[0].columns[
        "separation_weight"
    ].tolist() == [0.5, 0.75, 1, 1.5, 2]


def test_grid_values_are_the_round_ones() -> None:
    study = short_study("sweep: {drag: {linspace: [0, 1, 11]}}")
    assert study.axes[0].columns["drag"].tolist() == [
        0,
        0.1,
        0.2,
        0.3,
        0.4,
        0.5,
        0.6,
        0.7,
        0.8,
        0.9,
        1,
    ]


def test_sobol_points_that_are_no_power_of_two_are_noted() -> None:
    joint = "{{sample: sobol, points: {points}, drag: {{uniform: [0, 1]}}}}"
    assert short_study("sweep: {j: " + joint.format(points=8) + "}").axes[0].notes == ()
    study = short_study("sweep: {j: " + joint.format(points=6) + "}")
    assert study.axes[0].notes == (
        "j: a Sobol sequence is most even for a power of two, not for 6 points",
    )
    assert len(study.axes[0]) == 6


WEIGHTS = {
    "separation_weight": {"uniform": [0, 2]},
    "cohesion_weight": {"loguniform": [0.1, 10]},
}


def sampled(sampler: str, points: int, **more: object) -> dict[str, list[object]]:
    axis = {"sample": sampler, "points": points, **WEIGHTS, **more}
    spec = {
        "study": "a",
        "model": "nguyen2024",
        "preset": "as_run",
        "seed": 5,
        "replicates": 1,
    }
    columns = parse_spec(spec | {"sweep": {"joint": axis}}).axes[0].columns
    return {name: column.tolist() for name, column in columns.items()}


@pytest.mark.parametrize("sampler", ["random", "lhs", "sobol", "halton"])
def test_samples_are_reproducible_and_in_range(sampler: str) -> None:
    first = sampled(sampler, 50)
    assert first == sampled(sampler, 50)
    assert all(0 <= value < 2 for value in first["separation_weight"])
    assert all(0.1 <= value <= 10 for value in first["cohesion_weight"])


@pytest.mark.parametrize("sampler", ["random", "sobol", "halton"])
def test_more_points_keep_the_old_ones(sampler: str) -> None:
    few, many = sampled(sampler, 7), sampled(sampler, 40)
    assert {name: values[:7] for name, values in many.items()} == few


def test_another_random_field_keeps_the_old_values() -> None:
    more = sampled("random", 20, drag={"uniform": [0, 1]})
    assert {name: more[name] for name in WEIGHTS} == sampled("random", 20)


def test_latin_hypercube_has_one_point_in_every_interval() -> None:
    values = np.array(sampled("lhs", 64)["separation_weight"])
    assert sorted(np.floor(values / 2 * 64)) == list(range(64))


def test_the_largest_number_of_a_distribution_is_allowed() -> None:
    wide = {"uniform": [0, MOST]}
    values = sampled("sobol", 4, separation_weight=wide)["separation_weight"]
    assert 0.1 * MOST < max(values) < MOST


def test_distributions_have_their_moments() -> None:
    study = short_study(
        "sweep:",
        "  joint:",
        "    sample: sobol",
        "    points: 4096",
        "    separation_weight: {normal: [50, 2]}",
        "    cohesion_weight: {loguniform: [1, 100]}",
        "    alignment_weight: {normal: [0, 1]}",
        "    n: {integers: [1, 4]}",
        "    map: {choice: [empty, cafeteria]}",
    )
    columns = study.axes[0].columns
    assert columns["separation_weight"].mean() == pytest.approx(50, abs=0.01)
    assert columns["separation_weight"].std() == pytest.approx(2, abs=0.02)
    assert np.median(columns["cohesion_weight"]) == pytest.approx(10, rel=0.01)
    assert columns["alignment_weight"].min() >= 0
    assert columns["alignment_weight"].mean() == pytest.approx(
        (2 / np.pi) ** 0.5, rel=0.01
    )
    assert [np.count_nonzero(columns["n"] == value) for value in (1, 2, 3, 4)] == [
        1024
    ] * 4
    assert np.count_nonzero(columns["map"] == "empty") == 2048


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_tables_are_read_by_column(tmp_path: Path, suffix: str) -> None:
    table = pa.table({"k": [0.5, 1.0, 0.5], "n": [1, 2, 1], "note": ["x", "y", "z"]})
    if suffix == "csv":
        (tmp_path / "gains.csv").write_text("k,n,note\n0.5,1,x\n1,2,y\n0.5,1,z\n")
    else:
        pq.write_table(table, tmp_path / "gains.parquet")
    (tmp_path / "spec.yaml").write_text(
        short(
            "sweep:",
            f"  g: {{sample: table, file: gains.{suffix}, columns: {{separation_weight:"
            " k, n: n}}",
        )
    )
    (axis,) = load_spec(tmp_path / "spec.yaml").axes
    assert {name: column.tolist() for name, column in axis.columns.items()} == {
        "separation_weight": [0.5, 1.0],
        "n": [1, 2],
    }
    assert axis.merged == 1


MISTAKES = [
    (["sweeep: {n: [1]}"], '6: unknown key "sweeep"; did you mean "sweep"?'),
    (["fixed: {n: 2}", "fixed: {n: 3}"], '7: "fixed" appears twice, first in line 6'),
    (["fixed: {n: 1, n: 2}"], '6: "n" appears twice, first in line 6'),
    (
        ["fixed: [1]"],
        '6: "fixed" must be a mapping with at least one entry, not a list',
    ),
    (["fixed: {nn: 1}"], '6: unknown parameter "nn"; did you mean "n"?'),
    (
        ["fixed: " + 300 * "n"],
        f'6: "fixed" must be a mapping with at least one entry, not "{200 * "n"}..."',
    ),
    (
        ["fixed:", "  n: many"],
        "7: 'many' is not allowed for n; allowed: an integer from 1 to 10,000,000",
    ),
    (
        ["fixed: {n: true}"],
        "6: True is not allowed for n; allowed: an integer from 1 to 10,000,000",
    ),
    (
        ["fixed: {n: 1.5}"],
        "6: 1.5 is not allowed for n; allowed: an integer from 1 to 10,000,000",
    ),
    (
        ["fixed: {drag: .nan}"],
        "6: nan is not allowed for drag; allowed: a number from 0 to 1",
    ),
    (["fixed: {drag: 2}"], "6: 2 is not allowed for drag; allowed: a number from 0"),
    (
        ["fixed: {width: 0}"],
        "6: 0 is not allowed for width; allowed: a number above 0 (px)",
    ),
    (
        ["fixed: {minimum_image: 1}"],
        "6: 1 is not allowed for minimum_image; allowed: true or false",
    ),
    (
        ["fixed: {map: cafetria}"],
        '6: unknown map "cafetria"; did you mean "cafeteria"?',
    ),
    (
        ["fixed: {update: no}"],
        '6: unknown update "no". Allowed: sequential, synchronous',
    ),
    (
        ["fixed: {n: 99999999999999999999}"],
        "6: 99999999999999999999 is too large: integers must be below 2^63",
    ),
    (
        ["sweep:", "  n: []"],
        '7: "n" must be a list with at least one value, not an empty list',
    ),
    (
        ["sweep:", "  n: 5"],
        '7: "n" must be a list or a mapping (write a single value under fixed), not 5',
    ),
    (
        ["sweep:", "  drag:", "    - 0.5", "    - 7"],
        "9: 7 is not allowed for drag; allowed: a number from 0 to 1",
    ),
    (["sweep: {drag: [1, 0, 1.0]}"], '6: 1.0 is listed twice in "drag"'),
    (["sweep: {x: [1]}"], '6: unknown parameter "x"'),
    (
        ["sweep: {drag: {linspce: [0, 1, 2]}}"],
        '6: unknown key "linspce"; did you mean "linspace"?',
    ),
    (
        ["sweep: {drag: {when: 'n > 1'}}"],
        '6: "drag" needs one of values, linspace, logspace, uniform,',
    ),
    (
        ["sweep: {drag: {linspace: [0, 1]}}"],
        '6: "linspace" must be [first, last, number of values], not a list',
    ),
    (
        ["sweep: {drag: {linspace: [0, 1, 0]}}"],
        '6: "linspace" must be an integer from 1 to 10000000, not 0',
    ),
    (
        ["sweep: {drag: {linspace: [0, 1, 1e9]}}"],
        '6: "linspace" must be an integer from 1 to 10000000',
    ),
    (
        ["sweep: {drag: {linspace: [-1e308, 1e308, 3]}}"],
        "6: the limits of linspace are too far apart",
    ),
    (["sweep: {drag: {logspace: [0, 1, 3]}}"], "6: logspace needs numbers above 0"),
    (
        ["sweep: {n: {linspace: [1, 2, 3]}}"],
        "6: 1.5 is not allowed for n; allowed: an integer from 1 to 10,000,000",
    ),
    (["sweep: {drag: {uniform: [0, 1]}}"], '6: missing key "points" in "drag"'),
    (
        ["sweep: {drag: {uniform: [1, 0], points: 3}}"],
        "6: uniform: needs the smaller number first, not [1, 0]",
    ),
    (
        ["sweep: {drag: {uniform: [1], points: 3}}"],
        "6: uniform: needs two numbers: [low, high]",
    ),
    (
        ["sweep: {drag: {uniform: [0, x], points: 3}}"],
        "6: uniform: needs two numbers: [low, high]",
    ),
    (
        ["sweep: {cohesion_weight: {uniform: [-1, 0.5], points: 3}}"],
        "6: uniform: -1 is not allowed for cohesion_weight; allowed: a number from 0",
    ),
    (
        ["sweep: {cohesion_weight: {uniform: [0, .inf], points: 3}}"],
        "6: uniform: needs numbers of at most 1e+100",
    ),
    (
        ["sweep: {cohesion_weight: {loguniform: [0, 1], points: 3}}"],
        "6: loguniform: needs numbers above 0",
    ),
    (
        ["sweep: {n: {uniform: [1, 9], points: 3}}"],
        "6: uniform: n is an integer from 1 to 10,000,000: use",
    ),
    (
        ["sweep: {n: {integers: [9, 1], points: 3}}"],
        "6: integers: needs the smaller number first, not [9, 1]",
    ),
    (
        ["sweep: {drag: {integers: [0, 0.5], points: 3}}"],
        "6: integers: needs integers",
    ),
    (
        ["sweep: {drag: {normal: [0.5, 0], points: 3}}"],
        "6: normal: the standard deviation must be above 0",
    ),
    (
        ["sweep: {drag: {normal: [5, 1], points: 3}}"],
        "6: normal: 5 is not allowed for drag",
    ),
    (
        ["sweep: {drag: {choice: [0, 2], points: 3}}"],
        "6: choice: 2 is not allowed for drag",
    ),
    (
        ["sweep: {drag: {choice: [0, 0.0], points: 3}}"],
        "6: choice: lists a value twice",
    ),
    (
        ["sweep: {j: {sample: sobool, points: 3}}"],
        '6: unknown sampler "sobool"; did you mean "sobol"?',
    ),
    (
        ["sweep: {j: {sample: random, drag: {uniform: [0, 1]}}}"],
        '6: missing key "points" in "j"',
    ),
    (["sweep: {j: {sample: random, points: 3}}"], '6: "j" samples no parameter'),
    (
        ["sweep: {j: {sample: random, points: 0, drag: {uniform: [0, 1]}}}"],
        '6: "points" must be an integer',
    ),
    (
        ["sweep: {j: {sample: random, points: 3, drag: {}}}"],
        '6: "drag" must be a mapping with at least one entry',
    ),
    (
        ["sweep: {j: {sample: random, points: 3, drog: {uniform: [0, 1]}}}"],
        '6: unknown key "drog"; did you mean "drag"?',
    ),
    (
        [
            "sweep: {j: {sample: random, points: 3, drag: {uniform: [0, 1], choice:"
            " [0]}}}"
        ],
        '6: "drag" needs one of uniform, choice, not several',
    ),
    (
        ["sweep: {drag: {sample: random, points: 3, drag: {uniform: [0, 1]}}}"],
        '6: "drag" is a parameter: an axis of several',
    ),
    (["sweep: {j: {sample: table}}"], '6: missing key "file" in "j"'),
    (
        ["sweep: {j: {sample: table, file: none.csv}}"],
        '6: there is no file "none.csv" in ',
    ),
    (
        ["sweep: {j: {sample: table, file: t.txt}}"],
        '6: "t.txt" is neither a .csv nor a .parquet file',
    ),
    (
        ["sweep:", "  z:", "    zip: {n: [1, 2], drag: [0]}"],
        "7: zip needs parameters of equal length, but n has 2, drag has 1",
    ),
    (["sweep: {z: {zip: {nn: [1, 2]}}}"], '6: unknown key "nn"; did you mean "n"?'),
    (["fixed: {n: 1}", "sweep: {n: [1]}"], '7: "n" already has a value, under fixed.n'),
    (
        ["sweep: {n: [1], z: {zip: {n: [2]}}}"],
        '6: "n" already has a value, under sweep.n',
    ),
    (
        ["sweep: {n: [1]}", "derive: {n: '1'}"],
        '7: "n" already has a value, under sweep.n',
    ),
    (["derive: {n: stps}"], '6: n: unknown name "stps"; did you mean "steps"?'),
    (["derive: {n: map}"], '6: n needs a number, but "map" is a string'),
    (["derive: {n: 5}"], '6: "n" must be a string, not 5'),
    (["derive: {n: steps, steps: n}"], "6: derive is circular: n, steps"),
    (["derive: {map: \"'empty'\"}"], "6: map cannot be derived"),
    (
        ["require:", "  - n > 1", "  - n"],
        '8: require needs a condition, but "n" is a number',
    ),
    (["require: ['n = 1']"], '6: require: "n = 1" is not an expression'),
    (
        ["require: ['map == 1']"],
        '6: require: comparison with "map" needs a string, but "1" is a number',
    ),
    (
        ["sweep: {n: {values: [1], when: drag > 1}, drag: [0]}"],
        '6: when cannot use "drag" here: "drag" is swept by drag',
    ),
    (
        ["sweep: {n: {values: [1], when: n > 1}}"],
        '6: when cannot use "n" here: "n" is swept by n',
    ),
    (
        ["sweep: {n: {values: [1], when: drag > 1}}", "derive: {drag: '0'}"],
        '6: when cannot use "drag" here: "drag" is derived',
    ),
    (
        ["seeds: [1]"],
        '6: give "replicates" or "seeds", not both',
    ),
    (
        ["streams: {start: shared}"],
        '6: unknown kind of stream "shared". Allowed: common, independent',
    ),
    (["streams: {stat: common}"], '6: unknown key "stat"; did you mean "start"?'),
    (
        ["record:", "  metrics:", "    - polarisation"],
        '8: unknown metric "polarisation"; did you mean "polarization"?',
    ),
    (["record: {series: [speed, speed]}"], '6: "speed" is listed twice in "series"'),
    (["record: {every: 0}"], '6: "every" must be an integer from 1, not 0'),
    (["record: {trajectories: 1}"], '6: "trajectories" must be true or false, not 1'),
    (["record: {heatmaps: yes}"], '6: "heatmaps" must be true or false, not "yes"'),
    (["time_limit: 0"], '6: "time_limit" must be a number of seconds above 0, not 0'),
    (["time_limit: .inf"], '6: "time_limit" must be a finite number, not inf'),
    (["time_limit: true"], '6: "time_limit" must be a number, not true'),
    (
        ["checkpoint: true"],
        '6: "checkpoint" must be a number of seconds above 0, or false, not true',
    ),
    (
        ["checkpoint: 0"],
        '6: "checkpoint" must be a number of seconds above 0, or false, not 0',
    ),
    (
        ["checkpoint: .inf"],
        '6: "checkpoint" must be a number of seconds above 0, or false, not inf',
    ),
    (
        ["checkpoint: off"],
        '6: "checkpoint" must be a number of seconds above 0, or false, not "off"',
    ),
    (["checkpoints: 60"], '6: unknown key "checkpoints"; did you mean "checkpoint"?'),
    (["fixed: &a {n: 1}"], "6: anchors and aliases (& and *) are not allowed"),
    (["fixed: {<<: {n: 1}}"], '6: a key must be a string, not "<<"'),
    (["1: 2"], '6: a key must be a string, not "1"'),
    (
        ["fixed: !!python/object:os.system {n: 1}"],
        "6: tag tag:yaml.org,2002:python/object:os.system is not allowed",
    ),
    (["fixed: {n: !!int x}"], '6: cannot read "x" as int'),
    (["fixed: {n: [1}"], "6: is not valid YAML: "),
    (["fixed: " + "[" * 50 + "]" * 50], "6: is nested too deeply"),
    (["fixed: " + "[" * 1000], "1: is nested too deeply"),
]


@pytest.mark.parametrize(
    ("lines", "message"), MISTAKES, ids=[" ".join(lines)[:60] for lines, _ in MISTAKES]
)
def test_mistake_is_named_with_its_line(lines: list[str], message: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(short(*lines))
    assert str(error.value).startswith(f"spec.yaml:{message}")
    assert "\n" not in str(error.value)


REPLACED = [
    (
        "model: nguyen2024",
        "model: nguyen2025",
        '2: unknown model "nguyen2025"; did you mean "nguyen2024"?',
    ),
    (
        "as_run",
        "as_ran",
        (
            '3: unknown preset of nguyen2024 "as_ran"; did you mean "as_run"? Allowed:'
            " as_written, as_run"
        ),
    ),
    ("study: short\n", "", '1: missing key "study"'),
    ("model: nguyen2024\n", "", '1: missing key "model"'),
    (
        "replicates: 2\n",
        "",
        '1: missing "replicates" (trials per point) or "seeds" (a list of seeds)',
    ),
    (
        "replicates: 2",
        "replicates: 0",
        '4: "replicates" must be an integer from 1 to 20000000, not 0',
    ),
    ("replicates: 2", "seeds: [3, 3]", '4: 3 is listed twice in "seeds"'),
    (
        "replicates: 2",
        "seeds: [3, -1]",
        '4: "seeds" must be an integer from 0, not -1',
    ),
    ("seed: 1", "seed: -1", '5: "seed" must be an integer from 0, not -1'),
    ("seed: 1", "seed: 1.5", '5: "seed" must be an integer from 0, not 1.5'),
    ("seed: 1", "seed: true", '5: "seed" must be an integer from 0, not true'),
    ("study: short", "study: 5", '1: "study" must be a string, not 5'),
    (
        "study: short",
        "study: a/parts",
        '1: study "a/parts" is not allowed: "parts" is reserved for files',
    ),
    ("study: short", "study: ../up", '1: study "../up" is not allowed'),
    ("study: short", "study: a/../b", '1: study "a/../b" is not allowed'),
    ("study: short", "study: /root", '1: study "/root" is not allowed'),
    ("study: short", "study: a//b", '1: study "a//b" is not allowed'),
    ("study: short", "study: a b", '1: study "a b" is not allowed'),
    ("study: short", 'study: "a\\n"', '1: study "a\n" is not allowed'),
    (SHORT, "", "1: is empty"),
    (SHORT, "# nothing\n", "1: is empty"),
    (
        SHORT,
        "- 1\n",
        '1: "spec.yaml" must be a mapping with at least one entry, not a list',
    ),
    (SHORT, "\x00", "1: is not valid YAML: "),
]


@pytest.mark.parametrize(
    ("old", "new", "message"), REPLACED, ids=[new[:40] for _, new, _ in REPLACED]
)
def test_mistake_in_the_head_is_named(old: str, new: str, message: str) -> None:
    with pytest.raises(SpecError) as error:
        parse_spec(SHORT.replace(old, new))
    assert str(error.value).startswith(f"spec.yaml:{message}")
    assert len(error.value.mistakes) == 1


TABLE_MISTAKES = [
    ("n,drag\n1,0\n,1\n", "", '7: "t.csv" has an empty cell: column "n", row 2'),
    (
        "n,drag\n1,0\n2,3\n",
        "",
        (
            '7: "t.csv", column "drag", row 2: 3 is not allowed for drag; allowed: a'
            " number from 0"
        ),
    ),
    (
        "n,drag\n1,0\n2,x\n",
        "",
        '7: "t.csv", column "drag", row 1: \'0\' is not allowed for drag',
    ),
    ("n,drug\n1,0\n", "", '7: unknown parameter "drug"; did you mean "drag"?'),
    (
        "n,drug\n1,0\n",
        ", columns: {drag: drog}",
        '7: unknown column of t.csv "drog"; did you mean "drug"? Allowed: n, drug',
    ),
    (
        "n,drug\n1,0\n",
        ", columns: [n, drag]",
        '7: unknown column of t.csv "drag"; did you mean "drug"? Allowed: n, drug',
    ),
    ("n\n1\n", ", columns: [n, n]", '7: "n" is read from two columns'),
    ("n,drag\n", "", '7: "t.csv" has no rows'),
    ("n,drag\n1\n", "", '7: "t.csv" cannot be read: '),
    ("", "", '7: "t.csv" cannot be read: '),
]


@pytest.mark.parametrize(("content", "columns", "message"), TABLE_MISTAKES)
def test_mistake_in_a_table_is_named(
    tmp_path: Path, content: str, columns: str, message: str
) -> None:
    (tmp_path / "t.csv").write_text(content)
    (tmp_path / "spec.yaml").write_text(
        short("sweep:", f"  j: {{sample: table, file: t.csv{columns}}}")
    )
    with pytest.raises(SpecError) as error:
        load_spec(tmp_path / "spec.yaml")
    assert str(error.value).startswith(f"spec.yaml:{message}")


def test_unreadable_files_are_named(tmp_path: Path) -> None:
    path = tmp_path / "spec.yaml"
    with pytest.raises(SpecError, match=r"spec.yaml: no such file$"):
        load_spec(path)
    with pytest.raises(SpecError, match=r": cannot be read: "):
        load_spec(tmp_path)
    path.write_bytes(b"\xff\xfe\xfa")
    with pytest.raises(SpecError, match=r"spec.yaml: is not UTF-8 text$"):
        load_spec(path)
    path.write_text("#" * 1_000_001)
    with pytest.raises(SpecError, match=r"spec.yaml: is larger than 1,000,000 bytes"):
        load_spec(path)


def test_mapping_with_something_else_is_refused() -> None:
    sentence = r"^spec \(mapping\), study: a spec has only dicts .* not object <"
    with pytest.raises(TypeError, match=sentence):
        parse_spec({"study": object()})
