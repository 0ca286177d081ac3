"""The origin of a file of the page: name and metadata."""

from collections.abc import Mapping

from kernels.identity import kernels_sha
from sweep.design import Job
from sweep.store import machine


def about(study: str, job: Job) -> dict[str, str]:
    """Return the origin of a file of a run, for the metadata."""
    return {
        "Study": study,
        "Trial": job.trial_id,
        "Model": f"{job.model} {job.preset}",
        "kernels_sha": kernels_sha(),
        "Software": f"boidsweep {machine()['versions']['boidsweep']}",
    }


def about_frame(study: str, job: Job, step: int, spec: str) -> dict[str, str]:
    """Return the origin of an image of a step, or of a run up to the step.

    Parameters
    ----------
    study : str
        Name of the study.
    job : Job
        The trial.
    step : int
        Step of the frame.
    spec : str
        YAML that gives the frame.
    """
    return about(study, job) | {"Step": str(step), "Spec": spec}


def in_lines(origin: Mapping[str, str]) -> str:
    """Return an origin as a single text, for formats with metadata without keys."""
    return "\n".join(f"{key}: {value}" for key, value in origin.items())


def trial_name(study: str, job: Job) -> str:
    """Return the beginning of the names of all files of a trial."""
    return f"{study.replace('/', '-')}-{job.trial_id[:8]}"


def picture_name(study: str, job: Job, step: int) -> str:
    """Return the name of the image of a step, without an ending.

    An example is nguyen2024-separation-05d7a1b2-step-250.

    Parameters
    ----------
    study : str
        Name of the study.
    job : Job
        The trial.
    step : int
        Step of the frame.
    """
    return f"{trial_name(study, job)}-step-{step}"


def run_name(study: str, job: Job, last: int) -> str:
    """Return the name of a file of a run, without an ending.

    An example is nguyen2024-separation-05d7a1b2-to-step-250.

    Parameters
    ----------
    study : str
        Name of the study.
    job : Job
        The trial.
    last : int
        Last step of the run.
    """
    return f"{trial_name(study, job)}-to-step-{last}"
