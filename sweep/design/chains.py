"""Chains of points: where an axis is continued, the trials of a point begin where those
of another point have ended, replicate by replicate.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sweep.design.points import Points
from sweep.spec.axes import Axis, distinct_rows
from sweep.spec.continuing import DIRECTION, DOWN
from sweep.spec.settings import Values
from sweep.spec.study import Study

FIRST = -1
"""In the place of the point before the first link."""


@dataclass(frozen=True, eq=False)
class Links:
    """How the points of a design are linked, shape (n_points,) each.

    `direction` is up or down, `before` the point whose trials end where those of this
    point begin, FIRST where there is none, and `first` that with which its chain
    begins. `number` counts the links of a chain, from 0.
    """

    direction: Values
    before: NDArray[np.int64]
    first: NDArray[np.int64]
    number: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.before)

    def by_number(self) -> Iterator[NDArray[np.int64]]:
        """The points of all first links, then those of all second ones, and so on."""
        for number in range(int(self.number.max()) + 1):
            yield np.flatnonzero(self.number == number)

    def columns(self) -> dict[str, Values]:
        """The direction of each point, where chains go in both."""
        both = len(set(self.direction.tolist())) > 1
        return {DIRECTION: self.direction} if both else {}


def linked(study: Study, axis: Axis, points: Points) -> tuple[Points, Links]:
    """The points of all directions of the continued `axis`, those of the second one
    last, and how they are linked. Chains differ in the other axes.

    Raises SpecError where the number of boids or the world follows from that axis.
    """
    _check_same(study, axis)
    assert axis.continued
    directions, count = axis.continued.directions, points.count
    others = [name for one in study.axes if one is not axis for name in one.columns]
    chain = np.zeros(count, np.int64)
    if others:
        _, chain = distinct_rows([points.column(name) for name in others])
    every = points.times(len(directions))
    chain = np.tile(chain, len(directions))
    turn = np.repeat(np.arange(len(directions)), count)
    value = every.column(axis.name)
    names = np.array(directions, object)[turn]
    order, begins = _in_order(chain, turn, names, value)
    first, number = (np.empty(every.count, np.int64) for _ in range(2))
    starts = np.maximum.accumulate(np.where(begins, np.arange(every.count), 0))
    first[order], number[order] = order[starts], np.arange(every.count) - starts
    return every, Links(names, _before(order, begins), first, number)


def before_each(
    chain: NDArray[np.int64],
    turn: NDArray[np.int64],
    direction: Values,
    value: NDArray[np.float64],
) -> NDArray[np.int64]:
    """The place of the link before each of n links in its chain, FIRST where there is
    none, shape (n,).

    chain      which chain it belongs to, from 0
    turn       whether its direction is the first of the chain, the second, and so on
    direction  that direction, up or down
    value      its value of the continued axis
    """
    return _before(*_in_order(chain, turn, direction, value))


def _in_order(
    chain: NDArray[np.int64],
    turn: NDArray[np.int64],
    direction: Values,
    value: Values,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The places of links, chain after chain, and where chains begin in that order."""
    order = np.lexsort((np.where(direction == DOWN, -value, value), turn, chain))
    return order, np.diff(chain[order], prepend=-1) != 0


def _before(order: NDArray[np.int64], begins: NDArray[np.bool_]) -> NDArray[np.int64]:
    before = np.empty(len(order), np.int64)
    before[order] = np.where(begins, FIRST, np.roll(order, 1))
    return before


SAME = ("n", "map", "width", "height")


def _check_same(study: Study, axis: Axis) -> None:
    """Raise SpecError where an expression derives from the continued axis what cannot
    change while boids fly.
    """
    for name in SAME:
        expression = study.derive.get(name)
        if expression and axis.name in _needs(study, expression.names):
            raise study.document.error(
                ("derive", name),
                f"{name} cannot change from link to link: it is derived from"
                f" {axis.name}, which is continued",
            )


def _needs(study: Study, names: Iterable[str]) -> set[str]:
    """All settings that these depend on, and they themselves."""
    found, left = set[str](), [*names]
    while left:
        name = left.pop()
        if name not in found:
            found.add(name)
            left += study.derive[name].names if name in study.derive else ()
    return found
