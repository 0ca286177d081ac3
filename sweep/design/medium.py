"""Requirements of the wind on parameters and on the model."""

from kernels.settings import Demand, Medium
from sweep.design.points import Points
from sweep.design.published_steps import check_published
from sweep.spec import Study

MOST_GUSTS = 10
"""Bound of a gust in standard deviations.

A normal number exceeds the bound with a probability below 1e-22.
"""
MOST_WIND = 1e15
MEDIUM_DEMANDS = (
    Demand(
        f"-{MOST_WIND} <= wind_x <= {MOST_WIND} and -{MOST_WIND} <= wind_y <="
        f" {MOST_WIND} and gust <= {MOST_WIND}",
        "wind and gusts must be finite",
    ),
    Demand(
        f"borders == 'open' or (abs(wind_x) + {MOST_GUSTS} * gust) * dt <= width and"
        f" (abs(wind_y) + {MOST_GUSTS} * gust) * dt <= height",
        f"wind and a gust of {MOST_GUSTS} standard deviations move a boid in one step"
        " by more than the size of the world (reduce wind_x, wind_y, gust or dt)",
    ),
)


def check_medium(study: Study, points: Points) -> None:
    """Raise SpecError if there is wind, and the model does not support wind."""
    for name in Medium._fields:
        if name != "gust_time" and (points.column(name) != 0.0).any():
            check_published(study, name, "that lets the wind carry boids")
