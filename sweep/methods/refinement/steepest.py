"""A grid that becomes finer where the mean of a metric changes most along an axis.

The mean is assumed to be monotonic along the axis, and the slope to have one peak, such
as the slope of a sigmoid. Let i < j < k be points, with the mean slopes a from i to j
and b from j to k. If a < b is known, the peak is not before i: there the slope would
fall from i to k. If a > b is known, the peak is not after k. So all triples together
leave an interval with the peak, if the confidence intervals of all points hold.

Each look narrows this interval. While the interval has more than WIDE cells, its points
and their neighbours get more trials. Then its cells are halved.
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
"""Most cells of an interval that is halved; triples of points leave at least three."""


class Peak(NamedTuple):
    """The position in a group at which the mean changes most.

    Attributes
    ----------
    group : int
    low, high : int
        Positions that bound the interval of the peak.
    estimate : float
        The estimated value of the axis at the peak.
    rises : bool or None
        True if the mean rises along the axis, False if the mean falls. None if the two
        ends of the axis are not known to differ.
    several : bool
        True if triples contradict each other: the slope has several peaks, or a
        confidence interval does not hold.
    """

    group: int
    low: int
    high: int
    estimate: float
    rises: bool | None
    several: bool


def remaining(x: Floats, low: Floats, high: Floats) -> tuple[int, int] | None:
    """Return the points between which the slope of a rising mean can have its peak.

    Parameters
    ----------
    x : array
        Values of the axis, ascending, (P,).
    low, high : array
        Bounds of the means at `x`, (P,) each.

    Returns
    -------
    tuple of int or None
        Numbers of the first and the last point; None if no position of the peak
        remains.
    """
    first = 0
    last = len(x) - 1
    for j in range(1, last):
        before = x[j] - x[:j]
        after = x[j + 1 :] - x[j]
        # (P of i, P of k): the mean slope after j minus the mean slope before it.
        least = ((low[j + 1 :] - high[j]) / after)[None, :] - (
            (high[j] - low[:j]) / before
        )[:, None]
        most = ((high[j + 1 :] - low[j]) / after)[None, :] - (
            (low[j] - high[:j]) / before
        )[:, None]
        grows = (least > 0.0).any(axis=1)
        falls = (most < 0.0).any(axis=0)
        first = max([first, *np.flatnonzero(grows).tolist()])
        last = min([last, *(j + 1 + np.flatnonzero(falls)).tolist()])
    return (first, last) if first < last else None


def peaks(
    rule: Refinement, places: Sequence[Place], observed: SeenPoints
) -> list[Peak]:
    """Return the peak of each group, in the order of groups.

    Parameters
    ----------
    rule : Refinement
        A rule with one axis.
    places : sequence of Place
        Positions of the points, in any order.
    observed : SeenPoints
        The last look, in the order of `places`. Points with fewer than two values do
        not count.

    Returns
    -------
    list of Peak
        Without groups in which fewer than two points count.
    """
    (scale,) = rule.scales.values()
    order = sorted(range(len(places)), key=places.__getitem__)
    replicated = [point for point in order if observed.values[point] > 1]
    groups = dict.fromkeys(places[point][0] for point in replicated)
    of_groups = []
    for group in groups:
        in_group = [point for point in replicated if places[point][0] == group]
        if len(in_group) > 1:
            at = [places[point][1] for point in in_group]
            rows = np.array(in_group, np.int64)
            of_groups.append(_peak(scale, group, at, observed, rows=rows))
    return of_groups


def _peak(
    scale: RefinedAxis,
    group: int,
    at: list[int],
    observed: SeenPoints,
    rows: NDArray[np.int64],
) -> Peak:
    values = np.array([scale.at(place) for place in at])
    x = np.log(values) if scale.geometric else values
    low = observed.low[rows]
    high = observed.high[rows]
    mean = observed.mean[rows]
    rises = True if low[-1] > high[0] else False if high[-1] < low[0] else None
    left = None
    if rises:
        left = remaining(x, low, high)
    elif rises is False:
        # A falling mean, negated, rises. The bounds swap.
        mean = -mean
        left = remaining(x, -high, -low)
    first, last = left or (0, len(at) - 1)
    slopes = np.diff(mean[first : last + 1]) / np.diff(x[first : last + 1])
    if rises is None:
        slopes = np.abs(slopes)
    steepest = first + int(np.argmax(slopes))
    middle = float(x[steepest] + x[steepest + 1]) / 2.0
    estimate = float(np.exp(middle)) if scale.geometric else middle
    several = rises is not None and left is None
    return Peak(
        group=group,
        low=at[first],
        high=at[last],
        estimate=estimate,
        rises=rises,
        several=several,
    )


def next_trials(
    rule: Refinement,
    groups: int,  # noqa: ARG001  as of other rules
    trials: Mapping[Place, int],
    observed: SeenPoints,
    allowed: Allowed,
) -> dict[Place, int]:
    """Return the next number of trials of points that get trials.

    As `next_trials` of `sweep.methods.refinement.rule`, with peaks in place of
    crossings.

    Parameters
    ----------
    rule : Refinement
        A rule with one axis.
    groups : int
        Not used.
    trials : mapping
        Present number of trials by position.
    observed : SeenPoints
        The last look at the points, in the order of `trials`.
    allowed : callable
        Selects the new points that the study can have, see `Allowed`.

    Returns
    -------
    dict
        Numbers of trials by position. Empty for a group whose peak is as precise as the
        rule demands, or whose points have had their last trials.
    """
    left = rule.budget - sum(trials.values())
    requested = dict[Place, int]()
    further = dict(zip(trials, observed.further.tolist(), strict=True))
    for peak in peaks(rule, [*trials], observed):
        line = sorted(place for place in trials if place[0] == peak.group)
        first, last = (line.index((peak.group, at)) for at in (peak.low, peak.high))
        if last - first > WIDE or peak.rises is None or peak.several:
            near = line[max(first - 1, 0) : last + 2]
            counts = {place: further[place] for place in near}
        else:
            counts = dict.fromkeys(_halves(rule, line[first : last + 1]), rule.least)
            if not {*counts} <= {*allowed([*counts])}:
                counts = {}
        more = {place: n for place, n in counts.items() if n > trials.get(place, 0)}
        cost = sum(n - trials.get(place, 0) for place, n in more.items())
        if cost <= left:
            requested |= more
            left -= cost
    return requested


def _halves(rule: Refinement, line: Sequence[Place]) -> list[Place]:
    """Return the points that halve the cells between neighbouring points."""
    cells = (Cell(low, high) for low, high in pairwise(line))
    return [part.high for cell in cells for part in cell.parts(rule)[:1]]
