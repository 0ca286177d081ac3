"""The scene message: the world of a trial as a page draws it."""

from sweep.design.jobs import Job
from sweep.spec.polygons import polygon_as_written
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
        "obstacles": [
            [*row, polygon_as_written(world.polygons[number])]
            if number in world.polygons
            else row
            for number, row in enumerate(world.obstacles.tolist())
        ],
        "paths": world.paths
        and world.paths._asdict() | {"velocities": world.paths.velocities.tolist()},
        "goal": goal if any(rule.to_goal for rule in model.rules) else None,
        "kinds": list(map(list, world.kinds.items())),
    }
