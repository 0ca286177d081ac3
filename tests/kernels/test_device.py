"""Models on a GPU: what they are compiled to, without one."""

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from kernels import indices
from kernels.jit import jit, jit_with_memory
from kernels.metrics import METRICS
from kernels.models import MODELS
from kernels.recording import Frames
from kernels.state import remember
from sweep.trial import on_device
from tests import builders
from tests.trial import test_all_layers

pytest.importorskip("numba_cuda", reason="the extra `gpu` is not installed")
ptx: Any = pytest.importorskip("kernels.device.ptx")

MEASURED_BY = {"vicsek1995": 33, "strombom2014": 39}
"""How many metrics a device measures of the flights of these models, which are compiled
with all of them: strombom2014 has kinds of boids. Others have the speed.
"""


def compiled(model: str) -> Any:
    """What trials of a model are compiled to, with what a device measures of them."""
    job = next(iter(builders.exact_jobs(model)))
    metrics = tuple(
        name for name in job.record.metrics if on_device.is_there(METRICS[name])
    )
    if model in MEASURED_BY:
        assert len(metrics) == MEASURED_BY[model]
    record = replace(
        job.record,
        metrics=metrics if model in MEASURED_BY else ("speed",),
        series=(),
    )
    return ptx.ptx_of(on_device.kernel_of(replace(job, record=record)))


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_a_model_has_only_exact_operations(model: str) -> None:
    """It is compiled with its metrics, from the large arrays of many flights."""
    made = compiled(model)
    assert made.refusal == ""
    assert "sqrt.rn.f64" in made.text
    assert made.text.count(".entry") == 1


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_a_model_with_all_layers_has_only_exact_operations(model: str) -> None:
    """Senses, motors, wind, robots that differ, goals in turn, obstacles that move."""
    job = test_all_layers.a_job(model)
    assert ptx.ptx_of(on_device.kernel_of(job)).refusal == ""


@pytest.mark.slow
def test_without_its_option_the_compiler_fuses(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the option, and what looks for fused operations, are both needed."""
    monkeypatch.setattr(ptx, "OPTIONS", {"opt": 3})
    assert re.search(r"[1-9]\d* fused operations", compiled("vicsek1995").refusal)


INEXACT = """// remainders of floats: 2
.visible .entry begin(
.weak .func  (.param .b32 func_retval0) inner(
    fma.rn.f64 %fd4, %fd2, %fd1, %fd3;
    rcp.approx.ftz.f64 %fd4, %fd2;
    mad.lo.s64 %rd1, %rd2, %rd3, %rd4;
    add.f64 %fd4, %fd2, %fd1;
    mul.rn.f64 %fd4, %fd2, %fd1;
    min.f64 %fd4, %fd2, 0d0000000000000000;
    max.f64 %fd4, %fd2, 0d8000000000000000;
    max.f64 %fd4, %fd2, 0d0000000000000000;
    { // callseq 0, 0
    call.uni (retval0),
    __internal_power,
    (param0);
    call.uni (retval0),
    inner,
    (param0);
"""


def test_what_is_not_exact_is_found_in_a_text() -> None:
    """A function of the text itself may be called."""
    made = ptx.Compiled(INEXACT)
    assert made.entry == "begin"
    assert made.refusal == (
        "1 fused operations, 1 fusible operations, 1 approximate operations,"
        " 2 sign of zero operations, 2 remainder operations, calls of __internal_power"
    )


@jit
def inexact(
    frames: Frames, filled: int, _ground: Any, _observation: Any, values: Any
) -> None:
    """A metric of a user."""
    for f in range(filled):
        x = frames.integrals[f, 0]
        values[f] = min(0.0, x) + x % 0.7


@jit_with_memory
def sorted_first(
    frames: Frames, filled: int, _ground: Any, _observation: Any, values: Any
) -> None:
    """A metric of a user, which needs memory that a thread has not."""
    for f in range(filled):
        values[f] = np.sort(frames.integrals[f])[0]


@jit
def stand(
    flock: Any,
    _world: Any,
    _params: Any,
    work: Any,
    _record: Any,
    _rng: Any,
    steps: int,
) -> bool:
    """The steps of boids that stand and that nobody looks at: compiled sooner than
    those of any model.
    """
    for _ in range(steps):
        remember(flock, work.before)
    return True


def said_of(measure: Any) -> str:
    """What is said of trials with a metric of a user."""
    job = builders.job("vicsek1995", "as_run", metrics=("speed",))
    whole = on_device.kernel_of(job)
    model = whole.model._replace(advance=stand)
    kernel = replace(whole, model=model, measures=(measure,))
    return str(ptx.Compiled(ptx._compiled(kernel, ptx.CAPABILITY)).refusal)


@pytest.mark.slow
def test_what_a_gpu_has_otherwise_in_a_metric_is_refused() -> None:
    """Of 0 and -0 a GPU takes -0, and a processor the first one. A GPU has another
    remainder of floats, and the text of its instructions shows no trace of it.
    """
    words = r"[1-9]\d* sign of zero operations, [1-9]\d* remainder operations"
    assert re.fullmatch(words, said_of(inexact))


def test_what_cannot_be_compiled_is_refused_with_the_reason() -> None:
    with pytest.raises(ptx.NotForDeviceError, match="model vicsek1995: "):
        said_of(sorted_first)


def test_marks_that_do_not_lie_together_are_read_as_those_that_do() -> None:
    rng = np.random.default_rng(3)
    apart = rng.random((200, 3)) < 0.3
    together = indices.build_marks(200)
    together[:200] = apart[:, 1]
    for first in map(np.uint64, (0, 64, 128)):
        assert indices.collected(apart[:, 1], first) == indices.word(together, first)


ODD = [0.0, -0.0, 1.5, -2.0, math.inf, -math.inf, math.nan]


def test_what_stands_in_for_functions_has_their_values() -> None:
    """Those that are plain Python; the others are single instructions."""
    here = dict(ptx.HERE)
    for one in ODD:
        for other in ODD:
            for plain in (max, min):
                found, meant = here[plain](one, other, 1.0), plain(one, other, 1.0)
                assert np.float64(found).tobytes() == np.float64(meant).tobytes()
