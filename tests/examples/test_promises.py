"""The examples keep what models promise."""

import pytest

from sweep.testing import PROMISES, assert_keeps
from tests.cases import slow_but
from tests.examples.flown import EXAMPLES

MODELS = sorted(path.stem for path in EXAMPLES.glob("*.yaml"))
LONG = ("workers", "motors", "interpreter")
"""Promises for which processes are started, or much is compiled."""
EVERY = [(model, promise) for model in MODELS for promise in PROMISES]
TWINNED = "flocking"
"""A model that differs from the others in its random order, which its twin tests."""
FAST = [
    case
    for case in EVERY
    if case[1] not in LONG and (case[0] != TWINNED or case[1] == "restart")
]


@pytest.mark.parametrize(
    ("model", "promise"), slow_but([*FAST, ("vortex", "interpreter")], EVERY)
)
def test_a_model_keeps(model: str, promise: str) -> None:
    assert_keeps(EXAMPLES / f"{model}.py", promise)
