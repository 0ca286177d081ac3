"""The check that a model can run on a GPU with bitwise identical results."""

from importlib.util import find_spec
from unittest import SkipTest

from sweep.testing.flights import every_way
from sweep.testing.subject import Subject
from sweep.text import installing
from sweep.trial import refusal_of

COMPILER = "numba_cuda"


def device(subject: Subject) -> None:
    """Check that a step compiles for a GPU to exact operations only.

    The check needs no GPU. A model that only processors can run breaks no promise.
    """
    if find_spec(COMPILER) is None:
        raise SkipTest(f"not checked: install the compiler with {installing('gpu')}")
    if why := refusal_of(next(every_way(subject))):
        raise SkipTest(f"only processors can run the model: {why}")
