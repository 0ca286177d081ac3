"""Makes the files that a page asks for: a picture of the frame on the screen, or the
run as an animation or a page.
"""

import base64
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.errors import OutputError, SpecError
from sweep.replays.video import find_ffmpeg
from sweep.text import unknown
from sweep.web.origin import about_frame, picture_name, trial_name
from sweep.web.protocol import Reply

if TYPE_CHECKING:
    from sweep.web.flight import KeptFlight

PICTURES = ("png", "svg")
RUNS = ("gif", "mp4", "html")
KINDS = (*PICTURES, *RUNS)


class Order(NamedTuple):
    """What is on the screen: `bodies` (4, N) at `step` of a trial of `study`.

    `until` is the last step of the run in a file, `metrics` are those in a page.
    `refused` says why there can be no file of the run; it is "" where there can.
    """

    study: str
    job: Job
    step: int
    bodies: NDArray[np.float64]
    metrics: tuple[str, ...]
    until: int
    refused: str = ""


Tell = Callable[[str, float], None]
"""Is told what is being done, and how much of it is done, from 0 to 1. It raises
StoppedError where nobody wants the file any more.
"""
Make = Callable[[Tell], Reply]
"""Makes a file and returns the file message. It may take long."""


class StoppedError(Exception):
    """A file is not wanted any more."""


def untold(_doing: str, _share: float) -> None:
    """Tells nobody."""


@cache
def _lacking() -> dict[str, str]:
    """The kinds that this machine cannot make, and why. Asked once."""
    try:
        find_ffmpeg()
    except OutputError as error:
        return {"mp4": str(error)}
    return {}


def unavailable(refused: str) -> dict[str, str]:
    """The kinds of file that cannot be made, and why; `refused` is that of an Order."""
    return dict.fromkeys(RUNS, refused) if refused else _lacking()


def filed(order: Order, kind: str, greeting: list[Reply], spec: str) -> Make:
    """A function that makes the file.

        order     what is on the screen
        kind      one of KINDS
        greeting  the messages controls, state and scene of the session
        spec      the YAML of what is on the screen

    Raises SpecError for an unknown kind, and for a run that is refused.
    """
    if kind not in KINDS:
        raise SpecError(unknown("kind of file", kind, KINDS))
    if order.refused and kind in RUNS:
        raise SpecError(order.refused)
    return lambda tell: _made(order, kind, greeting, spec, tell)


def origin_of(order: Order, spec: str) -> Reply:
    """The origin message: the names of a picture of the frame and of the trial, without
    an ending, and the metadata of the picture.
    """
    name = picture_name(order.study, order.job, order.step)
    said = about_frame(order.study, order.job, order.step, spec)
    trial = trial_name(order.study, order.job)
    return {"type": "origin", "name": name, "trial": trial, "about": said}


def _made(
    order: Order, kind: str, greeting: list[Reply], spec: str, tell: Tell
) -> Reply:
    # Imported here because they import matplotlib, which is slow.
    from sweep.web.export import animate, draw_frame
    from sweep.web.recording import recording_of

    if kind in PICTURES:
        file = draw_frame(order.study, order.job, order.step, order.bodies, kind, spec)
    else:
        flight = _flown(order, tell)
        file = (
            recording_of(flight, greeting, spec)
            if kind == "html"
            else animate(
                flight, kind, spec, lambda done, whole: tell("drawn", done / whole)
            )
        )
    return {
        "type": "file",
        "name": file.name,
        "mime": file.mime,
        "data": base64.b64encode(file.content).decode(),
    }


def _flown(order: Order, tell: Tell) -> "KeptFlight":
    from sweep.web.flight import fly

    last = max(1, order.until)
    return fly(
        order.study,
        order.job,
        order.metrics,
        until=order.until,
        report=lambda done, _: tell("run again", min(1.0, done / last)),
    )
