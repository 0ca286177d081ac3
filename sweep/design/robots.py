"""In what the boids of a point differ from ideal ones, and their medium."""

from collections.abc import Iterator, Mapping

from kernels.catalogue import Catalogue
from kernels.settings import ROBOT_GROUPS, RobotSettings, Spread
from sweep.spec.settings import Settings, Value, settings_of, settings_tuple


def robots_at(
    model: str, known: Catalogue, settings: Mapping[str, Value]
) -> RobotSettings:
    """In what the boids of a trial with these settings differ from ideal ones."""
    described, given = settings_of(model, known), dict(settings)
    sensing, actuation, breakdowns, medium = (
        settings_tuple(group, given, described) for group in ROBOT_GROUPS
    )
    spreads = tuple(_spreads(given, described))
    return RobotSettings(sensing, actuation, breakdowns, medium, spreads)


def _spreads(settings: dict[str, Value], known: Settings) -> Iterator[Spread]:
    """By how much parameters of the model differ from robot to robot."""
    for name in sorted(settings.keys() - known):
        parameter = known[known.spreads[name].spread_of]
        deviation = float(settings[name])
        yield Spread(parameter.name, deviation, parameter.low, parameter.high)
