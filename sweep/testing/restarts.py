"""That a model goes on from any step as if nothing had been in between."""

from collections.abc import Iterator
from dataclasses import replace

from sweep.design.jobs import Job
from sweep.testing.flights import (
    STEPS,
    Flown,
    begun,
    difference,
    every_way,
    fly,
    go_on,
    in_words,
)
from sweep.testing.places import of_function
from sweep.testing.subject import Subject

KEPT = (1, 4, STEPS - 1)
"""Steps after which the state is kept, and another flight goes on from it."""


def restart(subject: Subject) -> None:
    """A flight that goes on from a kept state, also from the last one of a shorter
    flight, or step by step, has the bits of one that was never interrupted.
    """
    for job in every_way(subject):
        whole = fly(job)
        for way, flown in _ways(job):
            late = len(whole.steps) - len(flown.steps)
            rest = Flown(whole.bodies[late:], whole.steps[late:], whole.last)
            if said := difference(rest, flown, "in one go", way):
                raise AssertionError(
                    f"{of_function(subject.model.advance)}: {said} ({in_words(job)});"
                    " from step to step keep only what is in the flock and in work, no"
                    " variable, draw only from rng, and do not ask how many steps are"
                    " left"
                )


def _ways(job: Job) -> Iterator[tuple[str, Flown]]:
    """What becomes of a trial that is interrupted, and how it is."""
    yield "step by step", fly(job, (1,) * STEPS)
    for step in KEPT:
        shorter = replace(job, settings=job.settings | {"steps": step})
        for one, ended in ((job, ""), (shorter, ", the last one of a shorter trial")):
            if state := begun(one, step):
                flown = go_on(job, state, (STEPS - step,))
                yield f"if it goes on from step {step}{ended}", flown
