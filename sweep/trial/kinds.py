"""The types of the boids of a trial, to store or display them."""

from kernels.model import kind_counts
from sweep.design import Job
from sweep.spec import settings_of, settings_tuple


def kinds_of(job: Job) -> dict[str, int]:
    """Return the number of boids of each type; {} for a model without types.

    Types are in the order of indices: the first boids have the first type.
    """
    model = job.catalogue.models[job.model]
    described = settings_of(job.model, job.catalogue)
    params = settings_tuple(model.params, job.settings, described)
    counts = kind_counts(model, params, int(job.settings["n"]))
    return dict(zip(model.kinds, counts, strict=True)) if model.kinds else {}
