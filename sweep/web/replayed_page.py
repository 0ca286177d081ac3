"""A stored trial as a page of HTML that plays the trial."""

from pathlib import Path

from sweep.replays import Report
from sweep.tables import StoredStudy
from sweep.web.flight import fly
from sweep.web.recording import recording_of
from sweep.web.replaying import Replay


def write_page(
    study: StoredStudy, trial: str, path: Path, every: int, report: Report
) -> None:
    """Write a stored trial as a page that plays the trial.

    Parameters
    ----------
    study : StoredStudy
        The stored study.
    trial : str
        Id of the trial.
    path : Path
        The new file, which replaces an existing file.
    every : int
        Steps between two frames; 0 keeps as many frames as the page has room for.
    report : callable
        Called with the number of steps done and the number of all steps.

    Raises
    ------
    StoreError
        If the trial cannot be shown.
    ChoiceError
        If the page has no room for the trial, as for `check_page`.
    """
    shown = Replay(study, trial, report)
    flight = fly(study.name, shown.job, tuple(shown.track.values), every=every)
    recording_of(flight, shown.greeting(), shown.spec()).save(path, force=True)
