"""The scene message: the world of a trial as a page draws it."""

from sweep.design.jobs import Job
from sweep.spec.settings import places_of
from sweep.trial.world import world_of
from sweep.web.protocol import Reply


def scene_of(job: Job) -> Reply:
    """The world in which the trial of `job` runs. The goal of a model with a rule that
    goes there is drawn also where its weight is 0.
    """
    world, model, settings = world_of(job), job.known.models[job.model], job.settings
    sought = any(rule.to_goal for rule in model.rules)
    goal = [float(settings[name]) for name in ("goal_x", "goal_y", "goal_radius")]
    later = places_of(settings["next_goals"]) or ()
    return {
        "type": "scene",
        "width": world.width,
        "height": world.height,
        "borders": str(settings["borders"]),
        "length": model.length,
        "time": model.time,
        "downwards": model.y_down,
        "obstacles": world.obstacles.tolist(),
        "goal": goal if sought else None,
        "next_goals": list(map(list, later)) if sought else [],
        "kinds": list(map(list, world.kinds.items())),
    }
