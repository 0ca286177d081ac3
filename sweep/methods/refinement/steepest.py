"""Where the mean of a metric changes most along an axis: a grid that becomes finer
there.

The mean is taken to go one way along the axis, up or down, and its slope to have one
peak, as that of a sigmoid. Let i < j < k be points. If the mean slope from i to j is
surely less than that from j to k, the peak does not lie before i: there the slope would
fall from i to k. If it is surely more, the peak does not lie behind k. So all triples
together leave an interval that has the peak, wherever the intervals of all points hold.

Each look narrows this interval. While it has more than WIDE cells its points, and those
beside it, get more trials; then its cells are halved.
"""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.methods.refinement.rule import (
    Allowed,
    Cell,
    Floats,
    Place,
    RefinedAxis,
    Refinement,
    SeenPoints,
)

WIDE = 4
"""The most cells of an interval that is halved: three are the fewest that triples of
points can tell.
"""


class Peak(NamedTuple):
    """Between which places of a group the mean changes most, and about where.

    It `rises` or falls there; None where the two ends of the axis are not known to
    differ. `several` says that the triples contradict each other: the slope has several
    peaks, or an interval does not hold.
    """

    group: int
    low: int
    high: int
    estimate: float
    rises: bool | None
    several: bool


def remaining(x: Floats, low: Floats, high: Floats) -> tuple[int, int] | None:
    """The first and the last of the points between which the slope of a rising mean can
    have its peak, by the bounds of the means at ascending `x`, (P,) each; None where
    there is no such place.
    """
    first, last = 0, len(x) - 1
    for j in range(1, last):
        before, behind = x[j] - x[:j], x[j + 1 :] - x[j]
        # (P of i, P of k): the mean slope behind j less that before it.
        least = ((low[j + 1 :] - high[j]) / behind)[None, :] - (
            (high[j] - low[:j]) / before
        )[:, None]
        most = ((high[j + 1 :] - low[j]) / behind)[None, :] - (
            (low[j] - high[:j]) / before
        )[:, None]
        grows, falls = (least > 0.0).any(axis=1), (most < 0.0).any(axis=0)
        first = max([first, *np.flatnonzero(grows).tolist()])
        last = min([last, *(j + 1 + np.flatnonzero(falls)).tolist()])
    return (first, last) if first < last else None


def peaks(rule: Refinement, places: Sequence[Place], seen: SeenPoints) -> list[Peak]:
    """The peak of each group, in their order. Points with fewer than two values are
    left out, and so is a group with fewer than two others.
    """
    (scale,) = rule.scales.values()
    order = sorted(range(len(places)), key=places.__getitem__)
    known = [one for one in order if seen.values[one] > 1]
    groups = dict.fromkeys(places[one][0] for one in known)
    found = []
    for group in groups:
        rows = np.array([one for one in known if places[one][0] == group], np.int64)
        if len(rows) > 1:
            at = [places[one][1] for one in rows]
            found.append(_peak(scale, group, at, seen, rows))
    return found


def _peak(
    scale: RefinedAxis,
    group: int,
    at: list[int],
    seen: SeenPoints,
    rows: NDArray[np.int64],
) -> Peak:
    values = np.array([scale.at(place) for place in at])
    x = np.log(values) if scale.geometric else values
    low, high, mean = seen.low[rows], seen.high[rows], seen.mean[rows]
    rises = True if low[-1] > high[0] else False if high[-1] < low[0] else None
    if rises is False:
        low, high, mean = -high, -low, -mean
    left = None if rises is None else remaining(x, low, high)
    first, last = left or (0, len(at) - 1)
    slopes = np.diff(mean[first : last + 1]) / np.diff(x[first : last + 1])
    if rises is None:
        slopes = np.abs(slopes)
    steepest = first + int(np.argmax(slopes))
    middle = float(x[steepest] + x[steepest + 1]) / 2.0
    estimate = float(np.exp(middle)) if scale.geometric else middle
    several = rises is not None and left is None
    return Peak(group, at[first], at[last], estimate, rises, several)


def next_trials(
    rule: Refinement,
    groups: int,  # noqa: ARG001  as of other rules
    trials: Mapping[Place, int],
    seen: SeenPoints,
    allowed: Allowed,
) -> dict[Place, int]:
    """How many trials points get from now on, by place; see `next_trials` of
    `sweep.methods.refinement.rule`. Nothing for a group whose peak is known as well as
    it is asked for, or whose points have had their last trials.
    """
    left = rule.budget - sum(trials.values())
    asked = dict[Place, int]()
    further = dict(zip(trials, seen.further.tolist(), strict=True))
    for one in peaks(rule, [*trials], seen):
        line = sorted(place for place in trials if place[0] == one.group)
        first, last = (line.index((one.group, at)) for at in (one.low, one.high))
        if last - first > WIDE or one.rises is None or one.several:
            near = line[max(first - 1, 0) : last + 2]
            wanted = {place: further[place] for place in near}
        else:
            wanted = dict.fromkeys(_halves(rule, line[first : last + 1]), rule.least)
            if not {*wanted} <= {*allowed([*wanted])}:
                wanted = {}
        more = {place: n for place, n in wanted.items() if n > trials.get(place, 0)}
        cost = sum(n - trials.get(place, 0) for place, n in more.items())
        if cost <= left:
            asked |= more
            left -= cost
    return asked


def _halves(rule: Refinement, line: Sequence[Place]) -> list[Place]:
    """The points that halve the cells between neighbouring ones."""
    cells = (Cell(low, high) for low, high in pairwise(line))
    return [part.high for cell in cells for part in cell.parts(rule)[:1]]
