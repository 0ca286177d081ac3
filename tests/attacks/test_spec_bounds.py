"""What a spec asks for is counted before memory is taken:
one sentence, with its line.
"""

import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from scipy.stats.qmc import LatinHypercube

import sweep.spec.document
import sweep.spec.limits as limits
import sweep.spec.replication as replication
from sweep.design.design import expand
from sweep.errors import SpecError
from sweep.methods.search.strategy import search
from sweep.spec.sampling import UnitCube, generator, latin_hypercube
from sweep.spec.schema import json_schema
from sweep.spec.study import Study, parse_spec
from sweep.workers.executors import Serial
from tests.specs import SHORT, short

MOST_BYTES = 50_000_000
"""What a refusal may take: numpy's arrays are counted too."""


@contextmanager
def counted_memory() -> Iterator[list[int]]:
    """A list to which the most bytes that were held at once are added at the end."""
    peaks: list[int] = []
    tracemalloc.start()
    try:
        yield peaks
        peaks.append(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


def refused(text: str) -> str:
    """What is said of a spec, whose refusal takes little memory."""
    with counted_memory() as peaks, pytest.raises(SpecError) as error:
        expand(parse_spec(text))
    assert peaks[0] < MOST_BYTES
    assert len(str(error.value)) < 1000
    return str(error.value)


SETTINGS = list(parse_spec(SHORT).settings.values())
FLOATS = [one.name for one in SETTINGS if one.kind == "float"]


def sampled(sampler: str, points: int, settings: int) -> str:
    drawn = [f"    {name}: {{uniform: [1, 1]}}" for name in FLOATS[:settings]]
    return short(
        "sweep:", "  j:", f"    sample: {sampler}", f"    points: {points}", *drawn
    )


SPLIT = "are allowed: split the study into several, by seeds or by an axis"
TWO_AXES = "sweep: {drag: {linspace: [0, 1, 4000]}, n: {linspace: [1, 4000, 4000]}}"
SIX = ", ".join(f"{name}: [0, 1]" for name in FLOATS[:6])
ELEVEN_FIELDS = [
    "sweep:",
    "  n: {linspace: [1, 3000, 3000]}",
    "  drag: {linspace: [0, 1, 3000]}",
    *(f"  {name}: [1]" for name in FLOATS[:12] if name not in ("drag", "n")),
]
LISTED = {
    "points of a grid": (
        short("sweep: {drag: {linspace: [0, 1, 1000000000]}}"),
        '6: "linspace" must be an integer from 1 to 10000000',
    ),
    "points of a sample": (
        sampled("random", 10**9, 1),
        '9: "points" must be',
    ),
    "replicates": (
        SHORT.replace("replicates: 2", "replicates: 1000000000"),
        '4: "replicates" must be an integer from 1 to 20000000',
    ),
    "until": (
        SHORT.replace(
            "replicates: 2",
            "replicates: {until: {metric: speed, half_width: 1}, max: 1000000000}",
        ),
        '4: "max" must be an integer from 3 to 20000000',
    ),
    "product": (
        short(TWO_AXES),
        f"6: the study has 16,000,000 points; at most 10,000,000 {SPLIT}",
    ),
    "trials": (
        short("sweep: {n: [1, 2, 3]}").replace("replicates: 2", "replicates: 7000000"),
        f"4: the study has 21,000,000 trials; at most 20,000,000 {SPLIT}",
    ),
    "cells of trials": (
        short(f"sweep: {{j: {{zip: {{{SIX}}}}}}}").replace(
            "replicates: 2", "replicates: 9000000"
        ),
        (
            "4: the study has 18,000,000 trials with 6 parameters that vary,"
            " 108,000,000 cells;"
        ),
    ),
    "cells of points": (
        short(*ELEVEN_FIELDS),
        "6: the study has 9,000,000 points with",
    ),
}
LISTED |= {
    f"cells of {sampler}": (
        sampled(sampler, 10**7, 30),
        "9: 10,000,000 points of 30 parameters make 300,000,000 cells; at most"
        " 100,000,000 " + SPLIT,
    )
    for sampler in ("random", "lhs", "sobol", "halton")
}
LISTED |= {
    f"cells of {sampler}": (
        sampled(sampler, points, 20),
        f"9: {cells} points of 20 parameters make",
    )
    for sampler, points, cells in (
        ("morris", 400_000, "8,400,000"),
        ("saltelli", 200_000, "8,400,000"),
    )
}


@pytest.mark.parametrize("case", LISTED)
def test_too_much_is_refused_before_it_is_held(case: str) -> None:
    text, message = LISTED[case]
    assert refused(text).startswith(f"spec.yaml:{message}")


def test_fields_of_a_zip_are_counted_as_they_come(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(limits, "MOST_CELLS", 100)
    grids = ", ".join(f"{name}: {{linspace: [1, 1, 30]}}" for name in FLOATS[:9])
    message = refused(short("sweep:", f"  j: {{zip: {{{grids}}}}}"))
    assert message.startswith("spec.yaml:7: 30 points of 4 parameters make 120 cells")


def test_axes_are_counted_as_they_come(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each may be large, and only some of them apply anywhere."""
    monkeypatch.setattr("sweep.spec.setting_values.MOST_CELLS", 100)
    axes = [f"  {name}: {{linspace: [0, 1, 40]}}" for name in FLOATS[:9]]
    message = refused(short("sweep:", *axes))
    assert message.startswith("spec.yaml:9: the axes up to this axis have 120 cells")


def test_computations_are_counted_before_they_are_made() -> None:
    least = f"min({', '.join(['drag'] * 20)})"
    lines = [
        "sweep:",
        "  drag: {linspace: [0, 0.001, 2000]}",
        "  n: {linspace: [2, 1001, 1000]}",
        "derive:",
        *(
            f"  {name}: {' + '.join([least] * 6)}"
            for name in FLOATS[:9]
            if name != "drag"
        ),
    ]
    message = refused(short(*lines))
    assert message.startswith("spec.yaml:6: the study has 2,000,000 points and")
    assert " expressions with 1,179 parts per point" in message
    assert "2,358,000,000 operations; at most 2,000,000,000 are" in message


def test_many_seeds_are_compared_once_each() -> None:
    compared = 0

    class Seed(int):
        def __eq__(self, other: object) -> bool:
            nonlocal compared
            compared += 1
            assert compared < 10_000
            return int(self) == other

        __hash__ = int.__hash__

    document = sweep.spec.document.Document(Path("spec.yaml"), "")
    seeds = [Seed(number) for number in range(5000)]
    root = sweep.spec.document.Entry(document, (), {"seeds": seeds})
    assert replication.read_replication(root).seeds == tuple(seeds)


def test_a_latin_hypercube_is_that_of_scipy_in_a_quarter_of_its_memory() -> None:
    names = [str(index) for index in range(20)]
    with counted_memory() as peaks:
        columns = latin_hypercube(UnitCube(20_000, names, "axis", 5))
    known = LatinHypercube(d=20, rng=generator(5, "axis")).random(20_000)
    assert np.array(columns).T.tobytes() == known.tobytes()
    assert peaks[0] < 1.5 * known.nbytes


SEARCHING = """\
study: found
model: nguyen2024
preset: as_run
replicates: 4
seed: 1
search:
  parameters: {drag: {uniform: [0, 1]}}
  objectives: {speed: {maximize: mean}}
  budget: 600
"""


def searching(line: str, budget: int = 600) -> Study:
    return parse_spec(SEARCHING.replace("600", str(budget)) + f"  {line}\n")


@pytest.mark.parametrize(
    ("line", "budget", "message"),
    [
        ("racing: true", 10**9, '9: "budget" must be an integer from 1 to 1000000'),
        (
            "batch: 1000000000",
            600,
            '10: "batch" must be an integer from 1 to 10000',
        ),
        ("held_out: {candidates: 1000000000}", 600, '10: "candidates" must be'),
        (
            "held_out: {candidates: 1000000, replicates: 1000000}",
            600,
            (
                "9: the search may need 1,000,000,000,600 trials, of which"
                " 1,000,000,000,000 on held-out seeds; at most 1,000,000 are allowed:"
                " reduce budget, held_out or the number of scenarios"
            ),
        ),
        (
            "over: {n: {linspace: [1, 10000, 10000]}}",
            500_000,
            "9: the search may need 2,500,000 trials",
        ),
    ],
)
def test_searches_are_bounded(line: str, budget: int, message: str) -> None:
    with counted_memory() as peaks, pytest.raises(SpecError) as error:
        searching(line, budget)
    assert str(error.value).startswith(f"spec.yaml:{message}")
    assert peaks[0] < MOST_BYTES


def test_references_are_bounded() -> None:
    listed = ", ".join(f"r{index}: {{drag: 0.5}}" for index in range(1001))
    with pytest.raises(SpecError, match='10: "references" allows at most 1,000'):
        searching(f"references: {{{listed}}}")


def test_repetitions_are_bounded(tmp_path: Path) -> None:
    study = searching("racing: true")
    with counted_memory() as peaks, pytest.raises(SpecError) as error:
        search(study, tmp_path, Serial(), repetitions=10**9)
    assert "and its 1,000,000,000 repetitions may need 1,280,000,000,800 trials" in str(
        error.value
    )
    assert peaks[0] < MOST_BYTES


def test_the_schema_has_the_same_limits() -> None:
    schema = json_schema()
    fixed, until = schema["properties"]["replicates"]["anyOf"]
    assert (
        fixed["maximum"] == until["properties"]["max"]["maximum"] == limits.MOST_TRIALS
    )
    assert (
        schema["properties"]["search"]["properties"]["budget"]["maximum"]
        == limits.MOST_SEARCHED
    )


LONG = "x" * 100_000
QUOTING = {
    "tag": f"fixed: !{LONG} 1",
    "value": f"fixed: {{n: {LONG}}}",
    "study": f'study: "{LONG}!"',
    "key": f"fixed: {{{LONG[:900]}: 1}}",
    "key that stands twice": (
        f"fixed:\n  ? {LONG[:40_000]}\n  : 1\n  ? {LONG[:40_000]}\n  : 2"
    ),
    "map": f"maps:\n  ? {LONG}\n  : 1",
    "memory": f"memory_limit: {LONG}",
    "file": f"sweep: {{j: {{sample: table, file: {LONG}.csv}}}}",
    "image": f"maps: {{m: {{image: {LONG}, resolution: 1}}}}",
    "ROS map": f"maps: {{m: {{ros: {LONG}}}}}",
    "choice": f"fixed: {{map: {LONG}}}",
    "values": f"sweep: {{map: [empty, {LONG}]}}",
}


@pytest.mark.parametrize("what", QUOTING)
def test_errors_quote_no_more_than_is_read(what: str) -> None:
    text = SHORT.replace("study: short\n", "") if what == "study" else SHORT
    with pytest.raises(SpecError) as error:
        parse_spec(text + QUOTING[what] + "\n")
    assert str(error.value).startswith("spec.yaml:")
    assert len(str(error.value)) < 2100
