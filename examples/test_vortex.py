"""Whether the model in vortex.py keeps what a model promises: run it with pytest."""

from pathlib import Path

import pytest

from sweep.testing import PROMISES, assert_keeps


@pytest.mark.parametrize("promise", PROMISES)
def test_the_model_keeps(promise: str) -> None:
    assert_keeps(Path(__file__).with_name("vortex.py"), promise)
