"""Whether a model can fly on a GPU is said of each, and breaks nothing."""

from importlib.util import find_spec
from pathlib import Path
from unittest import SkipTest

import pytest

from sweep.testing import assert_keeps
from tests.testing.models import doing, written

MODEL = "nguyen2024"


@pytest.fixture
def compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler for GPUs is there, of which nothing is asked."""
    monkeypatch.setattr("sweep.testing.devices.find_spec", lambda name: name)


@pytest.mark.usefixtures("compiler")
def test_a_model_with_exact_operations_keeps_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []
    monkeypatch.setattr("sweep.testing.devices.refusal_of", asked.append)
    assert_keeps(MODEL, "device")
    assert [job.model for job in asked] == [MODEL]


@pytest.mark.usefixtures("compiler")
def test_another_breaks_nothing_and_the_reason_is_said(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sweep.testing.devices.refusal_of", lambda _job: "55 fused")
    with pytest.raises(SkipTest, match="only processors can run the model: 55 fused"):
        assert_keeps(MODEL, "device")


def test_without_the_compiler_nobody_has_looked() -> None:
    said = 'not checked: install the compiler with pip install "boidsweep[gpu]"'
    with pytest.raises(SkipTest) as skipped:
        assert_keeps(MODEL, "device")
    assert str(skipped.value) == said


@pytest.mark.slow
def test_a_model_is_compiled_for_a_gpu(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """No GPU is needed. A model with NumPy's normal numbers is refused."""
    pytest.importorskip("numba_cuda", reason="the extra `gpu` is not installed")
    monkeypatch.setattr("sweep.testing.devices.find_spec", find_spec)
    assert_keeps(MODEL, "device")
    normal, _ = written(tmp_path, doing("vx += 0.01 * rng.normal(0.0, 1.0)"))
    with pytest.raises(SkipTest, match="normal"):
        assert_keeps(normal, "device")
