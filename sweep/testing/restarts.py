"""The check that a model resumes from any step as if never interrupted."""

from collections.abc import Iterator
from dataclasses import replace

from sweep.design import Job
from sweep.testing.flights import (
    STEPS,
    Flown,
    begun,
    difference,
    every_way,
    fly,
    in_words,
    resume,
)
from sweep.testing.places import of_function
from sweep.testing.subject import Subject

KEPT = (1, 4, STEPS - 1)
"""Steps after which the state is taken, so that another trial can resume."""


def restart(subject: Subject) -> None:
    """Check that a resumed trial is bitwise identical to an uninterrupted one.

    The trial resumes from a state in between, from the last state of a shorter trial,
    or runs step by step.
    """
    for job in every_way(subject):
        uninterrupted = fly(job)
        for way, flown in _ways(job):
            late = len(uninterrupted.steps) - len(flown.steps)
            rest = Flown(
                uninterrupted.bodies[late:],
                uninterrupted.steps[late:],
                uninterrupted.last,
            )
            if mismatch := difference(rest, flown, "without a pause", way):
                raise AssertionError(
                    f"{of_function(subject.model.advance)}: {mismatch}"
                    f" ({in_words(job)}); between steps keep values only in the flock"
                    " and in work, not in a variable, draw only from rng, and do not"
                    " use the number of remaining steps"
                )


def _ways(job: Job) -> Iterator[tuple[str, Flown]]:
    """Yield interrupted trials, each after a description of the interruption."""
    yield "step by step", fly(job, (1,) * STEPS)
    for step in KEPT:
        shorter = replace(job, settings=job.settings | {"steps": step})
        origins = ((job, ""), (shorter, ", the last step of a shorter trial"))
        for origin, ended in origins:
            if state := begun(origin, step):
                flown = resume(job, state, (STEPS - step,))
                yield f"when resumed from step {step}{ended}", flown
