"""A run as one page of HTML that opens from disk.

A boid takes five bytes per frame, which are seven in base64. From these bytes the
script computes perceived neighbours, flocks and visits.
"""

import base64
import math
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from sweep.design import Job
from sweep.errors import ChoiceError
from sweep.web.encoding import frame
from sweep.web.export import MIME, File, thinned
from sweep.web.flight import KeptFlight
from sweep.web.front_matter import front_matter
from sweep.web.origin import about, run_name
from sweep.web.page_text import document
from sweep.web.senses import faced, senses_of

MOST_BYTES = 16 * 2**20
"""Largest size of the frames in a page, in bytes.

A page of this size can still be mailed, and opens at once.
"""
FEWEST_FRAMES = 100
"""Smallest number of frames of a longer run in a page.

If the page has no room for so many frames, the run is rejected.
"""
AS_LAUNCHED = "The spec gives these frames, bit for bit."

Message = dict[str, Any]


def recording_of(flight: KeptFlight, greeting: Iterable[Message], spec: str) -> File:
    """Return the page that plays a run.

    If there are more frames than the page has room for, only every second frame is
    kept, or every third, and so on.

    Parameters
    ----------
    flight : KeptFlight
        The run.
    greeting : iterable of dict
        The messages controls, state and scene with which a session begins.
    spec : str
        YAML that "Copy as spec" gives.

    Raises
    ------
    ChoiceError
        If too few frames would be left.
    """
    few = thinned(flight, _room(flight.job, len(flight.steps)))
    messages = {message["type"]: message for message in greeting}
    front = front_matter(few, messages["state"]["replay"])
    origin = about(flight.study, flight.job)
    content = document(
        "recording",
        "recorded",
        {"front": asdict(front), "recording": recorded_run(few, messages, spec)},
        front.title,
        origin=origin,
    )
    name = run_name(flight.study, flight.job, int(flight.steps[-1]))
    return File(f"{name}.html", MIME["html"], content)


def recorded_run(
    flight: KeptFlight, messages: dict[str, Message], spec: str
) -> Message:
    """Return the data of a run for the player of a page, which may have several runs.

    Parameters
    ----------
    flight : KeptFlight
        The frames, all of which are recorded.
    messages : dict of str to dict
        The messages controls, state and scene of the session, by type.
    spec : str
        YAML that gives the run.
    """
    size = float(flight.job.settings["width"]), float(flight.job.settings["height"])
    frames = b"".join(
        frame(int(step), bodies, size)
        for step, bodies in zip(
            flight.steps, faced(flight.job, flight.bodies), strict=True
        )
    )
    metrics = messages["controls"]["metrics"]
    return {
        "groups": messages["controls"]["groups"],
        "metrics": [metric for metric in metrics if metric["name"] in flight.values],
        "state": _state(flight, messages["state"]),
        "scene": messages["scene"],
        "senses": senses_of(flight.job, flight.bodies),
        "spec": spec,
        "steps": flight.steps.tolist(),
        "values": {
            name: [_number(value) for value in series.tolist()]
            for name, series in flight.values.items()
        },
        "about": about(flight.study, flight.job),
        "frames": base64.b64encode(frames).decode(),
    }


def check_page(job: Job, every: int) -> None:
    """Raise ChoiceError if a page has no room for the frames of a trial.

    There is a frame every `every` steps; 0 means every step.
    """
    _room(job, int(job.settings["steps"]) // (every or 1) + 1)


def _room(job: Job, frames: int) -> int:
    """Return the number of frames of a trial that a page has room for.

    Raises ChoiceError if too few of `frames` frames would remain.
    """
    n = int(job.settings["n"])
    bytes_a_frame = math.ceil((32 + 5 * n + 3) * 4 / 3)
    room = MOST_BYTES // bytes_a_frame
    if room < min(FEWEST_FRAMES, frames):
        raise ChoiceError(
            f"{n:,} boids take {bytes_a_frame:,} bytes per frame; a page has room for"
            f" {MOST_BYTES:,} bytes, which are {room} frames, too few for a run of"
            f" {frames:,} frames; export an animation instead"
        )
    return room


def _state(flight: KeptFlight, state: Message) -> Message:
    """Return the state of the session at the beginning of the recording."""
    first = int(flight.steps[0])
    last = int(flight.steps[-1])
    live = {
        "study": flight.study,
        "trial": flight.job.trial_id,
        "equal": True,
        "words": AS_LAUNCHED,
    }
    replay = state["replay"] or live
    replay = replay | {"frames": [first, last, flight.every], "recorded": True}
    plots = [name for name in state["plots"] if name in flight.values]
    return state | {
        "run": 0,
        "replay": replay,
        "running": False,
        "step": first,
        "selected": None,
        "overlays": [],
        "sweeps": {},
        "follows": {},
        "files": {},
        "plots": plots,
    }


def _number(value: float) -> float | None:
    """Return a value of a metric for JSON: null where the value is not finite."""
    return value if math.isfinite(value) else None
