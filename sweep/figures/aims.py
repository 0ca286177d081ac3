"""Which way a metric is better: coverage+ is to be high, coverage_cv- low."""

from typing import NamedTuple

from sweep.figures.selection import recorded
from sweep.tables.stored_study import StoredStudy

LOW_IS_BETTER = frozenset(
    {
        "boid_collisions",
        "boids_lost",
        "collisions",
        "coverage_cv",
        "dead_ends",
        "escapes",
        "goal_distance",
        "goal_spread",
        "time_to_goal",
    }
)
"""Metrics of which less is better where nothing else is said; of all others more is."""


class Aim(NamedTuple):
    """A metric, and whether high values of it are better."""

    metric: str
    high: bool

    def __str__(self) -> str:
        return f"{'high' if self.high else 'low'} {self.metric.replace('_', ' ')}"


def aim(study: StoredStudy, text: str) -> Aim:
    """The aim that `coverage+`, `coverage_cv-` or a metric alone means. Raises
    ChoiceError for an unknown metric.
    """
    metric = recorded(study, text.rstrip("+-"))
    return Aim(
        metric,
        not text.endswith("-")
        if text[-1:] in ("+", "-")
        else metric.removesuffix("_mean") not in LOW_IS_BETTER,
    )
