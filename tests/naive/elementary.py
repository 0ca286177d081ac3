"""The tables of kernels/elementary_tables.py, made with many digits.

python -m tests.naive.elementary > kernels/elementary_tables.py
"""

from collections.abc import Callable, Iterable

from mpmath import mp, mpf

DIGITS = 60
"""Of the numbers before they are rounded; two doubles have 32."""
HEAD = '''"""Tables of kernels.elementary, made by tests.naive.elementary.

Numbers have two parts: the double next to the exact value, and the double next to the
rest. The first parts of constants in several parts have only a few bits, so multiples
of the first parts are exact.
"""

import numpy as np
from numpy.typing import NDArray


def _numbers(text: str) -> NDArray[np.float64]:
    return np.array(text.split(), np.float64)


POWERS = np.ldexp(1.0, np.arange(-1022, 1024))
"""Powers of 2 with full precision (normal doubles)."""
'''
EXP_PARTS, SINE_PARTS, ATAN_PARTS, LOG_PARTS = 128, 64, 128, 256
FIRST_LOG, LAST_LOG = 181, 362
"""The tables of the logarithm begin at the square root of 1/2, and end at that of 2."""
FACTOR_BITS = 11


def in_parts(value: mpf, bits: Iterable[int]) -> list[float]:
    """A number in parts: each the one next to the rest with so many bits."""
    parts = []
    for count in bits:
        _, exponent = mp.frexp(value)
        scale = mpf(2) ** (count - int(exponent))
        parts.append(float(mp.nint(value * scale) / scale))
        value -= mpf(parts[-1])
    return parts


def factor(k: int) -> mpf:
    """Near 1 / m for the middle m of part `k` of the logarithm's tables."""
    scale = mpf(2) ** FACTOR_BITS
    return mpf(mp.nint(scale * LOG_PARTS / k) / scale)


def pair(
    values: Iterable[mpf], step: int | None = None
) -> tuple[list[float], list[float]]:
    """The numbers next to some, as multiples of 2^-step where one is given, and the
    numbers next to what is left of these.
    """
    highs, lows = [], []
    for one in values:
        top = one if step is None else mp.nint(one * 2**step) / 2**step
        highs.append(float(top))
        lows.append(float(one - mpf(highs[-1])))
    return highs, lows


def block(name: str, values: Iterable[float]) -> str:
    """An array as Python has it, in lines of three numbers."""
    texts = [f"{value!r}" for value in values]
    lines = [" ".join(texts[k : k + 3]) for k in range(0, len(texts), 3)]
    body = "\n    ".join(lines)
    return f'{name} = _numbers(\n    """\n    {body}\n    """\n)\n'


def constant(name: str, value: mpf, bits: Iterable[int]) -> str:
    """A tuple as Python has it."""
    inner = "".join(f"    {part!r},\n" for part in in_parts(value, bits))
    return f"{name} = (\n{inner})\n"


def tables() -> str:
    """The text of the file."""
    with mp.workdps(DIGITS):
        ends = range(FIRST_LOG, LAST_LOG + 1)
        sines = range(int(mp.ceil(SINE_PARTS * mp.pi / 4)) + 1)

        def two(
            name: str,
            of: Callable[[int], mpf],
            places: Iterable[int],
            step: int | None = None,
        ) -> str:
            high, low = pair((of(k) for k in places), step)
            return block(f"{name}_HIGH", high) + block(f"{name}_LOW", low)

        return HEAD + "".join(
            (
                constant("LN2", mp.log(2), (42, 53)),
                constant("EXP_STEP", mp.log(2) / EXP_PARTS, (35, 53)),
                constant("HALF_PI", mp.pi / 2, (33, 33, 33, 53)),
                two("EXP", lambda k: 2 ** (mpf(k) / EXP_PARTS), range(EXP_PARTS), 25),
                block("FACTOR", (float(factor(k)) for k in ends)),
                two("LOG", lambda k: -mp.log(factor(k)), ends, 42),
                two("SINE", lambda k: mp.sin(mpf(k) / SINE_PARTS), sines),
                two("COSINE", lambda k: mp.cos(mpf(k) / SINE_PARTS), sines),
                two("ATAN", lambda k: mp.atan(mpf(k) / ATAN_PARTS), range(129)),
            )
        )


if __name__ == "__main__":
    print(tables(), end="")
