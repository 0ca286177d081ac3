"""Where a file of the page comes from: its name, and what its metadata say."""

from kernels.identity import kernels_sha
from sweep.design.jobs import Job
from sweep.store.provenance import machine


def about(study: str, job: Job) -> dict[str, str]:
    """The origin of a file of a run, for its metadata."""
    return {
        "Study": study,
        "Trial": job.trial_id,
        "Model": f"{job.model} {job.preset}",
        "kernels_sha": kernels_sha(),
        "Software": f"boidsweep {machine()['versions']['boidsweep']}",
    }


def about_frame(study: str, job: Job, step: int, spec: str) -> dict[str, str]:
    """The origin of a picture at a step, with the spec that gives it."""
    return about(study, job) | {"Step": str(step), "Spec": spec}


def file_name(study: str, job: Job, kind: str, step: int | None = None) -> str:
    """A trial's file name, e.g. nguyen2024-separation-05d7a1b2-step-250.png."""
    frame = "" if step is None else f"-step-{step}"
    return f"{study.replace('/', '-')}-{job.trial_id[:8]}{frame}.{kind}"
