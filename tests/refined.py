"""Made-up studies that are refined, without trials."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from sweep.analysis.mean_bounds import Distribution
from sweep.methods.refinement import steepest
from sweep.methods.refinement.rule import (
    Place,
    RefinedAxis,
    Refinement,
    SeenPoints,
    first_cells,
    look,
    next_trials,
)

Floats = NDArray[np.float64]
Draw = Callable[[tuple[float, ...], int], Sequence[float]]
"""Draws so many values at the point with these settings."""


def rule(
    scales: Mapping[str, RefinedAxis],
    *,
    at: float | str = 0.5,
    until: float = 0.02,
    least: int = 3,
    most: int = 30,
    budget: int = 100_000,
) -> Refinement:
    """A rule with usual numbers."""
    return Refinement("m", at, scales, until, least, most, budget, 0.95)


def line(
    values: Sequence[float], until: float, *, geometric: bool = False
) -> RefinedAxis:
    """A scale of numbers that need not be integers."""
    return RefinedAxis.until(values, until, geometric=geometric, integer=False)


def settings(asked: Refinement, place: Place) -> tuple[float, ...]:
    """The values of the refined axes at a place."""
    scales = asked.scales.values()
    return tuple(scale.at(at) for scale, at in zip(scales, place[1:], strict=True))


def refined(
    asked: Refinement, draw: Draw, groups: int = 1, of: Distribution = "normal"
) -> tuple[dict[Place, int], SeenPoints]:
    """The trials of all points when nothing more is asked for, and what is seen."""
    first = {corner for cell in first_cells(asked, groups) for corner in cell.corners}
    trials = dict.fromkeys(sorted(first), asked.least)
    values = {place: [*draw(settings(asked, place), asked.least)] for place in trials}
    while True:
        counts = np.array([*trials.values()], np.int64)
        flat = [value for place in trials for value in values[place]]
        seen = look(asked, counts, flat, of)
        following = steepest.next_trials if asked.steepest else next_trials
        more = following(asked, groups, trials, seen, lambda places: places)
        if not more:
            return trials, seen
        for place, number in more.items():
            had = values.setdefault(place, [])
            had += draw(settings(asked, place), number - len(had))
        trials = dict(sorted((trials | more).items()))
