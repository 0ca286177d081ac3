"""Title, caption, citation and licence of a recording.

The texts are for a reader who has only the recording.
"""

from dataclasses import dataclass
from typing import Any

from kernels.identity import kernels_sha
from sweep.design import Job
from sweep.sharing import NO_LICENCE, behind, program
from sweep.text import so_many
from sweep.web.flight import KeptFlight


@dataclass(frozen=True)
class FrontMatter:
    """The texts of a page; `cite` has one line per work."""

    title: str
    caption: str
    cite: tuple[str, ...]
    licence: str


def front_matter(flight: KeptFlight, replay: dict[str, Any] | None) -> FrontMatter:
    """Return the texts for a run.

    `replay` is the entry of the state message for a stored trial, None for a run that
    was not stored.
    """
    job = flight.job
    title = f"{flight.study}: {replay['which']}" if replay else _named(job)
    trial = f"Trial {job.trial_id} of the study {flight.study}, kernels {kernels_sha()}"
    works = [work.as_text() for work in (program(), behind(job.model, job.catalogue))]
    return FrontMatter(title, _caption(flight), (*works, f"{trial}."), NO_LICENCE)


def _named(job: Job) -> str:
    return f"{job.model}, {job.preset}, seed {job.seed}"


def _caption(flight: KeptFlight) -> str:
    """Return a sentence on the boids, the model, the world and the length of a run."""
    job = flight.job
    settings = job.settings
    boids = so_many(int(settings["n"]), "boid")
    steps = so_many(int(flight.steps[-1]), "step")
    shown = "" if flight.every == 1 else f"; one frame in {flight.every:,} is shown"
    return (
        f"{boids} of the model {job.model}, preset {job.preset}, on the map"
        f" {settings['map']}: {steps}, dt = {settings['dt']:g}"
        f" {job.catalogue.models[job.model].time}{shown}."
    )
