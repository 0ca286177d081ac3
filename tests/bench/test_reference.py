"""The reference in C++ is handed what it expects, and leaves the bits of ours."""

import re
from ctypes import Structure
from dataclasses import replace
from pathlib import Path

import pytest

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


@pytest.mark.slow
@pytest.mark.skipif(not found(), reason="neither g++ nor clang++ is installed")
def test_every_case_leaves_the_same_bits(tmp_path: Path) -> None:
    """Large flocks are left out: the smallest of them goes the same way."""
    for compiler in found():
        try:
            built = library(compiler, tmp_path)
        except CannotCompileError as error:
            pytest.skip(str(error))
        for _, one in cpp.cases():
            if int(one.settings["n"]) <= 1000:
                short = replace(one, settings={**one.settings, "steps": 40})
                cpp.compare_bits(short, built)
