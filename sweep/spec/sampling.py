"""What a sampler is, and those that draw points one by one.

A sampler fills the unit cube, which has a side for each setting; distributions stretch
its sides. To add one, write a function and enter it in `sweep.spec.samplers`.
"""

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.random import Generator, default_rng
from numpy.typing import NDArray

from sweep.spec.document import Entry
from sweep.spec.keys import Key
from sweep.spec.seeds import address, hashed

Analyses = Literal["sobol", "morris", "ranks"]
"""What `sweep.methods.sensitivity` can make of a sample: Sobol indices, elementary
effects, or rank correlations.
"""

Unit = NDArray[np.float64]
"""Numbers in [0, 1), shape (points,); in a sample on levels, as Morris's, 1 is one of
them.
"""


def generator(seed: int, *names: str) -> Generator:
    """The random numbers of an axis, or of one of its settings."""
    return default_rng(
        address(seed, "design", *(number for name in names for number in hashed(name)))
    )


@dataclass(frozen=True)
class UnitCube:
    """What a sampler is asked for: `points` of the unit cube, which has a side for each
    of the settings `names`.

    `axis` and the `seed` of the study give it its random numbers. The distributions of
    the settings `unbounded` have no ends. Where points come in blocks of `size`,
    `points` is the number of blocks; `levels` is that of values of a setting in a grid.
    """

    points: int
    names: Sequence[str]
    axis: str
    seed: int
    unbounded: Collection[str] = ()
    size: int = 1
    levels: int | None = None

    def generator(self, *names: str) -> Generator:
        """The random numbers of the axis, or of one of its settings."""
        return generator(self.seed, self.axis, *names)


class BlockSize(NamedTuple):
    """How many points a block has: `times` D + `more`, for D settings."""

    times: int
    more: int

    def of(self, settings: int) -> int:
        """The number of points for so many settings."""
        return self.times * settings + self.more

    def __str__(self) -> str:
        return f"{f'{self.times} ' if self.times > 1 else ''}D + {self.more}"


@dataclass(frozen=True)
class BlockRules:
    """Of a sampler whose points count only together, in blocks.

    `words` is what such blocks are called. A block has one of `sizes`; `read(axis)`
    says which an axis asks for, and on how many levels, None where there are none.
    `options` are the keys of an axis that only this sampler knows. `leveled` says that
    the analysis needs the number of levels.
    """

    words: str
    sizes: tuple[BlockSize, ...]
    read: Callable[[Entry], tuple[BlockSize, int | None]]
    options: tuple[Key, ...] = ()
    leveled: bool = False


class Package(NamedTuple):
    """A package that is no part of every installation, and how to install it."""

    name: str
    install: str


@dataclass(frozen=True)
class Sampler:
    """How the points of a joint axis are drawn, written in a spec as `sample: name`.

    `draw(cube)` gives a column a setting, in the order of its names, each with its
    numbers between 0 and 1. `text` says what it does. `remark(points)` is what a user
    should know of such a number of points, "" for nothing. `blocks` are the rules of a
    sample whose points come in blocks. `analysis` names the one of
    `sweep.methods.sensitivity` that the sample is made for. `package` is what it needs.
    """

    draw: Callable[[UnitCube], Sequence[Unit]]
    text: str
    remark: Callable[[int], str] = lambda _points: ""
    blocks: BlockRules | None = None
    analysis: Analyses = "ranks"
    package: Package | None = None


def random(cube: UnitCube) -> list[Unit]:
    """Independent draws. Each setting has its own stream, so that another setting or
    more points change no value.
    """
    return [cube.generator(name).random(cube.points) for name in cube.names]


def latin_hypercube(cube: UnitCube) -> list[Unit]:
    """One draw in each of `points` equal intervals of every setting.

    More points are other points altogether.
    """
    # As scipy's LatinHypercube, which holds the sample four times: it spawns its
    # generator.
    (rng,) = cube.generator().spawn(1)
    drawn = rng.uniform(size=(cube.points, len(cube.names)))
    for column in drawn.T:
        interval = np.arange(1, cube.points + 1)
        rng.shuffle(interval)
        column[:] = (interval - column) / cube.points
    return list(drawn.T)


def sobol(cube: UnitCube) -> list[Unit]:
    """The scrambled Sobol sequence: more points continue it, another setting makes it
    another.
    """
    from scipy.stats.qmc import Sobol

    # scipy warns of a number that is no power of two, so we take the next one and cut.
    sequence = Sobol(d=len(cube.names), seed=cube.generator())
    drawn = sequence.random_base2(math.ceil(math.log2(cube.points)))
    return list(drawn[: cube.points].T)


def halton(cube: UnitCube) -> list[Unit]:
    """The scrambled Halton sequence: more points continue it, another setting makes it
    another.
    """
    from scipy.stats.qmc import Halton

    sequence = Halton(d=len(cube.names), seed=cube.generator())
    return list(sequence.random(cube.points).T)


def powers_of_two(points: int) -> str:
    """What is to be said of the number of points of a Sobol sequence."""
    if points & (points - 1) == 0:
        return ""
    return f"a Sobol sequence is most even for a power of two, not for {points} points"
