"""Whether the boids of a trial are ideal ones, and their keys of random numbers."""

from collections.abc import Iterator

from kernels.chance import ChanceKey
from kernels.robots.robots import ChanceKeys, is_ideal
from kernels.settings import Actuation, Breakdowns, RobotSettings, Sensing, Spread
from sweep.design.jobs import Job, stream
from sweep.spec.settings import Settings, settings_of, settings_tuple


def robots_of(job: Job) -> RobotSettings:
    """In what the boids of a job differ from ideal ones."""
    known = settings_of(job.model, job.known)
    sensing, actuation, breakdowns = (
        settings_tuple(group, job.settings, known)
        for group in (Sensing, Actuation, Breakdowns)
    )
    spreads = tuple(_spreads(job, known))
    return RobotSettings(sensing, actuation, breakdowns, spreads)


def _spreads(job: Job, known: Settings) -> Iterator[Spread]:
    """By how much parameters of the model differ from robot to robot."""
    for name in sorted(job.settings.keys() - known):
        parameter = known[known.spreads[name].spread_of]
        deviation = float(job.settings[name])
        yield Spread(parameter.name, deviation, parameter.low, parameter.high)


def has_robots(job: Job) -> bool:
    """Whether boids are not ideal ones. Such trials fly alone, with one thread."""
    return not is_ideal(robots_of(job), float(job.settings["dt"]))


def keys_of(job: Job) -> ChanceKeys:
    """The keys of what is random about the robots of a trial."""
    made, flown = (stream(job, purpose) for purpose in ("made", "flown"))
    return ChanceKeys(
        *(ChanceKey(*map(int, one.generate_state(2))) for one in (made, flown))
    )
