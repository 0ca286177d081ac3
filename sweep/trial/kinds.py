"""The kinds of the boids of a trial, for whoever stores or shows them."""

from kernels.model import kind_counts
from sweep.design.jobs import Job
from sweep.spec.settings import settings_of, settings_tuple


def kinds_of(job: Job) -> dict[str, int]:
    """How many boids of the trial of `job` are of each kind, in the order of their
    indices: the first boids are of the first kind. Empty for a model without kinds.
    """
    model, known = job.known.models[job.model], settings_of(job.model, job.known)
    params = settings_tuple(model.params, job.settings, known)
    counts = kind_counts(model, params, int(job.settings["n"]))
    return dict(zip(model.kinds, counts, strict=True)) if model.kinds else {}
