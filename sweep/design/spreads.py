"""What goes with parameters that differ from robot to robot."""

from kernels.robots.readers import potential_of
from sweep.design.points import Points
from sweep.spec.study import Study


def check_spreads(study: Study, points: Points) -> None:
    """Raise SpecError where a pair potential is recorded which is another for each
    robot: its energy would be that of no flock.
    """
    model = study.known.models[study.model]
    metrics = [
        name for name in study.record.metrics if study.known.metrics[name].potential
    ]
    if not metrics:
        return
    for name, setting in study.settings.items():
        if setting.spread_of not in potential_of(model):
            continue
        if (points.column(name) > 0.0).any():
            raise study.document.error(
                study.place_of(name) or ("model",),
                f"{name} gives each robot a pair potential of its own, and"
                f" {', '.join(metrics)} need one of all: leave out one of the two",
            )
