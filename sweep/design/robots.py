"""In what the boids of a point differ from ideal ones."""

from collections.abc import Mapping

from kernels.catalogue import Catalogue
from kernels.robots.robots import is_ideal
from kernels.settings import Actuation, Breakdowns, RobotSettings, Sensing
from sweep.spec.settings import Value, settings_of, settings_tuple


def robots_at(
    model: str, known: Catalogue, settings: Mapping[str, Value]
) -> RobotSettings:
    """In what the boids of a trial with these settings differ from ideal ones."""
    described = settings_of(model, known)
    return RobotSettings(
        *(
            settings_tuple(group, dict(settings), described)
            for group in (Sensing, Actuation, Breakdowns)
        )
    )


def are_robots(model: str, known: Catalogue, settings: Mapping[str, Value]) -> bool:
    """Whether boids are not ideal ones. Such trials fly alone, with one thread."""
    return not is_ideal(robots_at(model, known, settings), float(settings["dt"]))
