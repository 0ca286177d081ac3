"""A run as one page of HTML that opens from disk.

A boid takes five bytes a frame, which are seven in base64. Whom it sees, who flocks
together and what was visited, the script tells from these.
"""

import base64
import math
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.web.document import document
from sweep.web.encoding import frame
from sweep.web.export import MIME, File, thinned
from sweep.web.flight import KeptFlight
from sweep.web.front_matter import front_matter
from sweep.web.origin import about, run_name
from sweep.web.senses import faced, senses_of

MOST_BYTES = 16 * 2**20
"""The most bytes of frames in a page. Such a page can still be mailed, and opens at
once.
"""
FEWEST_FRAMES = 100
"""If the page has no room for so many frames of a longer run, it is refused."""
AS_LAUNCHED = "The spec gives these very frames, bit for bit."

Message = dict[str, Any]


def recording_of(flight: KeptFlight, greeting: Iterable[Message], spec: str) -> File:
    """The page that plays a run.

    If there are more frames than the page has room for, only every second frame is
    kept, or every third, and so on. `greeting` has the messages controls, state and
    scene with which a session begins. `spec` is the YAML that "Copy as spec" gives.
    Raises ChoiceError if too few frames would be left.
    """
    few = thinned(flight, _room(flight.job, len(flight.steps)))
    said = {message["type"]: message for message in greeting}
    front = front_matter(few, said["state"]["replay"])
    origin = about(flight.study, flight.job)
    content = document(
        "recording",
        "recorded",
        {"front": asdict(front), "recording": recorded_run(few, said, spec)},
        front.title,
        origin,
    )
    name = run_name(flight.study, flight.job, int(flight.steps[-1]))
    return File(f"{name}.html", MIME["html"], content)


def recorded_run(flight: KeptFlight, said: dict[str, Message], spec: str) -> Message:
    """All that the player of a page reads of one run; a page may have several.

    flight  the frames, all of which are recorded
    said    the messages controls, state and scene of its session by their types
    spec    the YAML that gives it
    """
    size = float(flight.job.settings["width"]), float(flight.job.settings["height"])
    frames = b"".join(
        frame(int(step), one, size)
        for step, one in zip(
            flight.steps, faced(flight.job, flight.bodies), strict=True
        )
    )
    metrics = said["controls"]["metrics"]
    return {
        "groups": said["controls"]["groups"],
        "metrics": [one for one in metrics if one["name"] in flight.values],
        "state": _state(flight, said["state"]),
        "scene": said["scene"],
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
    """Raise ChoiceError if a page has no room for a trial with a frame every `every`
    steps; 0 stands for 1.
    """
    _room(job, int(job.settings["steps"]) // (every or 1) + 1)


def _room(job: Job, frames: int) -> int:
    """How many frames of a trial a page has room for. Raises ChoiceError if `frames` of
    them would be thinned too much.
    """
    n = int(job.settings["n"])
    bytes_a_frame = math.ceil((32 + 5 * n + 3) * 4 / 3)
    room = MOST_BYTES // bytes_a_frame
    if room < min(FEWEST_FRAMES, frames):
        raise ChoiceError(
            f"{n:,} boids take {bytes_a_frame:,} bytes a frame; a page has room for"
            f" {MOST_BYTES:,}, which are {room} frames: too few to show a run of"
            f" {frames:,}; export an animation instead"
        )
    return room


def _state(flight: KeptFlight, state: Message) -> Message:
    """The state of the session as it is at the beginning of its recording."""
    first, last = int(flight.steps[0]), int(flight.steps[-1])
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
        "files": {},
        "plots": plots,
    }


def _number(value: float) -> float | None:
    """A value of a metric as JSON has it: null for what is not finite."""
    return value if math.isfinite(value) else None
