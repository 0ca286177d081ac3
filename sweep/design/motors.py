"""Requirements of motors and failures on parameters, and on the model."""

import numpy as np
from numpy.typing import NDArray

from kernels.robots.abilities import remedy, why_not
from kernels.settings import Demand
from sweep.design.points import Points
from sweep.design.published_steps import check_published
from sweep.spec import Study

MOTOR_DEMANDS = (
    Demand(
        "motor_min_speed <= motor_max_speed",
        "motor_min_speed is above motor_max_speed",
    ),
    Demand(
        "failing_share == 0 or failing_time < steps * dt",
        "failing_time is not before the end of a trial, steps * dt: no boid fails",
    ),
)
LIMITS = "motor_acceleration", "motor_turn_rate", "motor_max_speed"
LINE = "vx, vy = drive(work, i, flock.vx[i], flock.vy[i], vx, vy)"
Mask = NDArray[np.bool_]


def check_motors(study: Study, points: Points) -> None:
    """Raise SpecError if the model does not support the motors or failures of boids.

    A model with motors, or with boids that stop or drift, must call `drive`.
    """
    fails = points.column("failing_share") > 0.0
    _check_model(study, _acting(points), fails)


def _acting(points: Points) -> dict[str, Mask]:
    """Return masks of the points where a parameter changes the commanded velocity.

    There is one mask per parameter, of shape (n_points,).
    """
    above = {
        name: points.column(name) > 0.0
        for name in ("motor_lag", "motor_min_speed", "motor_noise", "wheels")
    }
    below = {name: ~np.isinf(points.column(name)) for name in LIMITS}
    stray = np.isin(points.column("failing_how"), ("stop", "drift"))
    return (
        above | below | {"failing_share": stray & (points.column("failing_share") > 0)}
    )


def _check_model(study: Study, act: dict[str, Mask], fails: Mask) -> None:
    """Raise SpecError for motors and failures that the model's kernel ignores."""
    model = study.catalogue.models[study.model]
    needed = {name: on.any() for name, on in act.items()}
    if any(needed.values()) and (why := why_not(model, "drives")):
        change = remedy(model, "drives", f"before confine write `{LINE}`")
        for name in filter(needed.get, needed):
            raise study.document.error(
                study.place_of(name) or ("model",),
                f"{name} needs a model that drives its boids, but {why}: {change};"
                " see docs/own-models.md",
            )
    needed["failing_share"] = fails.any()
    for name in filter(needed.get, needed):
        check_published(study, name, "that counts its steps")
