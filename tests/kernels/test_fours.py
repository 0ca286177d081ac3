"""Four numbers side by side: what they are compiled to has the bits of the text."""

import re
from typing import Any

import numba
import numpy as np
import pytest

from kernels.fours import below, four, minus, parts, plus, times
from kernels.jit import jit
from kernels.near import build_near
from kernels.rules import social
from kernels.stamps import Definition, closure
from kernels.state import Floats
from tests import builders
from tests.kernels.test_indices import needs_compiler, on_avx2

ODD = [0.0, -0.0, 1.0, -1.5, 5e-324, 1.7e308, np.inf, -np.inf, np.nan]


@jit
def _all_of_them(numbers: Floats, other: Floats, found: Floats) -> None:
    """Write the numbers that each function has of the first four of two arrays."""
    one = four(numbers[0], numbers[1], numbers[2], numbers[3])
    two = four(other[0], other[1], other[2], other[3])
    found[0], found[1], found[2], found[3] = parts(plus(one, two))
    found[4], found[5], found[6], found[7] = parts(times(one, two))
    found[8], found[9], found[10], found[11] = parts(below(numbers[0], two))
    found[12], found[13], found[14], found[15] = parts(minus(one, two))


@pytest.mark.filterwarnings("ignore:(overflow|invalid value)")
def test_compiled_code_has_the_bits_of_the_text() -> None:
    """Of ordinary numbers, and of all that are not."""
    rng, text = np.random.default_rng(4), getattr(_all_of_them, "py_func", _all_of_them)
    for k in range(300):
        draw = rng.choice(ODD, (2, 4)) if k % 2 else rng.normal(size=(2, 4))
        made, meant = np.full((2, 16), 7.0)
        _all_of_them(*draw, made)
        text(*draw, meant)
        assert np.array_equal(np.isnan(made), np.isnan(meant))
        numbers = ~np.isnan(made)
        assert made[numbers].tobytes() == meant[numbers].tobytes()


@needs_compiler
@on_avx2
def test_compiled_sums_add_four_at_once() -> None:
    """Registers ymm hold four: else a step of nguyen2024 takes an eighth longer."""
    made: Any = numba.njit(error_model="numpy", _nrt=False)(social.ranged_sums.py_func)
    flock = builders.a_flock(np.zeros(2), np.zeros(2))
    made(flock, build_near(2), 2, 1.0, 2.0, 3.0)
    [machine] = made.inspect_asm().values()
    assert re.search(r"vaddpd\b.*%ymm", machine)


def test_what_is_compiled_belongs_to_the_stamps_of_rules() -> None:
    """So an edit of it compiles them again, and gives trials other ids."""
    used = closure({Definition("kernels.rules.social", "ranged_sums")})
    compiled_to = {"_join", "_part", "_add", "_subtract", "_multiply", "_compare"}
    names = compiled_to | {"_is_compiled"}
    assert {Definition("kernels.fours", name) for name in names} <= used
