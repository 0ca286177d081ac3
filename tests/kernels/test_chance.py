"""Random numbers by address: the published answers of Philox, the normal distribution,
and the same bits in the interpreter.
"""

import math
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpf
from scipy import stats

from kernels.chance import (
    ChanceKey,
    chance,
    normal,
    normals,
    quantile,
    uniform,
    words,
)
from kernels.generator import stream_of
from kernels.jit import jit
from kernels.state import Floats

ALL = 2**32 - 1
ANSWERS = [
    ((0, 0, 0, 0), (0, 0), "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
    ((ALL,) * 4, (ALL, ALL), "408f276d 41c83b0e a20bc7c6 6d5451fd"),
    (
        (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
        (0xA4093822, 0x299F31D0),
        "d16cfe09 94fdcceb 5001e420 24126ea1",
    ),
]
"""Of philox4x32 with 10 rounds, from the known answers of Random123, the library of
its authors.
"""
P = [*np.logspace(-300, -1, 600).tolist(), *np.linspace(0.1, 0.9, 801).tolist()]
P += (1.0 - np.logspace(-15, -1, 300)).tolist()


def plain(kernel: Any) -> Any:
    return getattr(kernel, "py_func", kernel)


@pytest.mark.parametrize(("place", "key", "answer"), ANSWERS)
def test_words_are_those_of_the_authors(
    place: tuple[int, ...], key: tuple[int, int], answer: str
) -> None:
    found = words(ChanceKey(*key), *place)
    assert [f"{int(one):08x}" for one in found] == answer.split()


def test_the_interpreter_has_the_same_bits() -> None:
    key = ChanceKey(ALL, 12345)
    for k in range(200):
        place = (k, ALL - k, 7 * k, 3)
        assert plain(words)(key, *place) == words(key, *place)
        assert plain(normals)(key, *place) == normals(key, *place)
        assert plain(chance)(key, *place) == chance(key, *place)


def test_a_uniform_number_is_never_0_or_1() -> None:
    least, greatest = np.uint64(0), np.uint64(ALL)
    assert uniform(least, least) == 2.0**-54
    assert uniform(greatest, greatest) == 1.0 - 2.0**-53


def test_the_quantile_inverts_the_distribution() -> None:
    """The error of `erfc` and of the number that it is given, relative to p: with the
    density's slope about z^2 times 2^-53, and some units in the last place.
    """
    for p in P:
        z, least = quantile(p), min(p, 1.0 - p)
        tolerance = (z * z + 8.0) * 2.0**-52
        found = 0.5 * math.erfc(abs(z) / math.sqrt(2.0))
        assert found == pytest.approx(least, rel=tolerance)
        assert (z < 0.0) == (p < 0.5)


class Given(NamedTuple):
    """A generator whose next uniform number is known."""

    number: float

    def random(self) -> float:
        return self.number


def test_normal_numbers_are_finite_and_symmetric_for_every_uniform_one() -> None:
    """The parts at both ends, around 1/2 and around the ends of the approximations,
    where 0.075 and exp(-25) are left of (0, 1). The part k from the one end has the
    number of the part k from the other, with the other sign.
    """
    parts = 2.0**53
    counts = {round(share * parts) for share in (0.075, math.exp(-25.0), 0.5)}
    for k in sorted({count + k for count in counts | {1} for k in range(-1, 9)}):
        below = plain(normal)(Given(k / parts))
        assert below == -plain(normal)(Given((parts - 1.0 - k) / parts))
        with mp.workprec(200):
            exact = float(mp.sqrt(2) * mp.erfinv((2 * mpf(k) + 1) / mpf(2) ** 53 - 1))
        assert below == pytest.approx(exact, rel=1e-15)
    assert plain(normal)(Given(0.0)) == pytest.approx(-8.2924, abs=1e-4)


@jit
def draw_normal(rng: Any, numbers: Floats) -> None:
    for k in range(numbers.size):
        numbers[k] = normal(rng)


def test_normal_numbers_have_the_normal_distribution() -> None:
    """Of 10^6: four moments and the correlation of neighbours within 5 standard errors,
    two-sided (1 false alarm in 350,000 for all five); and the distance to the
    distribution at a p-value of 10^-6.
    """
    count = 10**6
    z = np.zeros(count)
    draw_normal(np.random.default_rng(53), z)
    for power, moment, variance in ((1, 0, 1), (2, 1, 2), (3, 0, 15), (4, 3, 96)):
        error = (z**power).mean() - moment
        assert abs(error) < 5.0 * math.sqrt(variance / count)
    assert abs((z[1:] * z[:-1]).mean()) < 5.0 / math.sqrt(count)
    assert stats.kstest(z, "norm").pvalue > 1e-6


@pytest.mark.slow
def test_normal_numbers_are_the_same_of_a_generator_and_of_a_stream() -> None:
    rng = np.random.default_rng(7)
    stream, ours, theirs = stream_of(rng), np.zeros(5000), np.zeros(5000)
    draw_normal(stream, ours)
    draw_normal(rng, theirs)
    assert ours.tobytes() == theirs.tobytes()
    rng = np.random.default_rng(7)
    assert theirs.tolist() == [plain(normal)(rng) for _ in range(5000)]


def test_the_quantile_grows() -> None:
    found = [quantile(one) for one in sorted(P)]
    assert all(one <= other for one, other in pairwise(found))


def test_neighbouring_addresses_have_independent_numbers() -> None:
    """Means, variances and correlations of 20,000 pairs, in each of four coordinates
    of the address, are within 5 standard errors: 1 false alarm in 70,000 for all 24.
    """
    key, count = ChanceKey(1, 2), 20_000
    for coordinate in range(4):
        places = np.zeros((count, 4), np.int64)
        places[:, coordinate] = np.arange(count)
        pairs = np.array([normals(key, *place) for place in places.tolist()])
        bound = 5.0 / math.sqrt(count)
        assert np.abs(pairs.mean(axis=0)).max() < bound
        assert np.abs(pairs.var(axis=0) - 1.0).max() < bound * math.sqrt(2.0)
        products = (pairs[:, 0] * pairs[:, 1], pairs[1:, 0] * pairs[:-1, 0])
        assert max(abs(one.mean()) for one in products) < bound
