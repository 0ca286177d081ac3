"""The scene message: the world of a trial as a page draws it."""

from typing import Any

import numpy as np

from sweep.design.jobs import Job
from sweep.trial.robots import failures_of
from sweep.trial.world import world_of
from sweep.web.protocol import Reply


def scene_of(job: Job) -> Reply:
    """The world in which the trial of `job` runs. The goal of a model with a rule that
    goes there is drawn also where its weight is 0.
    """
    world, model, settings = world_of(job), job.known.models[job.model], job.settings
    goal = [float(settings[name]) for name in ("goal_x", "goal_y", "goal_radius")]
    return {
        "type": "scene",
        "width": world.width,
        "height": world.height,
        "borders": str(settings["borders"]),
        "length": model.length,
        "time": model.time,
        "downwards": model.y_down,
        "obstacles": world.obstacles.tolist(),
        "goal": goal if any(rule.to_goal for rule in model.rules) else None,
        "kinds": list(map(list, world.kinds.items())),
        "failing": _failing(job),
    }


def _failing(job: Job) -> dict[str, Any] | None:
    """How boids fail, and each that does with the step from which on it has failed;
    None where none does.
    """
    how, boids, steps = failures_of(job)
    if not boids.size:
        return None
    return {"how": how, "boids": np.stack([boids, steps], axis=1).tolist()}
