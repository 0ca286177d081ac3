"""Differences between the boids of a point and ideal boids, and the medium."""

from collections.abc import Iterator, Mapping

from kernels.catalogue import Catalogue
from kernels.settings import ROBOT_GROUPS, RobotSettings, Spread
from sweep.spec import Settings, Value, settings_of, settings_tuple


def robots_at(
    model: str, catalogue: Catalogue, settings: Mapping[str, Value]
) -> RobotSettings:
    """Return the differences between the boids of a trial and ideal boids.

    Parameters
    ----------
    model : str
    catalogue : Catalogue
        Models, metrics, maps and starts by name.
    settings : mapping
        All parameters of the trial.

    Returns
    -------
    RobotSettings
        Sensing, actuation, failures, medium and variability.
    """
    described = settings_of(model, catalogue)
    values = dict(settings)
    sensing, actuation, breakdowns, medium = (
        settings_tuple(group, values, described) for group in ROBOT_GROUPS
    )
    spreads = tuple(_spreads(values, described))
    return RobotSettings(sensing, actuation, breakdowns, medium, spreads=spreads)


def _spreads(settings: dict[str, Value], described: Settings) -> Iterator[Spread]:
    """Yield the variability of model parameters between robots."""
    for name in sorted(settings.keys() - described):
        parameter = described[described.spreads[name].spread_of]
        deviation = float(settings[name])
        yield Spread(parameter.name, deviation, parameter.low, parameter.high)
