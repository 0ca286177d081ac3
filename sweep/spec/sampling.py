"""Definition of a sampler, and the samplers that draw points one by one.

A sampler fills the unit cube, which has a side per setting. Distributions stretch the
sides. To add a sampler, write a function and enter it in `sweep.spec.samplers`.
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
"""Analyses of `sweep.methods.sensitivity` that a sample is made for.

Sobol indices, elementary effects, or rank correlations.
"""

Unit = NDArray[np.float64]
"""Numbers in [0, 1), shape (points,).

In a sample on levels, such as Morris's, 1 is a level too.
"""


def generator(seed: int, *names: str) -> Generator:
    """Return the random numbers of an axis, or of one of its settings."""
    return default_rng(
        address(seed, "design", *(number for name in names for number in hashed(name)))
    )


@dataclass(frozen=True)
class UnitCube:
    """The points of the unit cube that a sampler draws.

    Attributes
    ----------
    points
        Number of points, or of blocks if points come in blocks.
    names
        Settings, one per side of the cube.
    axis
        Name of the axis; with `seed` it decides the random numbers.
    seed
        Seed of the study.
    unbounded
        Settings whose distributions have no ends.
    size
        Number of points of a block.
    levels
        Number of values of a setting in a grid. None without a grid.
    """

    points: int
    names: Sequence[str]
    axis: str
    seed: int
    unbounded: Collection[str] = ()
    size: int = 1
    levels: int | None = None

    def generator(self, *names: str) -> Generator:
        """Return the random numbers of the axis, or of one of its settings."""
        return generator(self.seed, self.axis, *names)


class BlockSize(NamedTuple):
    """The number of points of a block: `times` D + `more` for D settings."""

    times: int
    more: int

    def of(self, settings: int) -> int:
        """Return the number of points for a number of settings."""
        return self.times * settings + self.more

    def __str__(self) -> str:
        return f"{f'{self.times} ' if self.times > 1 else ''}D + {self.more}"


@dataclass(frozen=True)
class BlockRules:
    """Rules of a sampler whose points count only together, in blocks.

    Attributes
    ----------
    words
        Name of such blocks, in the plural.
    sizes
        Sizes that a block can have.
    read
        Returns the size of blocks and the number of levels that an axis selects. The
        number is None without levels.
    options
        Keys of an axis that only this sampler has.
    leveled
        True if the analysis needs the number of levels.
    """

    words: str
    sizes: tuple[BlockSize, ...]
    read: Callable[[Entry], tuple[BlockSize, int | None]]
    options: tuple[Key, ...] = ()
    leveled: bool = False


class Package(NamedTuple):
    """An optional package, and how to install it."""

    name: str
    install: str


@dataclass(frozen=True)
class Sampler:
    """A way to draw the points of a joint axis, in a spec `sample: name`.

    Attributes
    ----------
    draw
        Returns a column per setting, in the order of the names, with numbers between 0
        and 1.
    text
        Description of the sampler.
    remark
        Returns a remark on a number of points, "" for none.
    blocks
        Rules of a sample whose points come in blocks.
    analysis
        The analysis of `sweep.methods.sensitivity` that the sample is made for.
    package
        Package that the sampler needs.
    """

    draw: Callable[[UnitCube], Sequence[Unit]]
    text: str
    remark: Callable[[int], str] = lambda _points: ""
    blocks: BlockRules | None = None
    analysis: Analyses = "ranks"
    package: Package | None = None


def random(cube: UnitCube) -> list[Unit]:
    """Draw points independently.

    Each setting has its own stream, so that another setting or more points change no
    value.
    """
    return [cube.generator(name).random(cube.points) for name in cube.names]


def latin_hypercube(cube: UnitCube) -> list[Unit]:
    """Draw once in each of `points` equal intervals of every setting.

    A sample of more points shares none with a smaller one.
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
    """Draw the scrambled Sobol sequence.

    More points continue the sequence. Another setting changes all of it.
    """
    from scipy.stats.qmc import Sobol

    # scipy warns of a number that is no power of two, so we take the next one and cut.
    sequence = Sobol(d=len(cube.names), seed=cube.generator())
    drawn = sequence.random_base2(math.ceil(math.log2(cube.points)))
    return list(drawn[: cube.points].T)


def halton(cube: UnitCube) -> list[Unit]:
    """Draw the scrambled Halton sequence.

    More points continue the sequence. Another setting changes all of it.
    """
    from scipy.stats.qmc import Halton

    sequence = Halton(d=len(cube.names), seed=cube.generator())
    return list(sequence.random(cube.points).T)


def powers_of_two(points: int) -> str:
    """Return the remark on a number of points of a Sobol sequence."""
    if points & (points - 1) == 0:
        return ""
    return f"a Sobol sequence is most even for a power of two, not for {points} points"
