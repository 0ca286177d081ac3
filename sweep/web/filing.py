"""Makes the files that a page asks for: a picture of the frame on the screen, or the
run as an animation or a page.
"""

import base64
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design.jobs import Job
from sweep.errors import SpecError
from sweep.text import unknown
from sweep.web.protocol import Reply

PICTURES = ("png", "svg")
KINDS = (*PICTURES, "gif", "mp4", "html")


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


def filed(
    order: Order, kind: str, greeting: list[Reply], spec: str
) -> Callable[[], Reply]:
    """A function that makes the file and returns the file message. It may take long.

        order     what is on the screen
        kind      one of KINDS
        greeting  the messages controls, state and scene of the session
        spec      the YAML of what is on the screen

    Raises SpecError for an unknown kind, and for a run that is refused.
    """
    if kind not in KINDS:
        raise SpecError(unknown("kind of file", kind, KINDS))
    if order.refused and kind not in PICTURES:
        raise SpecError(order.refused)
    return lambda: _made(order, kind, greeting, spec)


def _made(order: Order, kind: str, greeting: list[Reply], spec: str) -> Reply:
    # Imported here because they import matplotlib, which is slow.
    from sweep.web.export import animate, draw_frame
    from sweep.web.flight import fly
    from sweep.web.recording import recording_of

    study, job = order.study, order.job
    if kind in PICTURES:
        file = draw_frame(study, job, order.step, order.bodies, kind)
    else:
        flight = fly(study, job, order.metrics, until=order.until)
        file = (
            recording_of(flight, greeting, spec)
            if kind == "html"
            else animate(flight, kind)
        )
    return {
        "type": "file",
        "name": file.name,
        "mime": file.mime,
        "data": base64.b64encode(file.content).decode(),
    }
