"""Definition of a sampler, and the samplers that draw points one by one.

A sampler draws points of the unit cube, which has a side per parameter. Distributions
stretch the sides. To add a sampler, write a function and an entry of
`sweep.spec.samplers`.
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
"""Analyses of `sweep.methods.sensitivity` that need a sample.

The analyses are Sobol indices, elementary effects (Morris), and rank correlations.
"""

Unit = NDArray[np.float64]
"""Numbers in [0, 1), shape (points,).

In a sample on levels, such as a Morris sample, 1 is also a level.
"""


def generator(seed: int, *names: str) -> Generator:
    """Return the random numbers of an axis, or of a parameter of the axis."""
    return default_rng(
        address(seed, "design", *(number for name in names for number in hashed(name)))
    )


@dataclass(frozen=True)
class UnitCube:
    """The points of the unit cube that a sampler draws.

    Attributes
    ----------
    points : int
        Number of points, or of blocks if points come in blocks.
    names : sequence of str
        Parameters, one per side of the cube.
    axis : str
        Name of the axis, which together with `seed` decides the random numbers.
    seed : int
        Seed of the study.
    unbounded : collection of str
        Parameters whose distributions have no bounds.
    size : int, default 1
        Number of points of a block.
    levels : int, optional
        Number of values of a parameter in a grid. None without a grid.
    """

    points: int
    names: Sequence[str]
    axis: str
    seed: int
    unbounded: Collection[str] = ()
    size: int = 1
    levels: int | None = None

    def generator(self, *names: str) -> Generator:
        """Return the random numbers of the axis, or of a parameter of the axis."""
        return generator(self.seed, self.axis, *names)


class BlockSize(NamedTuple):
    """The number of points of a block: `times` D + `more` for D parameters."""

    times: int
    more: int

    def of(self, settings: int) -> int:
        """Return the number of points for a number of parameters."""
        return self.times * settings + self.more

    def __str__(self) -> str:
        return f"{f'{self.times} ' if self.times > 1 else ''}D + {self.more}"


@dataclass(frozen=True)
class BlockRules:
    """Rules of a sampler whose points form blocks, each needed as a whole.

    Attributes
    ----------
    label : str
        Name of the blocks, in the plural.
    sizes : tuple of BlockSize
        Allowed sizes of a block.
    read : callable
        Returns the size of blocks and the number of levels that an axis selects. The
        number is None without levels.
    options : tuple of Key
        Keys of an axis that only this sampler has.
    leveled : bool, default False
        True if the analysis needs the number of levels.
    """

    label: str
    sizes: tuple[BlockSize, ...]
    read: Callable[[Entry], tuple[BlockSize, int | None]]
    options: tuple[Key, ...] = ()
    leveled: bool = False


class Package(NamedTuple):
    """An optional package, and the command that installs the package."""

    name: str
    install: str


@dataclass(frozen=True)
class Sampler:
    """A way to draw the points of a joint axis, in a spec `sample: name`.

    Attributes
    ----------
    draw : callable
        Returns a column per parameter, in the order of the names, with numbers between
        0 and 1.
    text : str
        Description of the sampler.
    remark : callable
        Returns a remark on a number of points; "" without a remark.
    blocks : BlockRules, optional
        Rules of a sample whose points come in blocks.
    analysis : {"sobol", "morris", "ranks"}, default "ranks"
        The analysis of `sweep.methods.sensitivity` that uses the sample.
    package : Package, optional
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

    Each parameter has a separate stream. So an additional parameter or more points
    change no value.
    """
    return [cube.generator(name).random(cube.points) for name in cube.names]


def latin_hypercube(cube: UnitCube) -> list[Unit]:
    """Draw once in each of `points` equal intervals of every parameter.

    Samples of different sizes share no points.
    """
    # Equal to scipy's LatinHypercube, which needs four times the memory. That class
    # spawns the generator.
    (rng,) = cube.generator().spawn(1)
    drawn = rng.uniform(size=(cube.points, len(cube.names)))
    for column in drawn.T:
        interval = np.arange(1, cube.points + 1)
        rng.shuffle(interval)
        column[:] = (interval - column) / cube.points
    return list(drawn.T)


def sobol(cube: UnitCube) -> list[Unit]:
    """Draw the scrambled Sobol sequence.

    More points continue the sequence. An additional parameter changes all points.
    """
    from scipy.stats.qmc import Sobol

    # scipy warns if the number is not a power of two: draw the next power, and cut.
    sequence = Sobol(d=len(cube.names), seed=cube.generator())
    drawn = sequence.random_base2(math.ceil(math.log2(cube.points)))
    return list(drawn[: cube.points].T)


def halton(cube: UnitCube) -> list[Unit]:
    """Draw the scrambled Halton sequence.

    More points continue the sequence. An additional parameter changes all points.
    """
    from scipy.stats.qmc import Halton

    sequence = Halton(d=len(cube.names), seed=cube.generator())
    return list(sequence.random(cube.points).T)


def powers_of_two(points: int) -> str:
    """Return the remark on a number of points of a Sobol sequence."""
    if points & (points - 1) == 0:
        return ""
    return f"a Sobol sequence is most even for a power of two, not for {points} points"
