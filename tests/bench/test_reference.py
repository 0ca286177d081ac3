"""The reference in C++ is handed what it expects, and leaves the bits of ours."""

import math
import re
from ctypes import CDLL, Structure, c_double
from pathlib import Path

import numpy as np
import pytest

from kernels import elementary, events
from kernels.models import MODELS
from tests.bench import cpp
from tests.bench.reference import binding
from tests.bench.reference.compiling import (
    HERE,
    CannotCompileError,
    found,
    library,
)

STRUCT = re.compile(r"struct (\w+) \{\n(.*?)\n\s*\};", re.DOTALL)
NAME = re.compile(r"(\w+)(?=[,;])")


def members(file: str) -> dict[str, list[str]]:
    """The members of each struct of a file, in their order."""
    text = (HERE / file).read_text()
    return {name: NAME.findall(body) for name, body in STRUCT.findall(text)}


def test_structures_are_those_of_the_reference() -> None:
    ours: dict[str, type[Structure]] = {
        name.removeprefix("Cpp"): entry
        for name, entry in vars(binding).items()
        if name.startswith("Cpp")
    }
    theirs = members("trial.hpp")
    assert set(ours) == set(theirs)
    for name, entry in ours.items():
        assert [field[0] for field in entry._fields_] == theirs[name]


@pytest.mark.parametrize(
    "name", [one for one in MODELS if (HERE / f"{one}.cpp").exists()]
)
def test_settings_stand_in_the_order_of_python(name: str) -> None:
    assert members(f"{name}.cpp")["Settings"] == list(MODELS[name].params._fields)


def test_events_have_the_places_of_python() -> None:
    [body] = re.findall(
        r"enum Event \{(.*?)\}", (HERE / "recorder.hpp").read_text(), re.S
    )
    names = re.findall(r"\w+", body)
    assert [getattr(events, name) for name in names] == list(range(events.N_EVENTS))


def test_without_a_compiler_one_line_says_so(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(cpp, "found", list)
    cpp.cpp()
    assert capsys.readouterr().out == (
        "cpp: neither g++ nor clang++ is installed, skipped\n"
    )


def test_what_cannot_be_compiled_is_said_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(_compiler: str, _folder: Path) -> None:
        raise CannotCompileError("flock.hpp:17:2: error: needs AVX-512")

    monkeypatch.setattr(cpp, "found", lambda: ["g++"])
    monkeypatch.setattr(cpp, "version", lambda _: "g++ 12")
    monkeypatch.setattr(cpp, "library", refuse)
    cpp.cpp()
    assert capsys.readouterr().out == (
        "cpp: g++ cannot compile the reference, skipped: flock.hpp:17:2: error:"
        " needs AVX-512\n"
    )


@pytest.fixture(scope="module")
def libraries(tmp_path_factory: pytest.TempPathFactory) -> list[CDLL]:
    """The reference, compiled by all that can compile it."""
    if not found():
        pytest.skip("neither g++ nor clang++ is installed")
    folder = tmp_path_factory.mktemp("reference")
    try:
        return [library(compiler, folder) for compiler in found()]
    except CannotCompileError as error:
        pytest.skip(str(error))


CASES = {name: one for name, one in cpp.cases() if int(one.settings["n"]) <= 1000}
"""Large flocks are left out: the smallest of them goes the same way."""


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_every_case_leaves_the_same_bits(name: str, libraries: list[CDLL]) -> None:
    for built in libraries:
        cpp.compare_bits(CASES[name], built)


@pytest.mark.slow
def test_elementary_functions_have_the_same_bits(libraries: list[CDLL]) -> None:
    """Of angles and vectors of all sizes, and at the ends of each range."""
    rng = np.random.default_rng(7)
    near = rng.uniform(-7, 7, 40_000)
    far = np.ldexp(rng.uniform(-2, 2, 40_000), rng.integers(-1074, 1023, 40_000))
    ends = [0.0, -0.0, 5e-324, 2.0**20, 1.7e308, math.inf, -math.inf, math.nan]
    numbers = np.concatenate([near, far, np.repeat(ends, len(ends))])
    other = np.concatenate([near[::-1], far * rng.uniform(-3, 3), ends * len(ends)])
    for built in libraries:
        for name, ours, *given in (
            ("angle", elementary.atan2, other, numbers),
            ("sine", elementary.sin, numbers),
            ("cosine", elementary.cos, numbers),
        ):
            theirs = getattr(built, name)
            theirs.argtypes, theirs.restype = [c_double] * len(given), c_double
            pairs = np.array(
                [(ours(*of), theirs(*of)) for of in zip(*given, strict=True)]
            )
            assert np.array_equal(*np.where(np.isnan(pairs), 1, pairs).view("i8").T)
