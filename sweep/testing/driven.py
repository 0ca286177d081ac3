"""The check that a model with actuators drives every boid."""

from dataclasses import replace
from unittest import SkipTest

from kernels.robots.abilities import (
    abilities,
    declared,
    in_source,
    remedy,
    to_declare,
    why_not,
)
from sweep.design import LINE
from sweep.testing.flights import every_way, fly, in_words
from sweep.testing.places import of_field, of_function
from sweep.testing.subject import Subject

LAG = 2.0
"""Lag of the actuators, in steps."""


def robots(subject: Subject) -> None:
    """Check that the source of a model has the declared abilities of robots.

    Raises AssertionError if source and declaration differ, and SkipTest for a model
    without a declaration.
    """
    model = subject.model
    if missing := to_declare(model):
        raise SkipTest(f"the Model declares no abilities of robots: add {missing}")
    by_source = in_source(model)._asdict()
    for name, value in declared(model).items():
        in_order = sorted if name == "shared" else bool
        if in_order(value) != in_order(by_source[name]):
            raise AssertionError(
                f"{of_field(model, name)}: {name} is {value!r}, but the source has"
                f" {by_source[name]!r}"
            )


def motors(subject: Subject) -> None:
    """Check that a trial with actuators drives each boid once in each step."""
    advance = subject.model.advance
    place = of_function(advance)
    if why := why_not(subject.model, "drives"):
        change = remedy(subject.model, "drives", f"before confine write `{LINE}`")
        raise SkipTest(f"{why}; for actuation {change}")
    if not abilities(subject.model).publishes:
        raise AssertionError(f"{place}: calls `drive`, but not `publish`")
    for job in every_way(subject):
        motored = job.settings | {"motor_lag": LAG * float(job.settings["dt"])}
        try:
            fly(replace(job, settings=motored))
        except RuntimeError as error:
            raise AssertionError(f"{place}: {error} ({in_words(job)})") from None
