"""All mistakes of a spec are in one answer, in the order of lines, and none of them is
there because of another one.
"""

from itertools import combinations

import pytest

from sweep.errors import SpecError
from sweep.spec.continued_checks import COMMON, KEPT, LONGER
from sweep.spec.mistakes import MOST_MESSAGES
from sweep.spec.study import parse_spec

SPEC = """
study: many
model: nguyen2024
preset: as_runn
fixed: {n: fifty, drag: -1, map: lab, steps: 20}
maps:
  lab: {size: [100, 100], shapes: [{disc: [10, 10, -1]}, {disk: [50, 50, 2]}]}
sweep:
  seperation_weight: [1, 2]
  cohesion_weight: {linspace: [0, 2]}
  pairs: {zip: {width: [100, far], height: [100, 200]}}
derive: {max_sped: 2 * n}
require: [n < widht, "n +"]
replicates: 0
record: {metrics: [sped, polarization], series: [speed, speed], every: 0}
strems: {}
time_limit: -1
"""
SAID = """
3: unknown preset of nguyen2024 "as_runn"; did you mean "as_run"?
4: 'fifty' is not allowed for n; allowed: an integer from 1 to 10,000,000
4: -1 is not allowed for drag; allowed: a number from 0 to 1
6: "disc" must be a mapping with at least one entry, not a list
6: unknown key "disk"; did you mean "disc"?
8: unknown parameter "seperation_weight"; did you mean "separation_weight"?
9: "linspace" must be [first, last, number of values], not a list of 2
10: 'far' is not allowed for width; allowed: a number above 0 (px)
11: unknown parameter "max_sped"; did you mean "motor_max_speed"?
12: require: unknown name "widht"; did you mean "width"?
12: require: "n +" is not an expression
13: "replicates" must be an integer from 1 to 20000000, not 0
14: "speed" is listed twice in "series"
14: "every" must be an integer from 1, not 0
14: unknown metric "sped"; did you mean "speed"?
15: unknown key "strems"; did you mean "streams"?
16: "time_limit" must be a number of seconds above 0, not -1
"""


def mistakes(spec: str) -> list[str]:
    """The lines of the error of a spec, without the name of its file."""
    with pytest.raises(SpecError) as raised:
        parse_spec(spec.lstrip("\n"))
    said = str(raised.value).splitlines()
    assert len(raised.value.mistakes) >= len(said)
    return [line.removeprefix("spec.yaml:") for line in said]


def test_all_mistakes_are_said_at_once_in_the_order_of_lines() -> None:
    """A map that is wrong is still one that settings may name."""
    said, expected = mistakes(SPEC), SAID.strip().splitlines()
    assert len(said) == len(expected)
    for line, beginning in zip(said, expected, strict=True):
        assert line.startswith(beginning)


def test_what_is_missing_is_said_with_what_is_wrong() -> None:
    wrong, *missing = mistakes("drag: 1\nreplicates: 1\nfixed: {n: 5}\n")
    assert wrong.startswith('1: unknown key "drag"')
    assert missing == ['1: missing key "study"', '1: missing key "model"']
    *_, last = mistakes("study: many\nfixed: {n: 5}\n")
    assert last.startswith('1: missing "replicates" (trials per point) or "seeds"')


def test_a_misspelt_key_is_one_mistake() -> None:
    """And not also a missing key."""
    assert mistakes("studdy: a\nmodell: nguyen2024\nreplicats: 2\n") == [
        f'{line}: unknown key "{key}"; did you mean "{meant}"?'
        for line, key, meant in (
            (1, "studdy", "study"),
            (2, "modell", "model"),
            (3, "replicats", "replicates"),
        )
    ]


def test_a_misspelt_key_hides_no_mistake_of_the_key_that_it_resembles() -> None:
    found = mistakes("study: a\nmodel: nguyen2024\nreplicates: no\nreplicats: 2\n")
    assert [line.split(" ")[0] for line in found] == ["3:", "4:"]


def test_a_search_says_all_that_is_wrong_with_it() -> None:
    assert [
        line.partition(";")[0]
        for line in mistakes("""
study: many
model: nguyen2024
search:
  parameters: {drug: {uniform: [0, 1]}, n: {normal: [3, 4]}}
  objectives: {sped: {maximize: mean}, speed: {maximize: men}}
  constraints: {speed: {at_mots: 3}}
  budget: none
replicates: 3
""")
    ] == [
        '4: unknown parameter "drug"',
        '4: "n" cannot be normal: a search needs bounds',
        '5: unknown metric "sped"',
        '5: unknown statistic "men"',
        '6: unknown key "at_mots"',
        '7: "budget" must be an integer from 1 to 1000000, not "none"',
    ]


def test_keys_that_cannot_stand_together_are_all_said_beside_what_is_missing() -> None:
    assert mistakes("""
study: many
model: nguyen2024
sweep: {separation_weight: {values: [1, 2, 3], continue: up}}
replicates: {until: {metric: speed}, max: 30}
record: {last_states: true, last_flocks: false}
streams: {noise: common}
""") == [
        '4: missing key "half_width" in "until"',
        '4: a study with "continue" needs a fixed number of replicates: each replicate'
        ' is a chain, but "until" adds trials to single points',
        f"5: {LONGER}",
        f"5: {KEPT}",
        f"6: {COMMON}",
    ]
    assert [
        line.partition(":")[0] + line.partition(":")[2].partition("; ")[0][:45]
        for line in mistakes("""
study: many
model: nguyen2024
sizes: {n: [3, 4]}
order: coarse
refine: {metric: speed, at: 3}
validate: {dt: [1/2], updat: both}
search: {budget: 10}
sweep: {separation_weight: {values: [1, 2], continue: up}}
replicates: 9
""")
    ] == [
        '3 a study with "search" takes no "sizes": axes',
        '4 a study with "search" takes no "order": a se',
        '4 a study with "refine" takes no "order"',
        '4 a study with "continue" takes no "order": li',
        '5 missing key "axes" in "refine"',
        '5 missing key "until" in "refine"',
        '5 missing key "budget" in "refine"',
        '5 a study with "continue" takes no "refine": w',
        '5 a study with "validate" takes no "refine"',
        '6 unknown key "updat"',
        '7 missing key "parameters" in "search"',
        '7 missing key "objectives" in "search"',
        '7 a study with "refine" takes no "search"',
        '7 a study with "validate" takes no "search"',
        '8 a study with "search" takes no "sweep": axes',
    ]


def test_a_key_of_earlier_versions_is_refused_with_the_reason() -> None:
    said = mistakes("""
study: many
model: nguyen2024
threads: 2
thread: 2
replicates: 9
""")
    assert said[0] == (
        '3: key "threads" was removed: a trial takes one core now, and a launch uses'
        " all cores. Several cores per trial were 0.36 to 1.6 times as fast. Remove"
        " the line"
    )
    assert said[1].startswith('4: unknown key "thread"')


def test_a_key_of_the_spec_is_no_setting() -> None:
    is_key = "is not a parameter but a key of the whole spec"
    first, second, third = mistakes("""
study: many
model: nguyen2024
fixed: {neighbour_search: all_pairs, order: coarse, neighbour_serch: all_pairs}
sweep: {time_limit: [3, 4]}
replicates: 9
""")[:3]
    assert first.startswith(f'3: "neighbour_search" {is_key}')
    assert second.startswith(f'3: "order" {is_key}')
    assert third.startswith('3: unknown parameter "neighbour_serch"')
    assert mistakes("""
study: many
model: nguyen2024
sweep: {time_limit: [3, 4]}
replicates: 9
""") == [
        f'3: "time_limit" {is_key}, with one value for all points: write the key next'
        ' to "model"'
    ]


def test_of_an_unknown_model_all_is_said_that_is_wrong_with_any_model() -> None:
    """And no more: some have a perception_range, and others a potential."""
    said = mistakes("""
study: many
model: nguyen2042
preset: as_runn
fixed: {n: fifty, perception_range: 3, flok_range: 2}
sweep: {seperation_weight: [0.5, 1], steps: [5, 5]}
replicates: 0
record:
  metrics: [sped, potential, foo]
  derive: {gain: "sped / n"}
checkpoint: 0
""")
    expected = """
2: unknown model "nguyen2042"; did you mean "nguyen2024"?
3: unknown preset of nguyen2024 "as_runn"; did you mean "as_run"?
4: 'fifty' is not allowed for n; allowed: an integer
4: unknown parameter "flok_range"; did you mean "flock_range"?
5: unknown parameter "seperation_weight"; did you mean "separation_weight"?
5: 5 is listed twice in "steps"
6: "replicates" must be an integer
8: unknown metric "sped"; did you mean "speed"?
8: unknown metric "foo"
9: gain: unknown name "sped"; did you mean "speed"?
10: "checkpoint" must be a number of seconds above 0
"""
    assert len(said) == len(expected.strip().splitlines())
    for line, beginning in zip(said, expected.strip().splitlines(), strict=True):
        assert line.startswith(beginning)


def test_without_a_model_the_rest_is_read_too() -> None:
    missing, wrong = mistakes("study: many\nreplicates: 1\nfixed: {nn: 3}\n")
    assert (missing, wrong[:26]) == (
        '1: missing key "model"',
        '3: unknown parameter "nn";',
    )


def test_very_many_mistakes_are_counted() -> None:
    settings = ", ".join(f"a{number}: 1" for number in range(MOST_MESSAGES + 5))
    said = mistakes(
        f"study: many\nmodel: nguyen2024\nreplicates: 1\nfixed: {{{settings}}}"
    )
    assert len(said) == MOST_MESSAGES + 1
    assert said[-1] == "and 5 more mistakes"


def test_a_preset_and_a_seed_need_not_be_said() -> None:
    study = parse_spec({"study": "short", "model": "nguyen2024", "replicates": 1})
    assert (study.preset, study.seed) == ("as_run", 0)


SECTIONS = {
    "refine": (
        """
study: one
model: nguyen2024
fixed: {n: 12, steps: 9}
sweep: {separation_weight: [0, 1, 2]}
replicates: 3
refine:
  metric: speed
  at: 2
  axes: [separation_weight]
  until: 0.02
  max: 12
  budget: 300
  confidence: 0.9
record: {metrics: [speed], every: 9}
""",
        [
            ("metric: speed", "metric: sped"),
            ("at: 2", "at: high"),
            ("axes: [separation_weight]", "axes: [nothing]"),
            ("until: 0.02", "until: 2"),
            ("max: 12", "max: 2"),
            ("budget: 300", "budget: none"),
            ("confidence: 0.9", "confidense: 0.9"),
        ],
    ),
    "search": (
        """
study: one
model: nguyen2024
fixed: {steps: 9}
search:
  parameters: {separation_weight: {uniform: [0, 3]}}
  objectives: {flock_radius: {minimize: mean}}
  constraints: {speed: {at_most: 3}}
  budget: 30
  batch: 4
  racing: {level: 0.05}
  sampler: tpe
  over: {n: [10, 20]}
  held_out: {candidates: 2, replicates: 3}
  references: {usual: {separation_weight: 1}}
replicates: 4
""",
        [
            ("minimize: mean", "minimize: men"),
            ("speed: {at_most", "sped: {at_most"),
            ("budget: 30", "budget: none"),
            ("batch: 4", "batch: 0"),
            ("{level: 0.05}", "{level: 2}"),
            ("sampler: tpe", "sampler: tpee"),
            ("[10, 20]", "[10, many]"),
            ("candidates: 2", "candidates: 0"),
            ("{separation_weight: 1}", "{separation_weight: far}"),
        ],
    ),
    "replicates": (
        """
study: one
model: nguyen2024
fixed: {n: 12, steps: 9}
sweep: {separation_weight: [0, 1, 2]}
replicates:
  until:
    half_width: {speed: 0.1, dispersion: 5%}
    confidence: 0.9
  min: 5
  max: 12
record: {metrics: [speed, dispersion], every: 9}
""",
        [
            ("speed: 0.1", "sped: 0.1"),
            ("dispersion: 5%", "dispersion: -5"),
            ("confidence: 0.9", "confidence: 2"),
            ("min: 5", "min: 1"),
            ("max: 12", "max: many"),
        ],
    ),
    "failures": (
        """
study: one
model: nguyen2024
fixed: {n: 12, steps: 9}
sweep: {separation_weight: [0, 1, 2]}
replicates: 3
on_error: retry
retries: 3
failure_budget: 3
memory_limit: 2 GiB
""",
        [
            ("on_error: retry", "on_error: stop"),
            ("retries: 3", "retries: 0"),
            ("failure_budget: 3", "failure_budget: few"),
            ("memory_limit: 2 GiB", "memory_limit: 2"),
        ],
    ),
    "record": (
        """
study: one
model: nguyen2024
fixed: {n: 12, steps: 9}
sweep: {separation_weight: [0, 1, 2]}
replicates: 3
record:
  metrics: [speed]
  series: [dispersion]
  every: 3
  trajectories: true
  derive: {twice: 2 * speed}
""",
        [
            ("metrics: [speed]", "metrics: [sped]"),
            ("series: [dispersion]", "series: [dispersed]"),
            ("every: 3", "every: 0"),
            ("trajectories: true", "trajectories: often"),
            ("2 * speed", "2 * sped"),
        ],
    ),
    "maps": (
        """
study: one
model: nguyen2024
fixed: {n: 12, steps: 9, map: mine}
maps:
  mine:
    from: cafeteria
    without: [1]
    change: [{number: 5, to: {disc: {x: 100, y: 200, radius: 3}}}]
    add: [{disc: {x: 100, y: 100, radius: 5}}]
sweep: {separation_weight: [0, 1, 2]}
replicates: 3
""",
        [
            ("from: cafeteria", "from: cafetria"),
            ("without: [1]", "without: [all]"),
            ("number: 5", "number: 0"),
            ("radius: 3", "radius: -3"),
            ("radius: 5", "radius: wide"),
        ],
    ),
}
"""Specs of each section with several keys, and mistakes, each alone in its key."""


@pytest.mark.parametrize("section", SECTIONS)
def test_what_is_wrong_in_one_key_hides_nothing_in_another(section: str) -> None:
    """Two mistakes together say what each of them says alone."""
    spec, wrong = SECTIONS[section]
    assert parse_spec(spec).name == "one"
    alone = {}
    for change in wrong:
        assert change[0] in spec
        alone[change] = set(mistakes(spec.replace(*change, 1)))
    for one, other in combinations(wrong, 2):
        both = mistakes(spec.replace(*one, 1).replace(*other, 1))
        assert set(both) == alone[one] | alone[other], (one, other)
