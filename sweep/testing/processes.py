"""The check that results do not depend on the number of processes."""

from unittest import SkipTest

from sweep.testing.flights import every_way, in_words
from sweep.testing.places import of_function
from sweep.testing.subject import Subject
from sweep.trial import Result, run
from sweep.workers import Loky

WORKERS = 2


def workers(subject: Subject) -> None:
    """Check that trials are bitwise identical in this process and in two workers."""
    if not subject.travels:
        raise SkipTest("only registered models and models of a file run in workers")
    jobs = list(every_way(subject))
    engine = Loky(WORKERS)
    try:
        sent = list(engine.start().map(run, jobs))
    finally:
        engine.stop()
    for job, theirs in zip(jobs, sent, strict=True):
        mine = run(job)
        if mismatch := _difference(mine, theirs):
            place = of_function(subject.model.advance)
            raise AssertionError(
                f"{place}: {mismatch} ({in_words(job)}); a trial may depend only on the"
                " job: draw only from rng, and change nothing outside the flock and"
                " work"
            )


def _difference(mine: Result, theirs: Result) -> str | None:
    if mine.status != theirs.status:
        error = theirs.error.partition("\n")[0] or mine.error.partition("\n")[0]
        return (
            f"a trial is {mine.status} in one process, but {theirs.status} in two:"
            f" {error}"
        )
    assert mine.trajectory is not None
    assert theirs.trajectory is not None
    if mine.trajectory.tobytes() != theirs.trajectory.tobytes():
        return "a trial has other positions in one process than in two"
    return None
