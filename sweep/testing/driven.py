"""The check that a model with actuators drives each of its boids."""

from dataclasses import replace
from unittest import SkipTest

from kernels.robots.publishers import drives, publishes
from sweep.design.motors import LINE
from sweep.testing.flights import every_way, fly, in_words
from sweep.testing.places import of_function
from sweep.testing.subject import Subject

LAG = 2.0
"""Lag of the actuators, in steps."""


def motors(subject: Subject) -> None:
    """Check that a trial with actuators drives each boid once in each step."""
    advance = subject.model.advance
    place = of_function(advance)
    if not drives(advance):
        raise SkipTest(f"it calls no `drive`: motors need `{LINE}` before confine")
    if not publishes(advance):
        raise AssertionError(f"{place}: it calls `drive`, but no `publish`")
    for job in every_way(subject):
        motored = job.settings | {"motor_lag": LAG * float(job.settings["dt"])}
        try:
            fly(replace(job, settings=motored))
        except RuntimeError as error:
            raise AssertionError(f"{place}: {error} ({in_words(job)})") from None
