"""Runs the missing trials of the studies of a publication."""

import sys
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import NamedTuple

from sweep.campaigns import Display, launch
from sweep.spec import Study
from sweep.tables import StoredStudy
from sweep.workers import ExecutorFactory


class Ran(NamedTuple):
    """Number of new trials, and number of trials that are not done."""

    new: int
    not_done: int


def run_studies(
    studies: Iterable[Study],
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
) -> Ran:
    """Run the missing trials of each study, and print one summary per study.

    Errors are those of a launch.

    Parameters
    ----------
    studies : iterable of Study
    results : Path
        Folder with the stored studies.
    engine : ExecutorFactory
        Runs the trials.
    display : callable
        Makes the progress display of a study from its name.
    """
    new = 0
    not_done = 0
    for study in studies:
        with display(study.name) as bar, ExitStack() as ending:
            ending.callback(engine.stop)
            progress = launch(study, results, engine, report=bar.show)
        print(bar.summary(progress, results / study.name), file=sys.stderr)
        new += progress.statuses.total()
        statuses = StoredStudy(study.name, results).statuses()
        if lacking := statuses.total() - statuses["done"]:
            not_done += lacking
            print(
                f"{study.name}: {lacking:,} trials are not done:"
                f" sweep status {study.name}",
                file=sys.stderr,
            )
    return Ran(new, not_done)
