"""That the boids of a model can be divided among threads, if it says so."""

from dataclasses import replace
from unittest import SkipTest

from sweep.testing.flights import difference, every_way, fly, in_words
from sweep.testing.places import of_function
from sweep.testing.subject import Subject

THREADS = (2, 3)


def threads(subject: Subject) -> None:
    """With the settings of its `at_once`, a flight has the same bits whether its boids
    are divided among threads or not.
    """
    needed, place = subject.model.at_once, of_function(subject.model.advance)
    if needed is None:
        raise SkipTest("it does not say that it updates all boids at once (at_once)")
    for job in every_way(subject):
        if any(job.settings[name] != value for name, value in needed.items()):
            continue
        alone = fly(job)
        for count in THREADS:
            try:
                divided = fly(replace(job, threads=count))
            except RuntimeError as error:
                raise AssertionError(f"{place}: {error}") from None
            if said := difference(alone, divided, "alone", f"in {count} threads"):
                raise AssertionError(
                    f"{place}: {said} ({in_words(job)}); a loop over boids may write"
                    " only what belongs to its boid, and read of the others only what"
                    " it does not write, as work.before; or take at_once away"
                )
