"""Whether the boids of a trial are ideal ones, which of them fail, and their keys of
random numbers.
"""

from kernels.chance import ChanceKey
from kernels.robots.breakdowns import Failing, failing
from kernels.robots.robots import ChanceKeys, is_ideal
from kernels.settings import RobotSettings
from sweep.design.jobs import Job, stream
from sweep.spec.robots import robot_settings
from sweep.spec.settings import settings_of


def robots_of(job: Job) -> RobotSettings:
    """In what the boids of a job and their medium differ from ideal ones."""
    return robot_settings(job.settings, settings_of(job.model, job.known))


def has_robots(job: Job) -> bool:
    """Whether boids are not ideal ones, their medium moves, or they have several goals.
    Such trials fly alone, with one thread.
    """
    return bool(job.settings["next_goals"]) or not is_ideal(
        robots_of(job), float(job.settings["dt"])
    )


def failing_of(job: Job) -> Failing:
    """Which boids of a trial fail, when and how."""
    n, dt = int(job.settings["n"]), float(job.settings["dt"])
    return failing(robots_of(job).breakdowns, keys_of(job).made, n, dt)


def keys_of(job: Job) -> ChanceKeys:
    """The keys of what is random about the robots of a trial."""
    made, flown = (stream(job, purpose) for purpose in ("made", "flown"))
    return ChanceKeys(
        *(ChanceKey(*map(int, one.generate_state(2))) for one in (made, flown))
    )
