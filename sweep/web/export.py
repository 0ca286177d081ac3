"""Runs as files: a frame as PNG or SVG, a run as GIF or MP4."""

import io
import math
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryFile
from typing import BinaryIO, NamedTuple, Protocol

import numpy as np
from matplotlib import style
from numpy.typing import NDArray
from PIL import Image, PngImagePlugin

from sweep.design import Job
from sweep.errors import ChoiceError
from sweep.figures import DOTS, DRAWING, STYLE, draw_flock
from sweep.replays import (
    MOST_FRAMES,
    Picture,
    Report,
    Scene,
    find_ffmpeg,
    write_gif,
    write_mp4,
)
from sweep.tables import check_output, unfinished
from sweep.web.flight import KeptFlight, silent
from sweep.web.origin import about_frame, in_lines, picture_name, run_name

MIME = {
    "png": "image/png",
    "svg": "image/svg+xml",
    "gif": "image/gif",
    "mp4": "video/mp4",
    "html": "text/html;charset=utf-8",
}


class FilmWriter(Protocol):
    """A writer of pictures as an animation, with a comment in its metadata."""

    def __call__(
        self, pictures: Iterator[Picture], file: BinaryIO, /, *, comment: str
    ) -> None:
        """Write the pictures into the file."""


WRITERS: dict[str, FilmWriter] = {"gif": write_gif, "mp4": write_mp4}


class File(NamedTuple):
    """A file for the user: name, MIME type and bytes."""

    name: str
    mime: str
    content: bytes

    def save(self, path: Path, *, force: bool = False) -> None:
        """Write the content to `path`, whole or not at all.

        Parameters
        ----------
        path : Path
            The file, with the ending of `name`.
        force : bool, default False
            Replace a file that exists.

        Raises
        ------
        OutputError
            If the file cannot be written.
        """
        check_output(path, [Path(self.name).suffix], force=force)
        with unfinished(path) as file:
            file.write(self.content)


def draw_frame(
    study: str,
    job: Job,
    step: int,
    bodies: NDArray[np.float64],
    kind: str,
    spec: str = "",
) -> File:
    """Return the image of one frame.

    Equal frames give equal bytes.

    Parameters
    ----------
    study : str
        Name of the study.
    job : Job
        The trial.
    step : int
        Step of the frame.
    bodies : array (4, N)
        x, y, vx and vy, in the model's length and length/time.
    kind : {"png", "svg"}
        Format of the file.
    spec : str, optional
        YAML that gives the frame, for the metadata.
    """
    write = {"png": _png, "svg": _svg}[kind]
    with DRAWING:
        content = write(
            Scene(study, job), step, bodies, about_frame(study, job, step, spec)
        )
    return File(f"{picture_name(study, job, step)}.{kind}", MIME[kind], content)


def _png(
    scene: Scene, step: int, bodies: NDArray[np.float64], origin: dict[str, str]
) -> bytes:
    chunks = PngImagePlugin.PngInfo()
    file = io.BytesIO()
    for key, value in origin.items():
        chunks.add_text(key, value)
    picture = Image.fromarray(scene.draw(step, bodies))
    picture.save(file, "png", pnginfo=chunks, dpi=(DOTS, DOTS))
    return file.getvalue()


def _svg(
    scene: Scene, step: int, bodies: NDArray[np.float64], origin: dict[str, str]
) -> bytes:
    """Return the SVG of a frame.

    The frame is drawn as pixels first, because that step writes the title.
    """
    file = io.BytesIO()
    description = "; ".join(
        f"{key}: {value}" for key, value in origin.items() if key != "Software"
    )
    scene.draw(step, bodies)
    with style.context(STYLE):
        draw_flock(scene.axes, bodies, scene.length, scene.colour)
        metadata = {
            "Creator": origin["Software"],
            "Date": None,
            "Description": description,
        }
        scene.figure.savefig(file, format="svg", metadata=metadata)
    return file.getvalue()


def animate(
    flight: KeptFlight, kind: str, spec: str = "", report: Report = silent
) -> File:
    """Return a run as an animation with at most MOST_FRAMES frames.

    Parameters
    ----------
    flight : KeptFlight
        The run.
    kind : {"gif", "mp4"}
        Format of the file.
    spec : str, optional
        YAML that gives the run, for the metadata.
    report : callable, optional
        Called with the number of drawn frames and the number of all frames.

    Raises
    ------
    OutputError
        If `kind` is "mp4" and ffmpeg is missing.
    """
    if kind == "mp4":
        find_ffmpeg()
    few = thinned(flight, MOST_FRAMES)
    last = int(flight.steps[-1])
    origin = about_frame(flight.study, flight.job, last, spec)
    with DRAWING, TemporaryFile() as file:  # ffmpeg needs the path of a true file
        scene = Scene(few.study, few.job, few.every)
        WRITERS[kind](_drawn(scene, few, report), file, comment=in_lines(origin))
        file.seek(0)
        content = file.read()
    name = run_name(flight.study, flight.job, last)
    return File(f"{name}.{kind}", MIME[kind], content)


def _drawn(scene: Scene, flight: KeptFlight, report: Report) -> Iterator[Picture]:
    frames = zip(flight.steps, flight.bodies, strict=True)
    for drawn, (step, bodies) in enumerate(frames):
        report(drawn, len(flight.steps))
        yield scene.draw(int(step), bodies)


def thinned(flight: KeptFlight, most: int) -> KeptFlight:
    """Return a run with at most `most` frames.

    The result has every second, third, ... frame, and the last frame. Raises
    ChoiceError if `most` is below 2.
    """
    if most < 2:
        raise ChoiceError(
            f"at most {most} frames: use 2 or more, for the first and the last frame"
        )
    count = len(flight.steps)
    if count <= most:
        return flight
    apart = math.ceil((count - 1) / (most - 1))
    indices = np.append(np.arange(0, count - 1, apart), count - 1)
    return flight._replace(
        every=flight.every * apart,
        steps=flight.steps[indices],
        bodies=flight.bodies[indices],
        values={name: series[indices] for name, series in flight.values.items()},
    )
