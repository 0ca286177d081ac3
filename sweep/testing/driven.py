"""The check that a model with actuators drives each of its boids."""

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
    """Check that the source of a model does what the model declares of its robots.

    Raises AssertionError where it does not, and SkipTest for a model that does not
    declare it.
    """
    model = subject.model
    if missing := to_declare(model):
        raise SkipTest(f"its Model does not say what robots can do: add {missing}")
    by_source = in_source(model)._asdict()
    for name, value in declared(model).items():
        in_order = sorted if name == "shared" else bool
        if in_order(value) != in_order(by_source[name]):
            raise AssertionError(
                f"{of_field(model, name)}: {name} is {value!r}, and by its source"
                f" {by_source[name]!r}"
            )


def motors(subject: Subject) -> None:
    """Check that a trial with actuators drives each boid once in each step."""
    advance = subject.model.advance
    place = of_function(advance)
    if why := why_not(subject.model, "drives"):
        change = remedy(subject.model, "drives", f"before confine write `{LINE}`")
        raise SkipTest(f"{why}; for motors {change}")
    if not abilities(subject.model).publishes:
        raise AssertionError(f"{place}: it calls `drive`, but no `publish`")
    for job in every_way(subject):
        motored = job.settings | {"motor_lag": LAG * float(job.settings["dt"])}
        try:
            fly(replace(job, settings=motored))
        except RuntimeError as error:
            raise AssertionError(f"{place}: {error} ({in_words(job)})") from None
