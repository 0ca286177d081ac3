"""Chains of points along a continued axis.

A trial of a point begins with the final flock of a trial of the previous point, with an
equal replicate number.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sweep.design.points import Points
from sweep.spec import DIRECTION, DOWN, Axis, Study, Values, distinct_rows

FIRST = -1
"""Index of the point before the first link of a chain, where no point exists."""


@dataclass(frozen=True, eq=False)
class Links:
    """Links between the points of a design.

    Attributes
    ----------
    direction : array of str, shape (n_points,)
        "up" or "down".
    before : array of int, shape (n_points,)
        Index of the previous point of the chain, FIRST for the first point. Trials
        begin with the final flocks of the previous point.
    first : array of int, shape (n_points,)
        Index of the first point of the chain.
    number : array of int, shape (n_points,)
        Position in the chain, from 0.
    """

    direction: Values
    before: NDArray[np.int64]
    first: NDArray[np.int64]
    number: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.before)

    def by_number(self) -> Iterator[NDArray[np.int64]]:
        """Yield the points of all first links, then of all second links, and so on."""
        for number in range(int(self.number.max()) + 1):
            yield np.flatnonzero(self.number == number)

    def columns(self) -> dict[str, Values]:
        """Return the direction of each point if chains have both directions."""
        both = len(set(self.direction.tolist())) > 1
        return {DIRECTION: self.direction} if both else {}


def linked(study: Study, axis: Axis, points: Points) -> tuple[Points, Links]:
    """Return the points of all directions of a continued axis, and the links.

    Points with equal values on all other axes are one chain per direction.

    Parameters
    ----------
    study : Study
    axis : Axis
        The continued axis.
    points : Points
        The points of the study, without directions.

    Returns
    -------
    points : Points
        One copy of `points` per direction, one after the other.
    links : Links

    Raises
    ------
    SpecError
        If the number of boids or the world is derived from the axis.
    """
    _check_same(study, axis)
    assert axis.continued
    directions = axis.continued.directions
    count = points.count
    constant = [
        name for other in study.axes if other is not axis for name in other.columns
    ]
    chain = np.zeros(count, np.int64)
    if constant:
        _, chain = distinct_rows([points.column(name) for name in constant])
    every = points.times(len(directions))
    chain = np.tile(chain, len(directions))
    turn = np.repeat(np.arange(len(directions)), count)
    value = every.column(axis.name)
    names = np.array(directions, object)[turn]
    order, begins = _in_order(chain, turn, names, value)
    starts = np.maximum.accumulate(np.where(begins, np.arange(every.count), 0))
    first = np.empty(every.count, np.int64)
    first[order] = order[starts]
    number = np.empty(every.count, np.int64)
    number[order] = np.arange(every.count) - starts
    return every, Links(names, _before(order, begins), first, number)


def before_each(
    chain: NDArray[np.int64],
    turn: NDArray[np.int64],
    direction: Values,
    value: NDArray[np.float64],
) -> NDArray[np.int64]:
    """Return the index of the previous link of the chain, for each of n links.

    Parameters
    ----------
    chain : array of int, shape (n,)
        Number of the chain, from 0.
    turn : array of int, shape (n,)
        Number of the direction within the chain, from 0.
    direction : array of str, shape (n,)
        "up" or "down".
    value : array of float, shape (n,)
        Value of the continued axis.

    Returns
    -------
    array of int, shape (n,)
        FIRST for the first link of a chain.
    """
    return _before(*_in_order(chain, turn, direction, value))


def _in_order(
    chain: NDArray[np.int64],
    turn: NDArray[np.int64],
    direction: Values,
    value: Values,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Return the indices of links, chain after chain, and a mask of chain beginnings.

    The mask refers to the returned order.
    """
    order = np.lexsort((np.where(direction == DOWN, -value, value), turn, chain))
    return order, np.diff(chain[order], prepend=-1) != 0


def _before(order: NDArray[np.int64], begins: NDArray[np.bool_]) -> NDArray[np.int64]:
    before = np.empty(len(order), np.int64)
    before[order] = np.where(begins, FIRST, np.roll(order, 1))
    return before


SAME = ("n", "map", "width", "height")
"""Parameters that must not change within a chain."""


def _check_same(study: Study, axis: Axis) -> None:
    """Raise SpecError if a parameter in SAME is derived from the continued axis."""
    for name in SAME:
        expression = study.derive.get(name)
        if expression and axis.name in _needs(study, expression.names):
            raise study.document.error(
                ("derive", name),
                f"{name} cannot change from link to link, but is derived from the"
                f" continued axis {axis.name}",
            )


def _needs(study: Study, names: Iterable[str]) -> set[str]:
    """Return the parameters `names` and all parameters used in derivations."""
    needs = set[str]()
    pending = [*names]
    while pending:
        name = pending.pop()
        if name not in needs:
            needs.add(name)
            pending += study.derive[name].names if name in study.derive else ()
    return needs
