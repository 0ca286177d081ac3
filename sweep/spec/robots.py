"""In what the boids of a trial differ from ideal ones, by its settings."""

from collections.abc import Iterator

from kernels.settings import (
    Actuation,
    Breakdowns,
    Medium,
    RobotSettings,
    Sensing,
    Spread,
)
from sweep.spec.settings import Settings, Value, settings_tuple


def robot_settings(settings: dict[str, Value], known: Settings) -> RobotSettings:
    """In what boids and their medium differ from ideal ones; `known` are those of
    their model.
    """
    return RobotSettings(
        settings_tuple(Sensing, settings, known),
        settings_tuple(Actuation, settings, known),
        settings_tuple(Breakdowns, settings, known),
        settings_tuple(Medium, settings, known),
        tuple(_spreads(settings, known)),
    )


def _spreads(settings: dict[str, Value], known: Settings) -> Iterator[Spread]:
    """By how much parameters of the model differ from robot to robot."""
    for name in sorted(settings.keys() - known):
        parameter = known[known.spreads[name].spread_of]
        deviation = float(settings[name])
        yield Spread(parameter.name, deviation, parameter.low, parameter.high)
