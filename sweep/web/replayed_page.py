"""A stored trial as a page that plays it."""

from pathlib import Path

from sweep.replays.flight import Report
from sweep.tables.stored_study import StoredStudy
from sweep.web.flight import fly
from sweep.web.recording import record
from sweep.web.replaying import Replay


def write_page(
    study: StoredStudy, trial: str, path: Path, every: int, report: Report
) -> None:
    """Write a stored trial as a page that plays it, with a frame every `every` steps;
    0: as many as it has room for.

    Raises StoreError where the trial cannot be shown, and as `recording.check_page`
    does.
    """
    shown = Replay(study, trial, report)
    flight = fly(study.name, shown.job, tuple(shown.track.values), every=every)
    record(flight, shown.greeting(), shown.spec()).save(path, force=True)
