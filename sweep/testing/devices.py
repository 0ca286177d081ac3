"""That a model can fly on a GPU with the same bits."""

from importlib.util import find_spec
from unittest import SkipTest

from sweep.testing.flights import every_way
from sweep.testing.subject import Subject
from sweep.text import installing
from sweep.trial.on_device import refusal_of

COMPILER = "numba_cuda"


def device(subject: Subject) -> None:
    """What a step is compiled to for a GPU has exact operations alone. No GPU is needed
    for that. Nothing is broken by a model that only processors fly.
    """
    if find_spec(COMPILER) is None:
        raise SkipTest(f"not looked at: the compiler comes with {installing('gpu')}")
    if why := refusal_of(next(every_way(subject))):
        raise SkipTest(f"processors alone fly it: {why}")
