"""A run as one page of HTML that opens from disk. The page contains its script, its
style, and its frames in base64.

A boid takes five bytes a frame, which are seven in base64. The page may load nothing
and send nothing.
"""

import base64
import hashlib
import json
import math
from collections.abc import Iterable
from html import escape
from typing import Any

from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.web.encoding import frame
from sweep.web.export import MIME, File, about, file_name, thinned
from sweep.web.flight import KeptFlight
from sweep.web.page import script, style

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
    size = float(few.job.settings["width"]), float(few.job.settings["height"])
    frames = b"".join(
        frame(int(step), one, size)
        for step, one in zip(few.steps, few.bodies, strict=True)
    )
    said = {message["type"]: message for message in greeting}
    recording = {
        "controls": said["controls"] | {"overlays": []},
        "state": _state(few, said["state"]),
        "scene": said["scene"],
        "spec": spec,
        "steps": few.steps.tolist(),
        "metrics": {
            name: [_number(value) for value in series.tolist()]
            for name, series in few.values.items()
        },
        "about": about(flight.study, flight.job),
        "frames": base64.b64encode(frames).decode(),
    }
    content = _document(recording).encode()
    return File(file_name(flight.study, flight.job, "html"), MIME["html"], content)


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
        "replay": replay,
        "running": False,
        "step": first,
        "selected": None,
        "overlays": [],
        "sweeps": {},
        "plots": plots,
    }


def _number(value: float) -> float | None:
    """A value of a metric as JSON has it: null for what is not finite."""
    return value if math.isfinite(value) else None


def _document(recording: Message) -> str:
    said = recording["about"]
    title = f"{said['Study']}, trial {said['Trial']}"
    program = script("recording")
    rules = style()
    policy = (
        f"default-src 'none'; script-src {_source(program)}; style-src"
        f" {_source(rules)}; img-src blob: data:"
    )
    # "<" could end the element that it stands in.
    data = json.dumps(recording, allow_nan=False, separators=(",", ":")).replace(
        "<", "\\u003c"
    )
    where = "; ".join(f"{key}: {value}" for key, value in said.items())
    need = "The recording needs JavaScript to play."
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta http-equiv="Content-Security-Policy" content="{escape(policy)}">
<meta name="description" content="{escape(where)}">
<title>{escape(title)}</title>
<style>{rules}</style>
</head>
<body class="boidsweep-page">
<main></main>
<noscript>{escape(title)}: {escape(where)}. {need}</noscript>
<script type="application/json" id="recording">{data}</script>
<script type="module">{program}</script>
</body>
</html>
"""


def _source(text: str) -> str:
    """The name of an inline element with this text in the policy of a page."""
    return (
        f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
    )
