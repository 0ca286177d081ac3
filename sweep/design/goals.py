"""Requirements of several goals: positions in the world, and a suitable model."""

from kernels.robots.abilities import remedy, why_not
from sweep.design.points import Points
from sweep.spec import Study, places_of

SETTING = "next_goals"
LINE = "goal_x, goal_y = goal_of(world, work.goals, i)"


def check_goals(study: Study, points: Points) -> None:
    """Raise SpecError if several goals do not fit the model or the world.

    The model must take the goal of each boid from `goal_of`. All goals must be inside
    the world.
    """
    texts = points.column(SETTING)
    if not any(texts):
        return
    model = study.catalogue.models[study.model]
    place = study.place_of(SETTING)
    if why := why_not(model, "goals_in_turn"):
        call = (
            f"in a rule that leads boids to the goal write `{LINE}` for world.goal_x"
            " and world.goal_y"
        )
        raise study.document.error(
            place or ("model",),
            f"{SETTING} needs a model that goes to several goals, but {why}:"
            f" {remedy(model, 'goals_in_turn', call)}; see docs/own-models.md",
        )
    width = points.column("width")
    height = points.column("height")
    for point, text in enumerate(texts):
        for number, (x, y) in enumerate(places_of(text) or (), start=2):
            if not (0.0 <= x <= width[point] and 0.0 <= y <= height[point]):
                where = points.describe(point, ("width", "height"))
                raise study.document.error(
                    place or ("model",),
                    f"goal {number}, at ({x:.12g}, {y:.12g}) in {SETTING}, is outside"
                    f" the world{where}",
                )
