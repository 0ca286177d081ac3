"""Samples whose points count only together: the blocks of Saltelli, for Sobol indices,
and the trajectories of Morris.

SALib makes them (Herman and Usher 2017, Journal of Open Source Software 2(9), 97), an
optional extra. Both are samples of the unit cube; every distribution of
`sweep.spec.sampling` stretches its sides.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from sweep.spec.contents import Content, Truth, Whole
from sweep.spec.document import Entry
from sweep.spec.keys import Key
from sweep.spec.limits import MOST_POINTS, check_cells
from sweep.spec.sampling import (
    BlockRules,
    BlockSize,
    Package,
    Sampler,
    Unit,
    UnitCube,
    powers_of_two,
)
from sweep.spec.schema_parts import Schema
from sweep.text import installing

Problem = dict[str, Any]
"""The settings as SALib has them: `num_vars`, `names` and `bounds`."""

LEVELS = 4
MOST_LEVELS = 1000
TAIL = 0.005
"""A normal distribution has no ends: its outermost levels in Morris's grid are the 0.5
and the 99.5 % quantile.
"""

SALIB = Package("SALib", installing("sensitivity"))


@dataclass(frozen=True)
class Levels(Content[int]):
    """An even number of levels."""

    @property
    def words(self) -> str:
        return f"an even number from 2 to {MOST_LEVELS:,}"

    def read(self, entry: Entry) -> int:
        levels = entry.whole(2, MOST_LEVELS)
        if levels % 2:
            raise entry.expected(
                "an even number, so that all levels are equally likely"
            )
        return levels

    def schema(self) -> Schema:
        return Whole(2, MOST_LEVELS).schema() | {"multipleOf": 2}


@dataclass(frozen=True)
class SampleBlocks:
    """`count` blocks of `size` points, which are called `words`. `levels` is the number
    of values of a setting in a grid, else None.
    """

    words: str
    count: int
    size: int
    levels: int | None = None

    def note(self, axis: str) -> str:
        """How many points there are and why, for the plan."""
        points = self.count * self.size
        return (
            f"{axis}: {self.count:,} {self.words} of {self.size} points each"
            f" are {points:,} points"
        )


def read_blocks(
    entry: Entry, sampler: str, rules: BlockRules, settings: int
) -> SampleBlocks:
    """The blocks that an axis over so many `settings` asks for: `points` is their
    number, the base sample.

    Raises SpecError where `points` or an option of the sampler is not allowed, and
    where there are too many points.
    """
    if "when" in entry.value:
        raise entry.child("when").error(
            f"a {sampler} sample cannot have a when: it needs all of its points"
        )
    count = entry.child("points").whole(2, MOST_POINTS)
    formula, levels = rules.read(entry)
    size = formula.of(settings)
    if count * size > MOST_POINTS:
        raise entry.child("points").error(
            f"{count:,} times {formula} for D = {settings} settings makes"
            f" {count * size:,} points; at most {MOST_POINTS:,} are allowed"
        )
    check_cells(entry.child("points"), count * size, settings)
    return SampleBlocks(rules.words, count, size, levels)


PAIRS, NO_PAIRS, TRAJECTORY = BlockSize(2, 2), BlockSize(1, 2), BlockSize(1, 1)


def _saltelli_size(entry: Entry) -> tuple[BlockSize, None]:
    second = entry.get("second_order")
    return (NO_PAIRS if second and not second.truth() else PAIRS), None


def _morris_size(entry: Entry) -> tuple[BlockSize, int]:
    given = entry.get("levels")
    return TRAJECTORY, Levels().read(given) if given else LEVELS


def _problem(cube: UnitCube) -> Problem:
    sides = len(cube.names)
    return {
        "num_vars": sides,
        "names": list(cube.names),
        "bounds": [[0.0, 1.0]] * sides,
    }


def saltelli(cube: UnitCube) -> list[Unit]:
    """A block is A, A with a setting of B each, for pairs B with a setting of A each,
    and B.

    A and B are halves of a point of the scrambled Sobol sequence. More blocks continue
    the sample, another setting makes it another.
    """
    from SALib.sample import sobol

    # scipy warns of a number that is no power of two, so we take the next one and cut.
    power = 2 ** math.ceil(math.log2(cube.points))
    pairs = cube.size == PAIRS.of(len(cube.names))
    drawn = sobol.sample(
        _problem(cube), power, calc_second_order=pairs, seed=cube.generator()
    )
    return list(drawn[: cube.points * cube.size].T)


def morris(cube: UnitCube) -> list[Unit]:
    """A block is a trajectory: each step changes one setting by half of its levels.

    More trajectories continue the sample, another setting makes it another.
    """
    from SALib.sample import morris

    assert cube.levels is not None
    steps = cube.levels - 1
    drawn = morris.sample(
        _problem(cube),
        cube.points,
        num_levels=cube.levels,
        seed=cube.generator(),
    )
    # The same level is reached by different sums: rounding makes equal points equal.
    units = np.rint(drawn.T * steps) / steps
    return [
        TAIL + (1.0 - 2.0 * TAIL) * unit if name in cube.unbounded else unit
        for name, unit in zip(cube.names, units, strict=True)
    ]


SECOND_ORDER = Key(
    Truth(),
    "of saltelli; false: blocks of D + 2 points for D settings, not 2 D + 2, and no"
    " indices of pairs",
    name="second_order",
    otherwise="true",
    example="false",
)
GRID_LEVELS = Key(
    Levels(),
    "of morris: number of values of a setting",
    name="levels",
    otherwise=f"{LEVELS}",
    example="6",
)
SALTELLI = Sampler(
    saltelli,
    "blocks of points for Sobol indices",
    powers_of_two,
    BlockRules(
        "blocks",
        (PAIRS, NO_PAIRS),
        _saltelli_size,
        (SECOND_ORDER,),
    ),
    "sobol",
    SALIB,
)
MORRIS = Sampler(
    morris,
    "trajectories for elementary effects",
    blocks=BlockRules(
        "trajectories",
        (TRAJECTORY,),
        _morris_size,
        (GRID_LEVELS,),
        leveled=True,
    ),
    analysis="morris",
    package=SALIB,
)
