"""The scene message: the world of a trial, for the drawing of a page."""

from typing import Any

import numpy as np

from sweep.design import Job
from sweep.spec import polygon_as_written
from sweep.trial import failures_of, world_of
from sweep.web.protocol import Reply


def scene_of(job: Job) -> Reply:
    """Return the scene message of the world in which a trial runs.

    The goals are those that boids seek: none where the weight of the rule is 0.
    """
    world = world_of(job)
    model = job.catalogue.models[job.model]
    settings = job.settings
    return {
        "type": "scene",
        "width": world.width,
        "height": world.height,
        "borders": str(settings["borders"]),
        "length": model.length,
        "time": model.time,
        "downwards": model.y_down,
        "obstacles": [
            [*row, polygon_as_written(world.polygons[number])]
            if number in world.polygons
            else row
            for number, row in enumerate(world.obstacles.tolist())
        ],
        "paths": world.paths
        and world.paths._asdict() | {"velocities": world.paths.velocities.tolist()},
        "goal": world.goal and list(world.goal),
        "next_goals": list(map(list, world.next_goals)),
        "kinds": list(map(list, world.kinds.items())),
        "failing": _failing(job),
    }


def _failing(job: Job) -> dict[str, Any] | None:
    """Return the kind of failure, and each failing boid with the step of the failure.

    Return None where no boid fails.
    """
    how, boids, steps = failures_of(job)
    if not boids.size:
        return None
    return {"how": how, "boids": np.stack([boids, steps], axis=1).tolist()}
