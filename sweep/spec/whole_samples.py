"""Samples whose points count only together: the blocks of Saltelli, for Sobol indices,
and the trajectories of Morris.

SALib makes them (Herman and Usher 2017, Journal of Open Source Software 2(9), 97), an
optional extra. Both are samples of the unit cube; every distribution of
`sweep.spec.sampling` stretches its sides.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
from numpy.random import Generator

from sweep.spec.contents import Content, Whole
from sweep.spec.document import Entry
from sweep.spec.limits import MOST_POINTS, check_cells
from sweep.spec.sampling import Unit, generator
from sweep.spec.schema_parts import Schema

Problem = dict[str, Any]
"""The settings as SALib has them: `num_vars`, `names` and `bounds`."""

OPTIONS = {"saltelli": "second_order", "morris": "levels"}
"""The samplers of this kind, each with the key that only it knows."""

LEVELS = 4
MOST_LEVELS = 1000
TAIL = 0.005
"""A normal distribution has no ends. So the outermost levels of Morris's grid are its
quantiles of 0.5 % and 99.5 %.
"""

INSTALL = 'pip install ".[sensitivity]"'


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
    """`count` blocks of `size` points. `levels` is the number of values of a setting in
    Morris's grid, else None.
    """

    sampler: str
    count: int
    size: int
    levels: int | None = None

    def note(self, axis: str) -> str:
        """How many points there are and why, for the plan."""
        kinds = {"saltelli": "blocks", "morris": "trajectories"}
        points = self.count * self.size
        return (
            f"{axis}: {self.count:,} {kinds[self.sampler]} of {self.size} points each"
            f" are {points:,} points"
        )


def read_blocks(entry: Entry, sampler: str, settings: int) -> SampleBlocks:
    """The blocks that an axis over so many `settings` asks for. The key `points` has
    their number.

    Raises SpecError where `points`, `second_order` or `levels` is not allowed, where
    there are too many points, and where SALib is not installed.
    """
    if "when" in entry.value:
        raise entry.child("when").error(
            f"a {sampler} sample cannot have a when: it needs all of its points"
        )
    count, levels, formula = entry.child("points").whole(2, MOST_POINTS), None, "D + 1"
    if sampler == "saltelli":
        second = entry.get("second_order")
        formula = "D + 2" if second and not second.truth() else "2 D + 2"
    else:
        given = entry.get("levels")
        levels = Levels().read(given) if given else LEVELS
    size = {"D + 1": settings + 1, "D + 2": settings + 2, "2 D + 2": 2 * settings + 2}[
        formula
    ]
    if count * size > MOST_POINTS:
        raise entry.child("points").error(
            f"{count:,} times {formula} for D = {settings} settings makes"
            f" {count * size:,} points; at most {MOST_POINTS:,} are allowed"
        )
    check_cells(entry.child("points"), count * size, settings)
    _check_installed(entry.child("sample"), sampler)
    return SampleBlocks(sampler, count, size, levels)


def _check_installed(entry: Entry, sampler: str) -> None:
    if find_spec("SALib") is None:
        raise entry.error(
            f"sample: {sampler} needs the package SALib,"
            f" which is not installed: {INSTALL}"
        )


def sample_blocks(
    blocks: SampleBlocks, distributions: Mapping[str, str], axis: str, seed: int
) -> list[Unit]:
    """The sample of the settings with these distributions, block after block: an array
    for each setting.

    More blocks continue it. Another number of settings changes all points.
    """
    settings = len(distributions)
    problem = {
        "num_vars": settings,
        "names": list(distributions),
        "bounds": [[0.0, 1.0]] * settings,
    }
    if blocks.levels is None:
        return _saltelli(blocks, problem, generator(seed, axis))
    units = _morris(blocks, blocks.levels, problem, generator(seed, axis))
    return [
        TAIL + (1.0 - 2.0 * TAIL) * unit if distribution == "normal" else unit
        for distribution, unit in zip(distributions.values(), units, strict=True)
    ]


def _saltelli(blocks: SampleBlocks, problem: Problem, rng: Generator) -> list[Unit]:
    """A block consists of point A; A with one setting taken from B, for each setting;
    for indices of pairs also B with one setting taken from A, for each setting; and
    point B.

    A and B are the two halves of a point of the scrambled Sobol sequence.
    """
    from SALib.sample import sobol

    # scipy warns where the number is no power of two: take the next power, and cut.
    power = 2 ** math.ceil(math.log2(blocks.count))
    second_order = blocks.size == 2 * problem["num_vars"] + 2
    sample = sobol.sample(problem, power, calc_second_order=second_order, seed=rng)
    return list(sample[: blocks.count * blocks.size].T)


def _morris(
    blocks: SampleBlocks, levels: int, problem: Problem, rng: Generator
) -> list[Unit]:
    """A block is a trajectory: each step changes one setting by half of its levels."""
    from SALib.sample import morris

    sample = morris.sample(problem, blocks.count, num_levels=levels, seed=rng)
    # Different sums reach the same level. Rounding makes these points equal.
    return list(np.rint(sample.T * (levels - 1)) / (levels - 1))
