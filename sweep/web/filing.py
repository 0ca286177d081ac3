"""The files that a page asks for: an image of the frame, or the run.

A run becomes an animation or a page.
"""

import base64
from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.design import Job
from sweep.errors import OutputError, SpecError
from sweep.replays import find_ffmpeg
from sweep.text import unknown
from sweep.web.origin import about_frame, picture_name, trial_name
from sweep.web.protocol import Reply

if TYPE_CHECKING:
    from sweep.web.flight import KeptFlight

PICTURES = ("png", "svg")
RUNS = ("gif", "mp4", "html")
KINDS = (*PICTURES, *RUNS)


class Order(NamedTuple):
    """The content of the screen, for a file.

    Attributes
    ----------
    study : str
        Name of the study.
    job : Job
        The trial.
    step : int
        Step of the frame.
    bodies : array (4, N)
        x, y, vx and vy of the frame.
    metrics : tuple of str
        Metrics in a page of the run.
    until : int
        Last step of the run in a file.
    refused : str, default ""
        Reason why a file of the run is impossible; "" where a file is possible.
    """

    study: str
    job: Job
    step: int
    bodies: NDArray[np.float64]
    metrics: tuple[str, ...]
    until: int
    refused: str = ""


Tell = Callable[[str, float], None]
"""Called with the current work and the finished fraction, from 0 to 1.

The callable raises StoppedError if the file is no longer wanted.
"""
Make = Callable[[Tell], Reply]
"""A callable that makes a file, which may take long, and returns the file message."""


class StoppedError(Exception):
    """A file is no longer wanted."""


def untold(_doing: str, _share: float) -> None:
    """Report nothing."""


@cache
def _lacking() -> dict[str, str]:
    """Return the kinds that this machine cannot make, and why.

    ffmpeg is sought once.
    """
    try:
        find_ffmpeg()
    except OutputError as error:
        return {"mp4": str(error)}
    return {}


def unavailable(refused: str) -> dict[str, str]:
    """Return the kinds of file that cannot be made, and why.

    `refused` is the reason in an Order.
    """
    return dict.fromkeys(RUNS, refused) if refused else _lacking()


def filed(order: Order, kind: str, greeting: list[Reply], spec: str) -> Make:
    """Return a function that makes the file.

    Parameters
    ----------
    order : Order
        The content of the screen.
    kind : str
        One of KINDS.
    greeting : list of dict
        The messages controls, state and scene of the session.
    spec : str
        YAML of the content of the screen.

    Raises
    ------
    SpecError
        If the kind is unknown, or `order` has a reason against a file of the run.
    """
    if kind not in KINDS:
        raise SpecError(unknown("kind of file", kind, KINDS))
    if order.refused and kind in RUNS:
        raise SpecError(order.refused)
    return lambda tell: _made(order, kind, greeting, spec, tell=tell)


def origin_of(order: Order, spec: str) -> Reply:
    """Return the origin message of a frame.

    The message has the names of an image of the frame and of the trial, without an
    ending, and the metadata of the image.
    """
    name = picture_name(order.study, order.job, order.step)
    return {
        "type": "origin",
        "name": name,
        "trial": trial_name(order.study, order.job),
        "about": about_frame(order.study, order.job, order.step, spec),
    }


def _made(
    order: Order, kind: str, greeting: list[Reply], spec: str, tell: Tell
) -> Reply:
    # Imported here because they import matplotlib, which is slow.
    from sweep.web.export import animate, draw_frame
    from sweep.web.recording import recording_of

    if kind in PICTURES:
        file = draw_frame(
            order.study,
            order.job,
            order.step,
            order.bodies,
            kind=kind,
            spec=spec,
        )
    else:
        flight = _flown(order, tell)
        file = (
            recording_of(flight, greeting, spec)
            if kind == "html"
            else animate(
                flight, kind, spec, lambda done, total: tell("drawn", done / total)
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
