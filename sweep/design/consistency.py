"""What settings must fulfil together, in every study."""

import math
from typing import NamedTuple

import numpy as np

from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.settings import MOST_CELLS
from sweep.design.points import SIDES, Points
from sweep.spec.expressions import parse
from sweep.spec.study import RecordSpec, Study

MOST_SIDE = 1e15
MOST_PIXELS = 10**8
MOST_LOOKS = 10**6
"""Places on all paths that one boid looks along in one step; the published settings
have about sixty.
"""


class Demand(NamedTuple):
    """A condition on the settings of every point, and what its error says."""

    condition: str
    message: str


DEMANDS = (
    Demand(
        f"max(width, height) <= {MOST_SIDE}",
        f"the world is larger than {MOST_SIDE:g},"
        " where positions have no decimals any more",
    ),
    Demand(
        "2 * start_margin < min(width, height)",
        "start_margin leaves boids no room:"
        " it must be less than half of width and of height",
    ),
    Demand(
        "map != 'random_obstacles' or n_obstacles == 0 or 2 * obstacle_margin <="
        " min(width, height)",
        "obstacle_margin leaves obstacles no room:"
        " it must be at most half of width and of height",
    ),
    Demand(
        "start_draws == 'numpy' or start_radius == 0",
        "start_draws: python_random draws in the whole world: it needs start_radius 0",
    ),
    Demand(
        "start_radius == 0 or start_margin <= start_center_x <= width - start_margin"
        " and start_margin <= start_center_y <= height - start_margin",
        "the centre of the start lies outside the world, or in its start_margin",
    ),
    Demand(
        "not minimum_image or borders == 'torus'",
        "minimum_image is for a torus: it needs borders: torus",
    ),
)
PIXELS = (
    Demand(
        f"width / pixel * (height / pixel) <= {MOST_PIXELS}",
        "coverage is counted by pixels,"
        f" and the world has more than {MOST_PIXELS:,} of them",
    ),
    Demand(
        "pixel <= min(width, height)",
        "coverage is counted by pixels, and the world has no room for one",
    ),
)
GOAL = Demand(
    "0 <= goal_x <= width and 0 <= goal_y <= height",
    "the goal lies outside the world, and what is recorded is about the goal",
)
GOAL_METRICS = ("goal_distance", "goal_spread", "share_arrived", "time_to_goal")
SPEEDS = Demand(
    "min_speed <= max_speed", "the lower limit of the speed is above the upper one"
)
POTENTIAL = (
    "the pair potential that is recorded needs a separation_range within that of"
    " cohesion"
)
LOOKING = (
    Demand(
        "obstacle_weight == 0 or 2 * path_step <= look_ahead",
        "no point of a path is looked at: look_ahead must be at least twice path_step",
    ),
    Demand(
        f"obstacle_weight == 0 or angle_step <= {math.pi}",
        "no other heading is looked at: angle_step must be at most pi",
    ),
    Demand(
        f"obstacle_weight == 0 or {2 * math.pi} * look_ahead <= {MOST_LOOKS} *"
        " angle_step * path_step",
        f"more than {MOST_LOOKS:,} places would be looked at by each boid: angle_step"
        " or path_step is too small, or look_ahead too large",
    ),
)
CELLS = Demand(
    f"ceil(width / grid_cell) * ceil(height / grid_cell) <= {MOST_CELLS}",
    f"the occupancy grid would have more than {MOST_CELLS:,} cells",
)


def check_consistency(study: Study, points: Points) -> None:
    """Raise SpecError for the first point whose settings do not go together."""
    pixels = PIXELS if _covers(study.record) else ()
    goal = [GOAL] if set(GOAL_METRICS) & set(study.record.metrics) else []
    looking = [CELLS, *LOOKING] if MODELS[study.model].occupancy else []
    speeds = [SPEEDS] if "min_speed" in study.fields else []
    for demand in (*DEMANDS, *pixels, *goal, *looking, *speeds, *_potential(study)):
        condition = parse(demand.condition, study.fields)
        # The map last: it brings its width and height.
        named = [
            *sorted(condition.names),
            *(["map"] if condition.names & set(SIDES) else []),
        ]
        place = next(filter(None, map(study.place_of, named)), None)
        holds = points.evaluate(study, condition, place or ("model",))
        if not holds.all():
            where = points.describe(int(np.argmin(holds)), condition.names)
            raise study.document.error(place or ("model",), demand.message + where)


def _potential(study: Study) -> list[Demand]:
    """What the metrics of a pair potential ask: cohesion has a range of its own, or
    that of perception.
    """
    if not any(METRICS[name].potential for name in study.record.metrics):
        return []
    cohesion = (
        "cohesion_range" if "cohesion_range" in study.fields else "perception_range"
    )
    return [Demand(f"separation_range <= {cohesion}", POTENTIAL)]


def _covers(record: RecordSpec) -> bool:
    return record.heatmaps or any(METRICS[name].covers for name in record.metrics)
