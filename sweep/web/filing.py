"""What a page wants as a file: a picture of the frame on the screen, or the run as an
animation or a page.
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
    """What is on the screen: `bodies` (4, N) at `step` of a trial of `study`, and up to
    which step its run is wanted.

    `refused` says why there is no run to be had, "" where there is.
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
    """What makes the file, however long that takes, and returns the file message.

    `greeting` and `spec` are those of the session, for a page. Raises SpecError for an
    unknown kind, and where an animation is refused.
    """
    if kind not in KINDS:
        raise SpecError(unknown("kind of file", kind, KINDS))
    if order.refused and kind not in PICTURES:
        raise SpecError(order.refused)
    return lambda: _made(order, kind, greeting, spec)


def _made(order: Order, kind: str, greeting: list[Reply], spec: str) -> Reply:
    # Here, as they bring matplotlib along.
    from sweep.web.export import animate, draw_frame
    from sweep.web.flight import fly
    from sweep.web.recording import record

    study, job = order.study, order.job
    if kind in PICTURES:
        file = draw_frame(study, job, order.step, order.bodies, kind)
    else:
        flight = fly(study, job, order.metrics, until=order.until)
        file = (
            record(flight, greeting, spec) if kind == "html" else animate(flight, kind)
        )
    return {
        "type": "file",
        "name": file.name,
        "mime": file.mime,
        "data": base64.b64encode(file.content).decode(),
    }
