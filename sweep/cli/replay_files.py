"""The files that a replay writes: every frame, an animation, a figure."""

import json
from pathlib import Path
from typing import NamedTuple

from sweep.cli.progress_line import ProgressLine
from sweep.design import Job
from sweep.errors import ChoiceError
from sweep.replays import (
    FLIGHTS,
    Report,
    check_frame,
    find_ffmpeg,
    frames_apart,
    write_animation,
    write_flight,
    write_picture,
)
from sweep.store import PROVENANCE, machine
from sweep.tables import BESIDE, StoredStudy, about_of, check_output


class ReplayFiles(NamedTuple):
    """The files to write: all frames, an animation, the figure of one frame.

    `every` is the number of steps between frames, 0 for the default. An animation in
    HTML is a page that plays the trial.
    """

    trajectory: Path | None = None
    animation: Path | None = None
    picture: tuple[int, Path] | None = None
    every: int = 0


def check(
    study: StoredStudy, trial: str, files: ReplayFiles, *, force: bool = False
) -> None:
    """Raise an error if a file cannot be written, before any work.

    Parameters
    ----------
    study : StoredStudy
        The stored study.
    trial : str
        The id of the trial, or its beginning.
    files : ReplayFiles
        The files.
    force : bool, default False
        Allow to replace files that exist.

    Raises
    ------
    OutputError
        A file cannot be at its path, or ffmpeg is missing for an MP4.
    ChoiceError
        The trial or frame is unknown, `every` exceeds the steps of the trial, or a page
        would have too many boids.
    """
    if files.every:
        steps = int(study.job(study.trial(trial)).settings["steps"])
        if files.every > steps:
            raise ChoiceError(
                f"every: {files.every:,}; allowed: 0 to {steps:,}, the number of steps"
                " of the trial"
            )
    if files.trajectory:
        check_output(files.trajectory, FLIGHTS, force=force)
        if files.trajectory.suffix == ".csv":
            check_output(about_of(files.trajectory), [BESIDE], force=force)
    if files.animation:
        check_output(files.animation, [".gif", ".mp4", ".html"], force=force)
        _check_animation(study, trial, files.animation, files.every)
    if files.picture:
        frame, path = files.picture
        check_output(path, [".png"], force=force)
        check_frame(study.job(study.trial(trial)), frame)


def show(study: StoredStudy, trial: str, files: ReplayFiles) -> list[Path]:
    """Write the files; the trial runs again for each file, with progress on stderr.

    Parameters
    ----------
    study : StoredStudy
        The stored study.
    trial : str
        The id of the trial, or its beginning.
    files : ReplayFiles
        The files.

    Returns
    -------
    list of Path
        The files that were written.
    """
    stored = study.trial(trial)
    job = study.job(stored)
    written = list[Path]()
    if files.trajectory:
        origin = stored.provenance | {"trial": job.trial_id, "run_again": machine()}
        metadata = {PROVENANCE: json.dumps(origin, sort_keys=True).encode()}
        written += write_flight(
            job,
            files.trajectory,
            files.every or 1,
            metadata,
            report=_report(files.trajectory),
        )
    if files.animation:
        _animate(study, job, files.animation, files.every)
        written.append(files.animation)
    if files.picture:
        frame, path = files.picture
        write_picture(study.name, job, frame, path, report=_report(path))
        written.append(path)
    return written


def _check_animation(study: StoredStudy, trial: str, path: Path, every: int) -> None:
    if path.suffix == ".mp4":
        find_ffmpeg()
    elif path.suffix == ".html":
        from sweep.web import check_page

        check_page(study.job(study.trial(trial)), every)


def _animate(study: StoredStudy, job: Job, path: Path, every: int) -> None:
    if path.suffix == ".html":
        from sweep.web import write_page

        write_page(study, job.trial_id, path, every, report=_report(path))
    else:
        steps = every or frames_apart(job)
        write_animation(study.name, job, path, steps, report=_report(path))


def _report(path: Path) -> Report:
    return ProgressLine(str(path), "steps").show
