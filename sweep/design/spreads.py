"""Requirements of parameters that differ between robots."""

from kernels.robots.readers import potential_of
from sweep.design.points import Points
from sweep.spec import Study


def check_spreads(study: Study, points: Points) -> None:
    """Raise SpecError if a metric needs a pair potential that differs between robots.

    The energy would then belong to no flock.
    """
    model = study.catalogue.models[study.model]
    metrics = [
        name for name in study.record.metrics if study.catalogue.metrics[name].potential
    ]
    if not metrics:
        return
    for name, setting in study.settings.items():
        if setting.spread_of not in potential_of(model):
            continue
        if (points.column(name) > 0.0).any():
            raise study.document.error(
                study.place_of(name) or ("model",),
                f"{name} gives each robot a separate pair potential, but"
                f" {', '.join(metrics)} need a common potential: remove the spread"
                " or these metrics",
            )
