"""Requirements of the wind on parameters, and on the model whose boids it carries."""

from kernels.settings import Demand, Medium
from sweep.design.points import Points
from sweep.design.published_steps import check_published
from sweep.spec import Study

MOST_GUSTS = 10
"""Bound of a gust in standard deviations.

A normal number is beyond it with a probability below 1e-22.
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
        f"wind and a gust of {MOST_GUSTS} standard deviations carry a boid farther in"
        " one step than the world is wide or high, and its border acts once in a step",
    ),
)


def check_medium(study: Study, points: Points) -> None:
    """Raise SpecError if there is wind, and the model does not let it carry boids."""
    for name in Medium._fields:
        if name != "gust_time" and (points.column(name) != 0.0).any():
            check_published(study, name, "that lets the medium carry its boids")
