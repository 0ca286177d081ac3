"""Kernels for eight flights at once: what is written for lanes, and what is not."""

import json
import math
import platform
from collections.abc import Callable
from functools import cache
from typing import Any

import llvmlite.binding
import pytest
from numba import types
from numba.core.errors import TypingError
from numpy.random import Generator

from kernels.jit import jit
from kernels.lanes import conversion, together
from kernels.lanes.conversion import SUBSTITUTES
from kernels.lanes.facts import NotForLanesError
from kernels.lanes.rows import ROWS, Each
from kernels.lanes.stubs import LANE_BY_LANE
from kernels.lanes.together import Formation
from kernels.lanes.vectors import FOUND, LANES, WHOLE, WIDTH
from kernels.models import MODELS
from kernels.near import Near
from kernels.neighbours import search
from kernels.state import Floats
from sweep.trial.simulation import Simulation
from tests.builders import job
from tests.commands import python

COMPILE = """
import json, time
from numba.core.caching import NullCache
from kernels.lanes import stubs
from kernels.lanes.kernel import kernel_of
from kernels.models import MODELS
from sweep.trial.lanes import fly
from sweep.trial.simulation import Simulation
from tests.trial.test_lanes import eight

kernels = [kernel_of(MODELS["{model}"], alike) for alike in (True, False)]
for kernel in kernels:
    kernel._cache = NullCache()
fly([Simulation(job) for job in eight("{model}", n=5, steps=2)], time.perf_counter())
[kernel] = [one for one in kernels if one.signatures]
[code], [machine] = kernel.inspect_llvm().values(), kernel.inspect_asm().values()
roots = [line.split() for line in machine.splitlines() if "sqrtpd" in line]
print(json.dumps([sorted(stubs.LANE_BY_LANE), "@llvm.sqrt.v8f64" in code, roots]))
"""
"""What is loaded from the disk has no assembly, and tells of no function."""
EXPECTED = {
    "aziel_chen2025": ["repulsion_inverse"],
    "nanobot": [],
    "nguyen2024": ["repulsion_unit", "uniform"],
    "patel2023": ["repulsion_linear"],
    "rustamani2024": ["steer_to_avoid"],
    "vicsek1995": ["uniform"],
    "dorsogna2006": [],
    "couzin2002": ["floor", "random"],
    "cucker_smale2007": [],
}
"""Each lane has other obstacles near it, and other random numbers."""


def test_all_models_fly_together_but_those_with_a_state() -> None:
    assert EXPECTED.keys() == {name for name, one in MODELS.items() if not one.state}


@cache
def compiled(model: str) -> tuple[list[str], bool, list[list[str]]]:
    """Of a kernel that is compiled anew in a process of its own: the functions that are
    called lane by lane, whether it has roots of eight numbers, and the instructions of
    the processor with roots of several.
    """
    names, has_roots, roots = json.loads(python(COMPILE.replace("{model}", model)))
    return names, has_roots, roots


def roots_are_wide(has_roots: bool, roots: list[list[str]]) -> bool:
    """Whether compiled code `has_roots` of eight numbers, and its instructions with
    `roots` take several at once: registers ymm and zmm hold four and eight of them.
    """
    if platform.machine() not in ("x86_64", "AMD64") or not (
        llvmlite.binding.get_host_cpu_features().get("avx")
    ):
        return has_roots
    wide = [one for one in roots if "%ymm" in one[1] or "%zmm" in one[1]]
    are_all = [one[0] for one in wide] == ["vsqrtpd"] * len(roots)
    return has_roots and bool(wide) and are_all


@pytest.mark.slow
def test_a_kernel_takes_roots_of_several_numbers_at_once() -> None:
    _, has_roots, roots = compiled("aziel_chen2025")
    assert roots_are_wide(has_roots, roots)


@pytest.mark.slow
def test_what_is_called_lane_by_lane_is_known() -> None:
    names, _, _ = compiled("aziel_chen2025")
    assert names == EXPECTED["aziel_chen2025"]


@pytest.mark.slow
@pytest.mark.parametrize("model", sorted(EXPECTED))
def test_what_is_called_lane_by_lane_is_known_of_all_models(model: str) -> None:
    """More of them would cost much of the speed, and nothing else would tell."""
    names, _, _ = compiled(model)
    assert names == EXPECTED[model]


@jit
def _halved(x: float) -> float:
    while x > 1.0:
        x = x / 2.0
    return x


@jit
def _first_above(x: float, most: int) -> float:
    for k in range(most):
        if k > x:
            break
        x = x + 1.0
    return x


@jit
def _at(values: Floats, at: int) -> float:
    return float(values[at])


@jit
def _put(values: Floats, at: int, x: float) -> float:
    values[at] = x
    return x


@jit
def _put_some(values: Floats, at: int, x: float) -> float:
    if x > 0.0:
        _put(values, at, x)
    return x


@jit
def _kept(values: Floats, x: float) -> float:
    values[0] = x
    return x


@jit
def _half_known(x: float) -> float:
    if x > 0.0:
        y = math.sqrt(x)
    return y


@jit
def _drawn_if(x: float, rng: Generator) -> float:
    if x > 0.0:
        x = x + rng.uniform(0.0, 1.0)
    return x


@jit
def _places(near: Near, found: int) -> float:
    total = 0.0
    for k in range(found):
        total = total + near.dx[k] * k
    return total


@jit
def _chosen(x: float, y: float) -> float:
    if x > 0.0:
        y = y + 1.0
    elif x < -1.0:
        return 0.0
    return y if 0.0 < x < 2.0 else max(x, y, 0.0)


ARRAY = types.Array(types.float64, 1, "C")
ROW = ROWS[types.float64]
NEAR = types.NamedTuple([ARRAY, ROW, ROW, ROW, ROW, ARRAY, WHOLE, types.none], Near)
RANDOM = types.NamedUniTuple(types.npy_rng, WIDTH, Each)
REFUSED: list[tuple[Callable[..., Any], dict[str, Any], str]] = [
    (_halved, {"x": LANES}, "it has a statement `while`"),
    (_first_above, {"x": LANES, "most": types.int64}, "it has a statement `break`"),
    (_at, {"values": ARRAY, "at": WHOLE}, "each lane reads at another index"),
    (
        _drawn_if,
        {"x": LANES, "rng": RANDOM},
        "it draws or writes where only some lanes would do so",
    ),
    (
        _places,
        {"near": NEAR, "found": FOUND},
        "each lane lists other neighbours at a place",
    ),
    (_half_known, {"x": LANES}, "y has a value in some lanes only"),
]
WRITING: list[tuple[Callable[..., Any], dict[str, Any], str]] = [
    (
        _put,
        {"values": ROW, "at": WHOLE, "x": LANES},
        "each lane writes at another index",
    ),
    (
        _put_some,
        {"values": ROW, "at": types.int64, "x": LANES},
        "it calls for effect in some lanes only",
    ),
    (_kept, {"values": ARRAY, "x": LANES}, "it writes into an array of all lanes"),
]
"""Lane after lane would read what another one wrote."""


@pytest.mark.parametrize(
    ("function", "given", "why"), REFUSED, ids=lambda one: getattr(one, "__name__", "")
)
def test_what_says_nothing_of_several_lanes_is_called_lane_by_lane(
    function: Callable[..., Any], given: dict[str, Any], why: str
) -> None:
    LANE_BY_LANE.pop(function.__name__, None)
    assert conversion._for_types(function, given).__name__ == "each"
    assert LANE_BY_LANE.pop(function.__name__) == why


@pytest.mark.parametrize(
    ("function", "given", "why"), WRITING, ids=lambda one: getattr(one, "__name__", "")
)
def test_what_cannot_be_written_and_writes_is_refused(
    function: Callable[..., Any], given: dict[str, Any], why: str
) -> None:
    with pytest.raises(NotForLanesError, match=why):
        conversion._for_types(function, given)


def test_a_test_that_differs_becomes_a_choice() -> None:
    """And is computed with numbers as with vectors: the text means the same."""
    given = {"x": LANES, "y": LANES}
    made = conversion._for_types(_chosen, given)
    assert made.__name__ == "_chosen"
    assert "_chosen" not in LANE_BY_LANE
    for x in (-2.0, -0.5, 0.0, 1.0, 3.0):
        assert made(x, 0.5) == _chosen(x, 0.5)


def test_what_is_the_same_in_all_lanes_stays_as_it_is() -> None:
    plain = getattr(_chosen, "py_func", _chosen)
    given = {"x": types.float64, "y": types.float64}
    assert conversion._for_types(_chosen, given) is plain
    assert conversion.converted(search) is SUBSTITUTES[search]


@pytest.mark.parametrize(
    ("error", "noted"),
    [
        (TypingError("no such type"), True),
        (NotForLanesError("it writes"), True),
        (OSError("full"), False),
    ],
)
def test_only_what_cannot_be_compiled_is_noted(
    error: Exception, noted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    notes: list[Any] = []
    monkeypatch.setattr(together, "note_alone", notes.append)
    one = job("nguyen2024", n=2, steps=1, map="empty")
    formation = Formation([Simulation(one).flight])

    def fail(*_: Any) -> bool:
        raise error

    monkeypatch.setattr(formation, "_kernel", fail)
    with pytest.raises(type(error)):
        formation._fly()
    assert notes == [MODELS["nguyen2024"].advance] * noted
