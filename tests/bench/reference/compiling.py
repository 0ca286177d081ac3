"""A library of the reference, by each compiler that is there."""

import shutil
import subprocess
from ctypes import CDLL
from pathlib import Path

import numpy as np

from kernels import elementary_tables

COMPILERS = ("g++", "clang++")
FLAGS = ("-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-std=c++20")
"""`-ffp-contract=off` keeps products and sums apart, as our kernels do: fused ones have
other bits. No function of the reference looks at errno.
"""
HERE = Path(__file__).parent


class CannotCompileError(Exception):
    """The message of the compiler that says why."""


def found() -> list[str]:
    """The compilers that are there."""
    return [name for name in COMPILERS if shutil.which(name)]


def version(compiler: str) -> str:
    """Name and version of a compiler."""
    asked = [compiler, "-dumpfullversion", "-dumpversion"]
    said = subprocess.run(asked, capture_output=True, text=True, check=True)
    return f"{compiler} {said.stdout.split()[0]}"


def library(compiler: str, folder: Path) -> CDLL:
    """The library, compiled into the folder. Raises CannotCompileError."""
    (folder / "elementary_tables.hpp").write_text(_tables())
    file = folder / f"reference-{compiler}.so"
    sources = sorted(map(str, HERE.glob("*.cpp")))
    options = [*FLAGS, f"-I{folder}", "-shared", "-fPIC"]
    command = [compiler, *options, *sources, "-o", str(file)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        errors = [line for line in done.stderr.splitlines() if "error" in line]
        raise CannotCompileError(errors[0] if errors else f"{compiler} has failed")
    return CDLL(str(file))


def _tables() -> str:
    """The tables of elementary functions, with all bits of their numbers."""
    lines = ["#pragma once"]
    for name, table in vars(elementary_tables).items():
        if name.isupper():
            numbers = ", ".join(float(one).hex() for one in np.asarray(table))
            lines.append(f"constexpr double {name}[] = {{{numbers}}};")
    return "\n".join(lines) + "\n"
