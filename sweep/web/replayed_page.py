"""A stored trial as a page of HTML that plays it."""

from pathlib import Path

from sweep.replays.flight import Report
from sweep.tables.stored_study import StoredStudy
from sweep.web.flight import fly
from sweep.web.recording import recording_of
from sweep.web.replaying import Replay


def write_page(
    study: StoredStudy, trial: str, path: Path, every: int, report: Report
) -> None:
    """Write a stored trial as a page that plays it.

        study   the stored study
        trial   the id of the trial
        path    the new file
        every   steps between two frames; 0 keeps as many as the page has room for
        report  is told how many of how many steps are done

    Raises StoreError if the trial cannot be shown, and ChoiceError as `check_page`
    does.
    """
    shown = Replay(study, trial, report)
    flight = fly(study.name, shown.job, tuple(shown.track.values), every=every)
    recording_of(flight, shown.greeting(), shown.spec()).save(path, force=True)
