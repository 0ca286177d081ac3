"""Maps that differ from a built-in map in a few obstacles.

A spec names the built-in map and lists only the differences, because most obstacles of
the map are computed.
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
"""Largest number of shapes of a map that is compared with built-in maps."""


class Copy(NamedTuple):
    """A map as its differences from a built-in map.

    Attributes
    ----------
    name : str
        Name of the built-in map. The obstacles are numbered from 0.
    without : tuple of int
        Obstacles that are left out.
    changed : mapping
        New obstacles by the number of the replaced obstacle.
    added : tuple of Obstacle
        Further obstacles, at the end.
    """

    name: str
    without: tuple[int, ...]
    changed: Mapping[int, Obstacle]
    added: Obstacles

    @property
    def obstacles(self) -> Obstacles:
        """The obstacles of the map."""
        remaining = tuple(
            self.changed.get(number, obstacle)
            for number, obstacle in enumerate(obstacles_in(self.name))
            if number not in self.without
        )
        return remaining + self.added


def sizes() -> dict[str, tuple[float, float]]:
    """Return the width and height of each map that can be copied.

    A map can be copied if the map has a size and no random obstacles.
    """
    return {
        name: built_in.size
        for name, built_in in MAPS.items()
        if built_in.size and not built_in.random
    }


@cache
def obstacles_in(name: str) -> Obstacles:
    """Return the obstacles of a map that can be copied."""
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
    """Return a map as a copy of the most similar built-in map.

    Parameters
    ----------
    size : (float, float)
        Width and height, equal to the size of the built-in map.
    obstacles : tuple of Obstacle
        All obstacles of the map, in order.

    Returns
    -------
    Copy or None
        None if no built-in map has this size, or if each built-in map has more
        differences than half the number of `obstacles`. Also None for more than
        MOST_COMPARED obstacles.
    """
    if len(obstacles) > MOST_COMPARED:
        return None
    same_size = [name for name, built_in in sizes().items() if built_in == size]
    candidates = [_differences(name, obstacles) for name in same_size]
    # Obstacles inserted in the middle would move to the end of a Copy.
    copies = [copy for copy in candidates if copy.obstacles == obstacles]
    least = min(copies, key=_length, default=None)
    return least if least and 2 * _length(least) <= len(obstacles) else None


def _length(copy: Copy) -> int:
    return len(copy.without) + len(copy.changed) + len(copy.added)


def _differences(name: str, obstacles: Obstacles) -> Copy:
    """Return the differences from a built-in map that a Copy can represent."""
    before = obstacles_in(name)
    without = list[int]()
    changed = dict[int, Obstacle]()
    added = Obstacles()
    matcher = SequenceMatcher(None, before, obstacles, autojunk=False)
    for kind, i, j, k, m in matcher.get_opcodes():
        if kind == "equal":
            continue
        both = min(j - i, m - k)
        changed |= dict(zip(range(i, i + both), obstacles[k:], strict=False))
        without += range(i + both, j)
        added += obstacles[k + both : m]
    return Copy(name, tuple(without), changed, added)
