"""The files that a replay writes beside its report: every frame, an animation, a
picture.
"""

import json
from pathlib import Path
from typing import NamedTuple

from sweep.cli.progress_line import ProgressLine
from sweep.design.jobs import Job
from sweep.errors import ChoiceError
from sweep.replays.animation import (
    check_frame,
    frames_apart,
    write_animation,
    write_picture,
)
from sweep.replays.flight import FLIGHTS, Report, write_flight
from sweep.replays.video import find_ffmpeg
from sweep.store.origin import PROVENANCE
from sweep.store.provenance import machine
from sweep.tables.exporting import BESIDE, about_of
from sweep.tables.outputs import check_output
from sweep.tables.stored_study import StoredStudy


class Wanted(NamedTuple):
    """The files to write: all frames, an animation, the picture of one frame. `every`
    is the number of steps between frames, 0 for the default.

    An animation in HTML is a page that plays the run.
    """

    trajectory: Path | None = None
    animation: Path | None = None
    picture: tuple[int, Path] | None = None
    every: int = 0


def check(
    study: StoredStudy, trial: str, wanted: Wanted, *, force: bool = False
) -> None:
    """Raise an error for a file of `wanted` that cannot be written, before any work.

        study   the stored study
        trial   the id of the trial, or its beginning
        wanted  the files
        force   whether a file that exists may be replaced

    Raises OutputError for a place where no file can be, and for an MP4 without ffmpeg.
    Raises ChoiceError for an unknown trial or frame, for more steps between frames than
    the trial has, and for a page of too many boids.
    """
    if wanted.every:
        steps = int(study.job(study.trial(trial)).settings["steps"])
        if wanted.every > steps:
            raise ChoiceError(
                f"every: {wanted.every:,}; allowed: 0, or up to {steps:,}, the steps of"
                " the trial"
            )
    if wanted.trajectory:
        check_output(wanted.trajectory, FLIGHTS, force=force)
        if wanted.trajectory.suffix == ".csv":
            check_output(about_of(wanted.trajectory), [BESIDE], force=force)
    if wanted.animation:
        check_output(wanted.animation, [".gif", ".mp4", ".html"], force=force)
        _check_animation(study, trial, wanted.animation, wanted.every)
    if wanted.picture:
        frame, path = wanted.picture
        check_output(path, [".png"], force=force)
        check_frame(study.job(study.trial(trial)), frame)


def show(study: StoredStudy, trial: str, wanted: Wanted) -> list[Path]:
    """Run the trial again for each wanted file, and write it. Returns the files.
    Progress is shown on stderr.
    """
    stored = study.trial(trial)
    job, written = study.job(stored), list[Path]()
    if wanted.trajectory:
        about = stored.provenance | {"trial": job.trial_id, "run_again": machine()}
        metadata = {PROVENANCE: json.dumps(about, sort_keys=True).encode()}
        written += write_flight(
            job,
            wanted.trajectory,
            wanted.every or 1,
            metadata,
            _report(wanted.trajectory),
        )
    if wanted.animation:
        _animate(study, job, wanted.animation, wanted.every)
        written.append(wanted.animation)
    if wanted.picture:
        frame, path = wanted.picture
        write_picture(study.name, job, frame, path, _report(path))
        written.append(path)
    return written


def _check_animation(study: StoredStudy, trial: str, path: Path, every: int) -> None:
    if path.suffix == ".mp4":
        find_ffmpeg()
    elif path.suffix == ".html":
        from sweep.web.recording import check_page

        check_page(study.job(study.trial(trial)), every)


def _animate(study: StoredStudy, job: Job, path: Path, every: int) -> None:
    if path.suffix == ".html":
        from sweep.web.replayed_page import write_page

        write_page(study, job.trial_id, path, every, _report(path))
    else:
        write_animation(
            study.name, job, path, every or frames_apart(job), _report(path)
        )


def _report(path: Path) -> Report:
    return ProgressLine(str(path), "steps").show
