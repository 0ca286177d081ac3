"""Whether the boids of a trial are ideal ones, and their keys of random numbers."""

from kernels.chance import ChanceKey
from kernels.robots.robots import ChanceKeys
from kernels.robots.senses import is_ideal
from kernels.settings import Sensing
from sweep.design.jobs import Job, stream
from sweep.spec.settings import settings_of, settings_tuple


def has_robots(job: Job) -> bool:
    """Whether boids do not know all that they see, or fail. Such trials fly alone, with
    one thread.
    """
    settings, known = job.settings, settings_of(job.model, job.known)
    sensing: Sensing = settings_tuple(Sensing, settings, known)
    dt = float(settings["dt"])
    fails = float(settings["failing_share"]) > 0.0
    return fails or not is_ideal(sensing, dt)


def keys_of(job: Job) -> ChanceKeys:
    """The keys of what is random about the robots of a trial."""
    made, flown = (stream(job, purpose) for purpose in ("made", "flown"))
    return ChanceKeys(
        *(ChanceKey(*map(int, one.generate_state(2))) for one in (made, flown))
    )
