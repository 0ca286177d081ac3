"""Unsigned indices, and marks that are read a word at a time; and what becomes of both
in compiled code, since a loss would be silent.
"""

import platform
import re
from typing import Any

import llvmlite.binding
import numba
import numpy as np
import pytest

from kernels import neighbours
from kernels.indices import (
    PIECE,
    WORD,
    Marks,
    build_marks,
    lowest,
    signed,
    unsigned,
    whole,
    without_lowest,
    word,
)
from kernels.jit import jit
from kernels.near import build_near
from kernels.neighbours import Gaze, all_pairs, search
from kernels.rules import social
from kernels.stamps import Definition, closure
from kernels.state import Indices, World
from tests import builders
from tests.interpreter import interpreted


@jit
def _places(marks: Marks, places: Indices) -> int:
    """Write the places of the marks that are set, and count them."""
    found = unsigned(0)
    for first in range(unsigned(0), unsigned(marks.size), WORD):
        bits = word(marks, first)
        while bits != unsigned(0):
            places[found] = first + lowest(bits)
            bits = without_lowest(bits)
            found += unsigned(1)
    return signed(found)


def _places_in_words(marks: Marks, room: Indices) -> int:
    """The same by what the interpreter runs."""
    found = 0
    for first in range(0, marks.size, int(WORD)):
        bits = int(word(marks, first))
        while bits:
            room[found] = first + int(lowest(bits))
            bits, found = bits & (bits - 1), found + 1
    return found


@pytest.mark.parametrize("places", [_places, _places_in_words])
@pytest.mark.parametrize("n", [1, 63, 64, 65, 128, 200])
def test_marks_are_read_in_ascending_order(n: int, places: Any) -> None:
    """All, none, the ends, and some of them."""
    rng, room = np.random.default_rng(n), np.zeros(256, np.uint32)
    for share in (0.0, 0.03, 0.5, 1.0):
        marks = build_marks(n)
        assert marks.size % int(WORD) == 0
        marks[:n] = rng.random(n) < share
        marks[[0, n - 1]] |= share > 0
        found = places(marks, room)
        assert room[:found].tolist() == np.flatnonzero(marks).tolist()


def test_the_interpreter_finds_the_same_among_many() -> None:
    """And the stamp of a search covers what reads words in compiled code."""
    call = "builders.bits(builders.job(n=130, steps=2))"
    plain = interpreted(f"from tests import builders\nprint({call})").strip()
    assert builders.bits(builders.job(n=130, steps=2)) == plain
    used = closure({Definition("kernels.neighbours", "search")})
    assert Definition("kernels.indices", "_word") in used


def _seen_by(world: World, x: Any, y: Any, i: int, reach: float) -> list[int]:
    """Who is nearer than `reach` on a torus or plane, by whole arrays."""
    dx, dy = x - x[i], y - y[i]
    if world.minimum_image:
        dx -= np.round(dx / world.width) * world.width
        dy -= np.round(dy / world.height) * world.height
    near = dx * dx + dy * dy < reach * reach
    near[i] = False
    found: list[int] = np.flatnonzero(near).tolist()
    return found


@pytest.mark.parametrize("ahead", [(0.0, 0.0), (1.0, -2.0)])
@pytest.mark.parametrize("torus", [True, False])
@pytest.mark.parametrize("n", [5, 63, 64, 65, 130])
def test_everyone_in_range_is_found_in_few_and_many(
    n: int, torus: bool, ahead: tuple[float, float]
) -> None:
    """In flocks of about one word, of two and of a part of one, thin and dense."""
    rng = np.random.default_rng(5)
    x, y = rng.uniform(0, 800, n), rng.uniform(0, 600, n)
    world, near = builders.a_world(minimum_image=torus), build_near(n)
    flock, grid = builders.a_flock(x, y), all_pairs(n)
    for i in sorted({0, 1, min(63, n - 1), n - 1}):
        for reach in (0.0, 40.0, 290.0, 2000.0):
            view = neighbours.ALL_ROUND
            found = search(flock, world, grid, i, reach * reach, view, *ahead, near)
            others = near.boid[:found]
            assert others.tolist() == _seen_by(world, x, y, i, reach)
            if not torus:
                assert (near.dx[:found] == x[others] - x[i]).all()
                assert (near.dy[:found] == y[others] - y[i]).all()
            squares = near.dx[:found] ** 2 + near.dy[:found] ** 2
            assert (near.distance2[:found] == squares).all()


needs_compiler = pytest.mark.skipif(
    not hasattr(search, "py_func"),
    reason="NUMBA_DISABLE_JIT is set: nothing is compiled",
)


def _compiled(function: Any) -> tuple[str, str]:
    """A search among everyone, compiled anew: as LLVM has optimized it, and as the
    processor gets it. The index of the boid is unsigned, to see those of others alone.
    """
    options: Any = {"error_model": "numpy", "_nrt": False}
    made: Any = numba.njit(**options)(function.py_func)
    flock, gaze = (
        builders.a_flock(np.zeros(2), np.zeros(2)),
        Gaze(1.0, *np.zeros(5).tolist()),
    )
    made(flock, builders.a_world(), np.uint64(0), gaze, build_near(2))
    [code], [machine] = made.inspect_llvm().values(), made.inspect_asm().values()
    return code, machine


@needs_compiler
def test_a_compiled_search_has_no_test_for_negative_indices() -> None:
    """One in the second pass took 8 % of a step of nguyen2024."""
    code, _ = _compiled(neighbours._search_everyone)
    assert "icmp" in code
    assert re.findall(r"icmp slt i64 \S+, 0\b", code) == []


on_avx2 = pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64")
    or not llvmlite.binding.get_host_cpu_features().get("avx2"),
    reason="names of registers and instructions of a processor with AVX2",
)


@needs_compiler
@on_avx2
def test_a_compiled_search_compares_several_distances_at_once() -> None:
    """Registers ymm and zmm hold four and eight of them."""
    _, machine = _compiled(neighbours._search_everyone)
    assert re.search(r"vcmp\w*pd\b.*%[yz]mm", machine)
    assert re.search(r"vmulpd\b.*%[yz]mm", machine)


@needs_compiler
@on_avx2
def test_compiled_separation_takes_several_roots_at_once() -> None:
    made: Any = numba.njit(error_model="numpy", _nrt=False)(social._shorten.py_func)
    made(build_near(2), 2, 1.0)
    [machine] = made.inspect_asm().values()
    assert re.search(r"vsqrtpd\b.*%[yz]mm", machine)


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 200])
def test_whole_pieces_have_room_for_all(count: int) -> None:
    many = int(whole(count))
    assert many % PIECE == 0
    assert count <= many < count + PIECE
