"""The examples keep what models promise."""

import pytest

from sweep.testing import PROMISES, assert_keeps
from tests.cases import slow_but
from tests.examples.flown import EXAMPLES

MODELS = sorted(path.stem for path in EXAMPLES.glob("*.yaml"))
LONG = ("workers", "motors", "interpreter")
"""Promises for which processes are started, or much is compiled."""
EVERY = [(model, promise) for model in MODELS for promise in PROMISES]
FAST = [case for case in EVERY if case[1] not in LONG]


@pytest.mark.parametrize(
    ("model", "promise"), slow_but([*FAST, ("vortex", "interpreter")], EVERY)
)
def test_a_model_keeps(model: str, promise: str) -> None:
    assert_keeps(EXAMPLES / f"{model}.py", promise)
