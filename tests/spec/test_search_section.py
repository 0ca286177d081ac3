"""The `search` section: what it means, and what is said
about mistakes, with the line.
"""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft7Validator
from ruamel.yaml import YAML

from sweep.errors import SpecError
from sweep.methods.search.candidates import (
    HELD_OUT,
    RANDOM,
    REPETITION,
    held_out,
    repeated,
    sampler_seed,
)
from sweep.methods.search.objectives import Constraint, Objective, Statistic
from sweep.methods.search.section_keys import HeldOut, Parameter, Search
from sweep.spec.schema import json_schema
from sweep.spec.study import Streams, parse_spec
from tests.searches import TINY, edited

VALIDATOR = Draft7Validator(json_schema())

FULL = """
study: full
model: aziel_chen2025
preset: as_run
fixed: {steps: 10}
search:
  parameters:
    cohesion_weight: {uniform: [0, 0.5]}
    alignment_weight: {loguniform: [0.0001, 0.1]}
    n: {integers: [10, 20]}
    priority: {choice: [obstacle_first, separation_first]}
  objectives:
    coverage_total: {maximize: mean}
    coverage_cv_mean: {minimize: {quantile: 0.9}}
    escapes: {minimize: {cvar: 0.2}}
  constraints:
    collisions: {at_most: 0, statistic: worst}
    speed: {at_least: 1}
  budget: 600
  sampler: nsga3
  batch: 20
  racing: {level: 0.05}
  over: {map: [cafeteria, empty], fov: {linspace: [90, 360, 3]}}
  held_out: {candidates: 3}
  references:
    usual:
      {cohesion_weight: 0.1, alignment_weight: 0.01, n: 12, priority: obstacle_first}
derive: {separation_weight: cohesion_weight}
replicates: 16
seed: 1
record: {metrics: [coverage]}
"""


def search_of(spec: str) -> Search:
    search = parse_spec(spec).sections["search"]
    assert search is not None
    return search


def test_everything_is_read() -> None:
    search = search_of(FULL)
    assert search.parameters == (
        Parameter("cohesion_weight", "uniform", (0.0, 0.5)),
        Parameter("alignment_weight", "loguniform", (0.0001, 0.1)),
        Parameter("n", "integers", (10, 20)),
        Parameter("priority", "choice", ("obstacle_first", "separation_first")),
    )
    assert search.objectives == (
        Objective("coverage_total", True, Statistic("mean")),
        Objective("coverage_cv_mean", False, Statistic("quantile", 0.9)),
        Objective("escapes", False, Statistic("cvar", 0.2)),
    )
    assert search.constraints == (
        Constraint("collisions", 0.0, True, Statistic("worst")),
        Constraint("speed", 1.0, False, Statistic("mean")),
    )
    assert (search.budget, search.sampler, search.batch, search.level) == (
        600,
        "nsga3",
        20,
        0.05,
    )
    assert search.scenarios == 6
    assert search.held_out == HeldOut(3, 40)
    assert search.references == {
        "usual": {
            "cohesion_weight": 0.1,
            "alignment_weight": 0.01,
            "n": 12,
            "priority": "obstacle_first",
        }
    }


def test_what_decides_is_recorded_too() -> None:
    study = parse_spec(FULL)
    assert set(study.record.metrics) == {
        "coverage",
        "coverage_total",
        "coverage_cv",
        "escapes",
        "collisions",
        "speed",
    }


def test_defaults() -> None:
    study = parse_spec(
        edited(
            TINY,
            ("  batch: 4\n", ""),
            ("  held_out: {candidates: 2, replicates: 3}\n", ""),
        )
    )
    search = study.sections["search"]
    assert search is not None
    assert (search.sampler, search.batch, search.level, search.held_out) == (
        "tpe",
        12,
        0.1,
        HeldOut(5, 40),
    )
    assert (search.scenarios, search.constraints, search.over) == (1, (), ())
    assert study.streams == Streams("common", "common", "common")
    chosen = edited(
        TINY,
        (
            "replicates: 4",
            "streams: {noise: independent, world: independent}\nreplicates: 4",
        ),
    )
    assert parse_spec(chosen).streams == Streams("common", "independent", "independent")
    assert (
        search_of(edited(TINY, ("  budget", "  racing: false\n  budget"))).level is None
    )
    assert (
        search_of(edited(TINY, ("  budget", "  racing: true\n  budget"))).level == 0.1
    )
    two = edited(
        TINY,
        (
            "flock_radius: {minimize: mean}",
            "{flock_radius: {minimize: mean}, speed: {maximize: mean}}",
        ),
    )
    assert (
        search_of(two.replace("objectives:\n    {", "objectives: {")).sampler == "nsga2"
    )


PARAMETER = "separation_weight: {uniform: [0, 3]}"
OBJECTIVE = "flock_radius: {minimize: mean}"

MISTAKES = {
    "a key": (
        "  budget:",
        "  budgett: 1\n  budget:",
        'unknown key "budgett"; did you mean "budget"?',
    ),
    "a missing key": ("  budget: 30\n", "", 'missing key "budget" in "search"'),
    "a setting": (
        PARAMETER,
        "separation_wait: {uniform: [0, 3]}",
        'unknown parameter "separation_wait"; did you mean',
    ),
    "a form": (
        PARAMETER,
        "separation_weight: {unifrom: [0, 3]}",
        'unknown key "unifrom"; did you mean "uniform"?',
    ),
    "a normal": (
        PARAMETER,
        "separation_weight: {normal: [0, 3]}",
        '"separation_weight" cannot be normal: a search needs',
    ),
    "two forms": (
        PARAMETER,
        "separation_weight: {uniform: [0, 3], choice: [1]}",
        "needs exactly one of uniform, choice",
    ),
    "a value": (
        PARAMETER,
        "separation_weight: 3",
        '"separation_weight" must be a mapping',
    ),
    "bounds": (
        PARAMETER,
        "separation_weight: {uniform: [3, 0]}",
        "uniform: needs the smaller number first, not [3, 0]",
    ),
    "an infinite bound": (
        PARAMETER,
        "separation_weight: {uniform: [0, .inf]}",
        "uniform: ",
    ),
    "a log of zero": (
        PARAMETER,
        "separation_weight: {loguniform: [0, 3]}",
        "loguniform: needs numbers above 0",
    ),
    "a whole number": (
        PARAMETER,
        "n: {uniform: [0, 3]}",
        "uniform: n is an integer",
    ),
    "a choice twice": (
        PARAMETER,
        "separation_weight: {choice: [1, 1.0]}",
        "choice: lists a value twice",
    ),
    "no parameter": (
        (
            "  parameters:\n    separation_weight: {uniform: [0, 3]}\n   "
            " cohesion_weight: {loguniform: [0.01, 1]}\n"
        ),
        "  parameters: {}\n",
        '"parameters" must be a mapping with at least one entry, not an empty mapping',
    ),
    "fixed as well": (
        "{n: 12,",
        "{n: 12, cohesion_weight: 1,",
        '"cohesion_weight" already has a value, under fixed.cohesion_weight',
    ),
    "derived as well": (
        "replicates: 4",
        "derive: {cohesion_weight: drag}\nreplicates: 4",
        '"cohesion_weight" already has a value, under derive.cohesion_weight',
    ),
    "over as well": (
        "  budget",
        "  over: {cohesion_weight: [1, 2]}\n  budget",
        '"cohesion_weight" already has a value, under search.over.cohesion_weight',
    ),
    "over a fixed one": (
        "  budget",
        "  over: {n: [1, 2]}\n  budget",
        '"n" already has a value, under fixed.n',
    ),
    "over with when": (
        "  budget",
        "  over: {drag: {values: [0], when: n > 1}}\n  budget",
        "over takes no when",
    ),
    "over an analysis": (
        "  budget",
        "  over: {x: {sample: morris, points: 3, drag: {uniform: [0, 1]}}}\n  budget",
        "over takes no morris sample",
    ),
    "a metric": (
        OBJECTIVE,
        "flock_radios: {minimize: mean}",
        'unknown metric "flock_radios"; did you mean "flock_radius"?',
    ),
    "a mean": (
        OBJECTIVE,
        "flock_radios_mean: {minimize: mean}",
        'did you mean "flock_radius_mean"?',
    ),
    "a potential": (
        OBJECTIVE,
        "potential: {minimize: mean}",
        'metric "potential" needs a model with a pair potential',
    ),
    "a direction": (
        OBJECTIVE,
        "flock_radius: {minimise: mean}",
        'unknown key "minimise"; did you mean "minimize"?',
    ),
    "both directions": (
        OBJECTIVE,
        "flock_radius: {minimize: mean, maximize: mean}",
        "needs minimize or maximize, not both",
    ),
    "a statistic": (
        OBJECTIVE,
        "flock_radius: {minimize: men}",
        'unknown statistic "men"; did you mean "mean"?',
    ),
    "no share": (
        OBJECTIVE,
        "flock_radius: {minimize: cvar}",
        "cvar needs a fraction, such as {cvar: 0.1}",
    ),
    "a share": (
        OBJECTIVE,
        "flock_radius: {minimize: {cvar: 1}}",
        '"cvar" must be a number above 0 and below 1, not 1',
    ),
    "no objective": (
        f"    {OBJECTIVE}\n",
        "    {}\n",
        '"objectives" must be a mapping with at least one entry',
    ),
    "no bound": (
        "  budget",
        "  constraints: {speed: {statistic: worst}}\n  budget",
        '"speed" needs at_most or at_least',
    ),
    "both bounds": (
        "  budget",
        "  constraints: {speed: {at_most: 1, at_least: 1}}\n  budget",
        "at_least, not both",
    ),
    "a small budget": (
        "budget: 30",
        "budget: 3",
        "a budget of 3 trials is less than one batch of 4 candidates: at least 4",
    ),
    "a small budget over": (
        "budget: 30",
        "budget: 30\n  over: {drag: {linspace: [0, 1, 8]}}",
        "is less than one batch of 4 candidates in 8 scenarios each: at least 32",
    ),
    "a sampler": (
        "  batch",
        "  sampler: tpee\n  batch",
        'unknown sampler "tpee"; did you mean "tpe"?',
    ),
    "a batch": ("batch: 4", "batch: 0", '"batch" must be an integer from 1'),
    "racing": (
        "  batch",
        "  racing: yes please\n  batch",
        '"racing" must be true, false or {level: a number}',
    ),
    "a level": (
        "  batch",
        "  racing: {level: 0.5}\n  batch",
        '"level" must be a number above 0 and below 0.5',
    ),
    "held_out": (
        "replicates: 3}",
        "replicats: 3}",
        'unknown key "replicats"; did you mean "replicates"?',
    ),
    "a reference": (
        "{usual: {separation_weight: 1,",
        "{usual: {separation_wait: 1,",
        'unknown parameter "separation_wait"; did',
    ),
    "half a reference": (
        "{separation_weight: 1, cohes",
        "{cohes",
        'missing key "separation_weight" in "usual"',
    ),
    "a reference's value": (
        "{separation_weight: 1, cohes",
        "{separation_weight: a, cohes",
        "'a' is not allowed for",
    ),
    "a sweep": (
        "search:",
        "sweep: {drag: [0, 1]}\nsearch:",
        'a study with "search" takes no "sweep": axes of the',
    ),
    "a rule": (
        "replicates: 4",
        "replicates: {until: {metric: flock_radius, half_width: 1}, max: 20}",
        "a search races candidates",
    ),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_mistakes_are_said_with_their_line(mistake: str) -> None:
    old, new, message = MISTAKES[mistake]
    spec = edited(TINY, (old, new))
    with pytest.raises(SpecError) as raised:
        parse_spec(spec)
    assert message in str(raised.value)
    line = int(str(raised.value).split(":")[1])
    assert 5 <= line <= 18
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("sampler", "changes", "message"),
    [
        (
            "cmaes",
            [(PARAMETER, "separation_weight: {choice: [1, 2]}")],
            "needs numerical parameters, without choice: use tpe",
        ),
        (
            "cmaes",
            [(PARAMETER, "separation_weight: {uniform: [1, 1]}")],
            "needs two parameters or more",
        ),
        (
            "cmaes",
            [("  batch", "  constraints: {speed: {at_most: 1}}\n  batch")],
            "supports no constraints",
        ),
        (
            "cmaes",
            [(OBJECTIVE, f"{OBJECTIVE}\n    speed: {{maximize: mean}}")],
            "allows a single objective",
        ),
        ("nsga3", [], "is for several objectives"),
        (
            "nsga2",
            [("batch: 4", "batch: 1")],
            r"needs a batch \(the population\) of 2 or more",
        ),
    ],
)
def test_what_a_sampler_cannot_do_is_said(
    sampler: str, changes: list[tuple[str, str]], message: str
) -> None:
    spec = edited(TINY, ("  budget", f"  sampler: {sampler}\n  budget"), *changes)
    with pytest.raises(SpecError, match=message) as raised:
        parse_spec(spec)
    assert f"sampler {sampler}" in str(raised.value)


def test_gp_needs_torch(monkeypatch: pytest.MonkeyPatch) -> None:
    spec = edited(TINY, ("  budget", "  sampler: gp\n  budget"))
    monkeypatch.setattr(
        "sweep.methods.search.known_samplers.find_spec", lambda _name: None
    )
    with pytest.raises(
        SpecError, match=r'^spec\.yaml:12: sampler gp needs torch: pip .*sweep\[gp\]"$'
    ):
        parse_spec(spec)
    monkeypatch.setattr(
        "sweep.methods.search.known_samplers.find_spec", lambda _name: object()
    )
    assert search_of(spec).sampler == "gp"


def content(spec: str) -> Any:
    return YAML(typ="safe", pure=True).load(spec)


@pytest.mark.parametrize("spec", [FULL, TINY], ids=["full", "tiny"])
def test_the_schema_takes_what_loads(spec: str) -> None:
    VALIDATOR.validate(content(spec))


UNSEEN = {
    "fixed as well",
    "derived as well",
    "over as well",
    "over a fixed one",
    "a choice twice",
    "bounds",
    "a log of zero",
}
UNSEEN |= {
    "a whole number",
    "an infinite bound",
    "a potential",
    "over with when",
    "over an analysis",
    "half a reference",
}
UNSEEN |= {"a small budget", "a small budget over", "a rule"}
"""Mistakes that a schema, which sees one value at a time, cannot say."""


@pytest.mark.parametrize("mistake", sorted(MISTAKES.keys() - UNSEEN))
def test_the_schema_refuses_mistakes_of_shape(mistake: str) -> None:
    old, new, _ = MISTAKES[mistake]
    assert not VALIDATOR.is_valid(content(edited(TINY, (old, new))))


@given(seed=st.integers(0, 2**63 - 1), number=st.integers(0, 1000))
def test_no_run_shares_its_seeds_with_another_or_with_the_held_out_ones(
    seed: int, number: int
) -> None:
    study = parse_spec(TINY.replace("seed: 5", f"seed: {seed}"))
    others = [
        repeated(study, kind, number + step)
        for kind in (REPETITION, RANDOM)
        for step in (0, 1)
    ]
    seeds = [one.seed for one in (study, held_out(study), *others)]
    assert len(set(seeds)) == len(seeds)
    assert len({sampler_seed(one) for one in (study, *others)}) == len(others) + 1
    assert held_out(study).replicates == 3


def test_a_listed_seed_is_never_a_held_out_one() -> None:
    study = parse_spec(edited(TINY, ("replicates: 4", "seeds: [1, 2]")))
    first = held_out(study).seed
    listed = parse_spec(edited(TINY, ("replicates: 4", f"seeds: [1, {first}]")))
    assert held_out(listed).seed not in {1, 5, first}
    assert held_out(listed).seeds is None
    assert HELD_OUT not in (REPETITION, RANDOM)
