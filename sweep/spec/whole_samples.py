"""Samples whose analysis needs all points.

The samples are the blocks of Saltelli, for Sobol indices, and the trajectories of
Morris. SALib, an optional extra, draws the samples (Herman and Usher 2017, Journal of
Open Source Software 2(9), 97). The points are in the unit cube. Every distribution of
`sweep.spec.distributions` can stretch the sides of the cube.
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
"""Parameters in the form of SALib: `num_vars`, `names` and `bounds`."""

LEVELS = 4
MOST_LEVELS = 1000
TAIL = 0.005
"""Probability beyond the outermost levels of a parameter without bounds.

A normal distribution has no bounds. The outermost levels of a Morris sample are the
0.5 % and the 99.5 % quantiles.
"""

SALIB = Package("SALib", installing("sensitivity"))


@dataclass(frozen=True)
class Levels(Content[int]):
    """An even number of levels."""

    @property
    def words(self) -> str:
        """The allowed values in words."""
        return f"an even number from 2 to {MOST_LEVELS:,}"

    def read(self, entry: Entry) -> int:
        """Return the number of levels of an entry, or raise SpecError."""
        levels = entry.whole(2, MOST_LEVELS)
        if levels % 2:
            raise entry.expected(
                "an even number, so that all levels are equally likely"
            )
        return levels

    def schema(self) -> Schema:
        """Return the JSON Schema of the allowed values."""
        return Whole(2, MOST_LEVELS).schema() | {"multipleOf": 2}


@dataclass(frozen=True)
class SampleBlocks:
    """A number of blocks of points.

    Attributes
    ----------
    label : str
        Name of the blocks, in the plural.
    count : int
        Number of blocks.
    size : int
        Points per block.
    levels : int, optional
        Number of values of a parameter in a grid. None without a grid.
    """

    label: str
    count: int
    size: int
    levels: int | None = None

    def note(self, axis: str) -> str:
        """Return the number of points, with the calculation, for the plan."""
        points = self.count * self.size
        return (
            f"{axis}: {self.count:,} {self.label} of {self.size} points each"
            f" are {points:,} points"
        )


def read_blocks(
    entry: Entry, sampler: str, rules: BlockRules, settings: int
) -> SampleBlocks:
    """Return the blocks that an axis selects.

    Parameters
    ----------
    entry : Entry
        The axis. `points` is the number of blocks, the base sample.
    sampler : str
        Name of the sampler, for messages.
    rules : BlockRules
        Rules of the sampler.
    settings : int
        Number of parameters that the axis varies.

    Raises
    ------
    SpecError
        If `points` or an option of the sampler is not allowed, or there are too many
        points.
    """
    if "when" in entry.value:
        raise entry.child("when").error(
            f"a {sampler} sample cannot have when: the analysis needs all points"
        )
    count = entry.child("points").whole(2, MOST_POINTS)
    formula, levels = rules.read(entry)
    size = formula.of(settings)
    if count * size > MOST_POINTS:
        raise entry.child("points").error(
            f"{count:,} times {formula} for D = {settings} parameters makes"
            f" {count * size:,} points; at most {MOST_POINTS:,} are allowed"
        )
    check_cells(entry.child("points"), count * size, settings)
    return SampleBlocks(rules.label, count, size, levels)


PAIRS = BlockSize(2, 2)
NO_PAIRS = BlockSize(1, 2)
TRAJECTORY = BlockSize(1, 1)


def _saltelli_size(entry: Entry) -> tuple[BlockSize, None]:
    second = entry.get("second_order")
    return (NO_PAIRS if second and not second.truth() else PAIRS), None


def _morris_size(entry: Entry) -> tuple[BlockSize, int]:
    levels = entry.get("levels")
    return TRAJECTORY, Levels().read(levels) if levels else LEVELS


def _problem(cube: UnitCube) -> Problem:
    sides = len(cube.names)
    return {
        "num_vars": sides,
        "names": list(cube.names),
        "bounds": [[0.0, 1.0]] * sides,
    }


def saltelli(cube: UnitCube) -> list[Unit]:
    """Draw the blocks of Saltelli.

    A and B are the two halves of a point of the scrambled Sobol sequence. A block
    begins with A, and then has A with each single parameter from B. For indices of
    pairs, B with each single parameter from A follows. The last point is B. More blocks
    continue the sample. An additional parameter changes all points.
    """
    from SALib.sample import sobol

    # scipy warns if the number is not a power of two: draw the next power, and cut.
    power = 2 ** math.ceil(math.log2(cube.points))
    pairs = cube.size == PAIRS.of(len(cube.names))
    drawn = sobol.sample(
        _problem(cube), power, calc_second_order=pairs, seed=cube.generator()
    )
    return list(drawn[: cube.points * cube.size].T)


def morris(cube: UnitCube) -> list[Unit]:
    """Draw the trajectories of Morris.

    Each step of a trajectory changes one parameter by half of the levels. More
    trajectories continue the sample. An additional parameter changes all points.
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
    # Different sums reach the same level. Rounding makes these points equal.
    units = np.rint(drawn.T * steps) / steps
    return [
        TAIL + (1.0 - 2.0 * TAIL) * unit if name in cube.unbounded else unit
        for name, unit in zip(cube.names, units, strict=True)
    ]


SECOND_ORDER = Key(
    Truth(),
    "for saltelli; false: blocks of D + 2 points for D parameters, not 2 D + 2, without"
    " indices of pairs",
    name="second_order",
    otherwise="true",
    example="false",
)
GRID_LEVELS = Key(
    Levels(),
    "for morris: number of values per parameter",
    name="levels",
    otherwise=f"{LEVELS}",
    example="6",
)
SALTELLI = Sampler(
    saltelli,
    "blocks of points for Sobol indices",
    powers_of_two,
    blocks=BlockRules(
        "blocks",
        (PAIRS, NO_PAIRS),
        _saltelli_size,
        (SECOND_ORDER,),
    ),
    analysis="sobol",
    package=SALIB,
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
