"""What the settings of motors and breakdowns must fulfil together, and with a model."""

import sys

import numpy as np

from kernels.lanes.calls import drives
from kernels.settings import Demand
from sweep.design.points import Points
from sweep.spec.expressions import parse
from sweep.spec.study import Study

MOTOR_DEMANDS = (
    Demand(
        "motor_min_speed <= motor_max_speed",
        "motor_min_speed is above motor_max_speed",
    ),
    Demand(
        "failing_share == 0 or failing_time < steps * dt",
        "failing_time is not before the end of a trial, steps * dt, and no boid fails",
    ),
)
LIMITS = "motor_acceleration", "motor_turn_rate", "motor_max_speed"
LIMITED = " or ".join(f"{name} <= {sys.float_info.max!r}" for name in LIMITS)
ACT = {
    "motor_lag": "motor_lag > 0",
    **{name: f"{name} <= {sys.float_info.max!r}" for name in LIMITS},
    "motor_min_speed": "motor_min_speed > 0",
    "motor_noise": "motor_noise > 0",
    "wheels": "wheels",
    "failing_share": (
        "failing_share > 0 and (failing_how == 'stop' or failing_how == 'drift')"
    ),
}
"""When a setting makes a boid move otherwise than its model wants."""
NEEDS = {
    "failing_time": ("failing_share > 0", "failing_share is 0"),
    "failing_how": ("failing_share > 0", "failing_share is 0"),
    "motor_spread": (
        f"motor_lag > 0 or motor_min_speed > 0 or {LIMITED}",
        "there is no lag and no limit, of which each robot could have its own",
    ),
}
"""What makes a setting matter, and what to say where it does not at any point."""
LINE = "vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)"
MENDED = (
    f"add `{LINE}` to its `advance`, before `confine`, and `from"
    " kernels.robots.actuation import drive`"
)
"""What lets the boids of a model have motors."""


def check_motors(study: Study, points: Points) -> None:
    """Raise SpecError for settings that matter at no point, and for motors of a model
    that does not drive its boids.
    """
    for name, (condition, why) in NEEDS.items():
        if study.place_of(name) and not _holds(study, points, condition).any():
            place = study.place_of(name) or ("model",)
            raise study.document.error(place, f"{name} has no effect: {why}")
    model = study.known.models[study.model]
    if drives(model.advance):
        return
    for name, condition in ACT.items():
        holds = _holds(study, points, condition)
        if holds.any():
            where = points.describe(int(np.argmax(holds)), [name])
            raise study.document.error(
                study.place_of(name) or ("model",),
                f"{name} is for models that drive their boids, and {study.model} does"
                f" not: {MENDED}{where}",
            )


def _holds(study: Study, points: Points, text: str) -> np.ndarray:
    """At which points a condition holds."""
    place = ("model",)
    return points.evaluate(study, parse(text, study.settings), place)
