"""Maps that are a built-in one with a few obstacles changed.

A map has only few shapes that are new, and many that a program has computed. So a spec
names the built-in map, and what differs from it.
"""

from collections.abc import Mapping
from difflib import SequenceMatcher
from functools import cache
from typing import NamedTuple

import numpy as np

from kernels.settings import INTEGER, WorldSettings
from kernels.shapes import Obstacle, shapes_of
from kernels.worlds import MAPS

Obstacles = tuple[Obstacle, ...]

MOST_COMPARED = 2000
"""Of a map with more shapes nobody looks for the built-in map that it comes from."""


class Copy(NamedTuple):
    """What a map has otherwise than the built-in map `name`, whose obstacles are
    numbered from 0: those it is without, those in whose place it has others, and those
    that it has besides, behind all others.
    """

    name: str
    without: tuple[int, ...]
    changed: Mapping[int, Obstacle]
    added: Obstacles

    @property
    def obstacles(self) -> Obstacles:
        """The obstacles of the map."""
        kept = tuple(
            self.changed.get(number, obstacle)
            for number, obstacle in enumerate(obstacles_in(self.name))
            if number not in self.without
        )
        return kept + self.added


def sizes() -> dict[str, tuple[float, float]]:
    """The width and height of each map that can be copied: one that has a size of its
    own, and is the same in every trial.
    """
    return {
        name: about.size
        for name, about in MAPS.items()
        if about.size and not about.random
    }


@cache
def obstacles_in(name: str) -> Obstacles:
    """The obstacles of a map that can be copied."""
    size = sizes()[name]
    settings = WorldSettings(
        *(name, *size, 0, False, 0, 0.0, 0.0, INTEGER, 0.0, 0.0),
        obstacle_speed=0.0,
        next_goals=(),
        goals_repeat=False,
    )
    drawn = MAPS[name].draw(settings, np.random.default_rng(0))
    return shapes_of(drawn)


def copy_of(size: tuple[float, float], obstacles: Obstacles) -> Copy | None:
    """The map that has these obstacles, in this order, as a copy of the built-in one
    from which it differs least; None where it shares less than half with each.
    """
    if len(obstacles) > MOST_COMPARED:
        return None
    alike = [
        _differences(name, obstacles) for name, one in sizes().items() if one == size
    ]
    copies = [one for one in alike if one and one.obstacles == obstacles]
    least = min(copies, key=_length, default=None)
    return least if least and 2 * _length(least) <= len(obstacles) else None


def _length(copy: Copy) -> int:
    return len(copy.without) + len(copy.changed) + len(copy.added)


def _differences(name: str, obstacles: Obstacles) -> Copy:
    """What is otherwise than in a built-in map, as far as a Copy can say it."""
    before = obstacles_in(name)
    without, changed, added = list[int](), dict[int, Obstacle](), Obstacles()
    matcher = SequenceMatcher(None, before, obstacles, autojunk=False)
    for kind, i, j, k, m in matcher.get_opcodes():
        if kind == "equal":
            continue
        both = min(j - i, m - k)
        changed |= dict(zip(range(i, i + both), obstacles[k:], strict=False))
        without += range(i + both, j)
        added += obstacles[k + both : m]
    return Copy(name, tuple(without), changed, added)
