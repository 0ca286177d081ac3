"""Metrics that a spec derives: what is read, what is refused and in which line, and
which trials are other ones.
"""

import pytest
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.errors import SpecError
from sweep.methods.search.asked_trials import COLUMNS
from sweep.spec.derived_metrics import TAKEN
from sweep.spec.limits import MOST_DERIVED
from sweep.spec.recorded import lacks
from sweep.spec.schema import json_schema
from sweep.spec.study import RecordSpec, parse_spec
from sweep.store.rows import ABOUT_TRIAL, heatmaps_schema, trajectories_schema
from tests.searches import TINY
from tests.specs import short, short_study

GAIN = 'record: {metrics: [speed], derive: {gain: "polarization / speed"}}'
VALIDATOR = Draft7Validator(json_schema())


def record(lines: str) -> RecordSpec:
    return short_study("record:", *(f"  {line}" for line in lines.splitlines())).record


def trial(line: str) -> str:
    study = short_study(line)
    return Jobs(study, expand(study))[0].trial_id


def is_valid(spec: str) -> bool:
    return VALIDATOR.is_valid(YAML(typ="safe", pure=True).load(spec))


def test_a_derived_metric_is_recorded_with_all_that_it_needs() -> None:
    read = record('metrics: [dispersion]\nderive: {gain: "polarization / speed"}')
    assert read.metrics == ("dispersion", "polarization", "speed")
    assert read.names == ("dispersion", "polarization", "speed", "gain")
    (gain,) = read.derive
    assert (gain.name, gain.unit) == ("gain", "step/px")


def test_each_stands_after_those_that_it_needs() -> None:
    read = record(
        'derive: {loss: "1 - gain * speed", gain: "1 / speed"}\nmetrics: [speed]'
    )
    assert [one.name for one in read.derive] == ["gain", "loss"]
    assert [one.unit for one in read.derive] == ["step/px", ""]
    assert read.metrics == ("speed",)


def test_settings_and_the_words_of_the_model_are_known() -> None:
    study = parse_spec(
        short(GAIN)
        .replace("nguyen2024", "rustamani2024")
        .replace(
            '"polarization / speed"', '"speed / max_speed + goal_distance / width"'
        )
    )
    assert [one.unit for one in study.record.derive] == [""]
    study = parse_spec(short(GAIN).replace("nguyen2024", "rustamani2024"))
    assert [one.unit for one in study.record.derive] == ["s/m"]


def test_sums_of_counts_are_counts_and_others_are_skewed() -> None:
    read = record(
        'derive: {all: "hits + escapes", hits: "collisions + boid_collisions",'
        ' rate: "hits / 2", gain: "escapes + steps"}'
    )
    found = {one.name: one.distribution for one in read.derive}
    wanted = {"all": "count", "hits": "count", "rate": "skewed", "gain": "skewed"}
    assert found == wanted


def test_an_expression_may_stand_on_several_lines() -> None:
    (gain,) = record("derive:\n  gain: >\n    polarization\n    / speed\n").derive
    assert gain.expression.text == "polarization / speed"


def test_metrics_and_series_may_name_it_and_it_stands_once() -> None:
    lines = 'metrics: [gain]\nseries: [gain, speed]\nderive: {gain: "1 / speed"}'
    read = record(lines)
    assert (read.metrics, read.series) == (("speed",), ("gain", "speed"))
    assert read.names == ("speed", "gain")


MISTAKES = {
    "gain: polarisation / speed": 'gain: unknown name "polarisation"; did you mean'
    ' "polarization"?',
    "gain: speed +": 'gain: "speed +" is not an expression',
    "gain: speed > 1": 'gain needs a number, but "speed > 1" is a condition',
    "gain: speed + flock_radius": 'gain: "speed + flock_radius" needs equal units',
    "gain: __import__('os').system('ls')": "is not allowed in an expression",
    "gain: 3": '"gain" must be a string, not 3',
    "gain: '3'": 'gain: "3" contains no metric',
    "gain: width / height": 'gain: "width / height" contains no metric',
    "gain: potential": 'metric "potential" needs a model with a pair potential',
    "gain: gain + speed": "derive is circular: gain",
    "speed: 2 * dispersion": '"speed" is not allowed: a metric already has this name',
    "n: 2 * speed": '"n" is not allowed: a parameter already has this name',
    "status: 2 * speed": "a column of the tables already has this name",
    "pi: 2 * speed": "a word of expressions already has this name",
    "sqrt: 2 * speed": "a word of expressions already has this name",
    "if: 2 * speed": "a word of expressions already has this name",
    "Gain: 2 * speed": '"Gain" is not allowed: a name has lower-case letters',
    "gain-2: 2 * speed": '"gain-2" is not allowed: a name has lower-case letters',
    "gain_mean: 2 * speed": "does not end in _mean, _low, _high, _n",
    "gain: [speed]": '"gain" must be a string, not a list',
}


@pytest.mark.parametrize("line", MISTAKES)
def test_mistakes_are_said_with_their_line(line: str) -> None:
    with pytest.raises(SpecError) as error:
        record(f"metrics: [speed]\nderive:\n  {line}")
    assert str(error.value).startswith("spec.yaml:9: ")
    assert MISTAKES[line] in str(error.value)


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (
            "derive:\n  gain: loss * speed\n  loss: gain / speed",
            "spec.yaml:8: derive is circular: gain, loss",
        ),
        (
            "derive:\n  gain: 2 * speed\n  gain: speed",
            'spec.yaml:9: "gain" appears twice, first in line 8',
        ),
        ("derive: speed", 'spec.yaml:7: "derive" must be a mapping'),
        ("derive: {}", 'spec.yaml:7: "derive" must be a mapping with at least one'),
        (
            "metrics: [gian]\nderive: {gain: 2 * speed}",
            'spec.yaml:7: unknown metric "gian"; did you mean "gain"?',
        ),
        (
            "series: [gain_mean]\nderive: {gain: 2 * speed}",
            'spec.yaml:7: unknown metric "gain_mean"; did you mean "gain"?',
        ),
    ],
)
def test_mistakes_of_several_keys_are_said_too(lines: str, said: str) -> None:
    with pytest.raises(SpecError) as error:
        record(lines)
    assert str(error.value).startswith(said)


def test_so_many_and_no_more() -> None:
    def derive(count: int) -> str:
        return "derive:\n" + "\n".join(f"  d{i}: {i} * speed" for i in range(count))

    assert len(record(derive(MOST_DERIVED)).derive) == MOST_DERIVED
    with pytest.raises(SpecError, match="101 derived metrics; at most 100"):
        record(derive(MOST_DERIVED + 1))


def test_no_column_of_a_table_can_be_taken() -> None:
    schemas = (
        heatmaps_schema({}),
        trajectories_schema(MODELS["nguyen2024"], {}),
        COLUMNS,
    )
    names = {name for name, *_ in ABOUT_TRIAL}
    assert names.union(*(schema.names for schema in schemas)) <= set(TAKEN)


def test_a_search_may_ask_for_it() -> None:
    derived = TINY.replace("flock_radius: {minimize", "gain_mean: {maximize").replace(
        "every: 9}", 'every: 9, derive: {gain: "1 / speed"}}'
    )
    study = parse_spec(derived)
    assert study.sections["search"].columns == ("gain_mean",)
    assert study.record.names == ("flock_radius", "speed", "gain")
    assert is_valid(derived)
    with pytest.raises(
        SpecError, match='unknown metric "gian_mean"; did you mean "gai'
    ):
        parse_spec(derived.replace("gain_mean", "gian_mean"))


def test_a_rule_may_ask_for_it() -> None:
    rule = "{until: {metric: gain, half_width: 0.1}, max: 20}"
    spec = short(GAIN).replace("replicates: 2", f"replicates: {rule}")
    assert list(parse_spec(spec).rule.widths) == ["gain"]
    assert is_valid(spec)


def test_the_schema_takes_what_loads_and_refuses_mistakes_of_shape() -> None:
    assert is_valid(short(GAIN))
    assert is_valid(short(GAIN.replace("[speed]", "[gain]")))
    for wrong in (
        GAIN.replace('"polarization / speed"', "3"),
        GAIN.replace("gain:", "Gain:"),
        GAIN.replace("gain:", "speed:"),
        "record: {derive: {}}",
        "record: {metrics: [gain]}",
        "record: {series: [gain]}",
    ):
        assert not is_valid(short(wrong)), wrong
    assert is_valid(TINY)
    assert not is_valid(TINY.replace("flock_radius: {", "flock_radios: {"))


def test_a_trial_with_another_expression_is_another_trial() -> None:
    same = trial(GAIN)
    assert trial(GAIN) == same
    assert trial(GAIN.replace("[speed]", "[speed, polarization]")) == same
    others = [
        trial(GAIN.replace("polarization / speed", "polarization / speed ** 1")),
        trial(GAIN.replace("gain", "profit")),
        trial(GAIN.replace("{gain", '{loss: "1 / speed", gain')),
        trial("record: {metrics: [speed, polarization]}"),
    ]
    assert len({same, *others}) == 5


def test_every_metric_can_be_derived_from() -> None:
    for name, metric in METRICS.items():
        model = next(one for one, about in MODELS.items() if not lacks(about, metric))
        spec = short(f"record: {{derive: {{twice: 2 * {name}}}}}")
        study = parse_spec(spec.replace("nguyen2024", model))
        assert name in study.record.metrics
