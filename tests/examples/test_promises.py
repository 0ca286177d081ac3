"""The examples keep what models promise."""

import pytest

from sweep.testing import PROMISES, assert_keeps
from tests.cases import slow_but
from tests.examples.flown import EXAMPLES

MODELS = sorted(path.stem for path in EXAMPLES.glob("*.yaml"))
LONG = ("workers", "threads", "motors")
"""Promises for which worker processes are started, or much is compiled."""
TRIED = slow_but([one for one in PROMISES if one not in LONG], PROMISES)


@pytest.mark.parametrize("promise", TRIED)
@pytest.mark.parametrize("model", MODELS)
def test_a_model_keeps(model: str, promise: str) -> None:
    assert_keeps(EXAMPLES / f"{model}.py", promise)
