"""Models on a GPU: what they are compiled to, without one."""

import math
import re
from typing import Any

import numpy as np
import pytest

from kernels import indices
from kernels.generator import stream_of
from kernels.models import MODELS
from sweep.trial.simulation import Simulation
from tests import builders

pytest.importorskip("numba_cuda", reason="the extra `gpu` is not installed")
device: Any = pytest.importorskip("kernels.device")

FAST = {"vicsek1995", "dorsogna2006", "couzin2002"}
"""Others are compiled as slow tests; each takes 5 to 20 s."""


def compiled(model: str) -> Any:
    simulation = Simulation(next(iter(builders.exact_jobs(model))))
    with simulation.noise.lent() as rng:
        stream = stream_of(rng)
    return device.compiled_for_device(simulation.flight, stream)


@pytest.mark.parametrize(
    "model",
    [
        pytest.param(model, marks=() if model in FAST else pytest.mark.slow)
        for model in MODELS
    ],
)
def test_a_model_has_only_exact_operations(model: str) -> None:
    made = compiled(model)
    assert made.refusal == ""
    assert "sqrt.rn.f64" in made.ptx


@pytest.mark.slow
def test_without_its_option_the_compiler_fuses(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the option, and what looks for fused operations, are both needed."""
    monkeypatch.setattr(device, "OPTIONS", {"opt": 3})
    assert re.search(r"[1-9]\d* fused operations", compiled("vicsek1995").refusal)


def test_what_is_not_exact_is_found_in_a_text() -> None:
    lines = """
    fma.rn.f64 %fd4, %fd2, %fd1, %fd3;
    rcp.approx.ftz.f64 %fd4, %fd2;
    mad.lo.s64 %rd1, %rd2, %rd3, %rd4;
    { // callseq 0, 0
    call.uni (retval0),
    __internal_power,
    (param0);
    """
    assert device.FUSED.findall(lines) == ["fma.rn.f64"]
    assert device.ROUGH.findall(lines) == ["rcp.approx.ftz"]
    assert device.CALL.findall(lines) == ["__internal_power"]


ODD = [0.0, -0.0, 1.5, -2.0, math.inf, -math.inf, math.nan]


def test_what_stands_in_for_functions_has_their_values() -> None:
    """Those that are plain Python; the others are single instructions."""
    here = dict(device.HERE)
    for one in ODD:
        for other in ODD:
            for plain in (max, min):
                found, meant = here[plain](one, other, 1.0), plain(one, other, 1.0)
                assert np.float64(found).tobytes() == np.float64(meant).tobytes()
    rng = np.random.default_rng(3)
    marks = indices.build_marks(200)
    marks[rng.integers(0, 200, 70)] = True
    for first in (0, 64, 128):
        at = np.uint64(first)
        assert here[indices.word](marks, at) == indices.word(marks, at)
