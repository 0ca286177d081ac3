"""Where a file of the page comes from: its name, and what its metadata say."""

from collections.abc import Mapping

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
    """The origin of a picture at a step, or of a run up to it, with the spec that gives
    it.
    """
    return about(study, job) | {"Step": str(step), "Spec": spec}


def in_lines(said: Mapping[str, str]) -> str:
    """An origin as one text, for formats whose metadata have no keys."""
    return "\n".join(f"{key}: {value}" for key, value in said.items())


def trial_name(study: str, job: Job) -> str:
    """The beginning of the names of all files of a trial."""
    return f"{study.replace('/', '-')}-{job.trial_id[:8]}"


def picture_name(study: str, job: Job, step: int) -> str:
    """The name of the picture of a step, without its ending, e.g.
    nguyen2024-separation-05d7a1b2-step-250.
    """
    return f"{trial_name(study, job)}-step-{step}"


def run_name(study: str, job: Job, last: int) -> str:
    """The same of a run up to its step `last`: ...-05d7a1b2-to-step-250."""
    return f"{trial_name(study, job)}-to-step-{last}"
