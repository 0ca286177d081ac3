"""Trials as WebAssembly: the bits of processors, for every model and every layer."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import wasmtime
from hypothesis import given
from hypothesis import strategies as st

from kernels.device import wasm, wasmtime_host
from kernels.device.batch import DeviceError
from kernels.device.wasmtime_host import Wasm
from kernels.models import MODELS
from sweep.trial import on_device
from sweep.trial.on_device import DeviceTrials, flown
from tests.builders import exact_jobs, job
from tests.trial import test_all_layers
from tests.trial.test_on_device import FAST, check, some
from tests.trial.test_trial import OVERFLOWS

OTHER = "nguyen2024"
"""Tests that are not slow compile this model and FAST."""


def small(model: str, **changes: Any) -> list[Any]:
    """Jobs without a map, with the metrics of the model."""
    base = job(model, "as_run", n=12, steps=20, every=3, **changes)
    return [replace(base, seed=base.seed + k, replicate=k) for k in range(3)]


class OfModule:
    """A function that modules have in place of that of the library of C."""

    def __init__(self, name: str, second: str) -> None:
        text = f"""
target triple = "{wasm.TRIPLE}"
declare double @{name}(double, {second})
define double @alone(double %x, {second} %y) {{
  %result = call double @{name}(double %x, {second} %y)
  ret double %result
}}
"""
        code = wasm._linked(wasm._for_wasm(text, "alone"))
        engine = wasmtime.Engine()
        self.store = wasmtime.Store(engine)
        size = wasmtime.MemoryType(wasmtime.Limits(32, 32))
        self.memory = wasmtime.Memory(self.store, size)
        module = wasmtime.Module(engine, code)
        exports = wasmtime.Instance(self.store, module, [self.memory])
        self.function: Any = exports.exports(self.store)["fly"]

    def __call__(self, *arguments: float) -> float:
        return float(self.function(self.store, *arguments))


module_function = cache(OfModule)
EXTREMES = 0.0, -0.0, 5e-324, -2.2e-308, 1.7e308, math.inf, -math.inf, math.nan
ADDRESS = 64


def equal(first: float, second: float) -> bool:
    """True for equal bits; each NaN counts as equal."""
    if math.isnan(first) or math.isnan(second):
        return math.isnan(first) and math.isnan(second)
    return first.hex() == second.hex()


def product(x: float, n: int) -> float:
    """The product of a number with a power of two, by the library of C."""
    with np.errstate(all="ignore"):
        return float(np.ldexp(x, n))


@given(st.sampled_from(EXTREMES) | st.floats(), st.sampled_from(EXTREMES) | st.floats())
def test_the_next_number_is_that_of_c(x: float, y: float) -> None:
    next_of = module_function("numba_nextafter", "double")
    assert equal(next_of(x, y), float(np.nextafter(x, y)))


@given(st.sampled_from(EXTREMES) | st.floats(), st.integers(-2300, 2300))
def test_the_product_with_a_power_of_two_is_that_of_c(x: float, n: int) -> None:
    assert equal(module_function("numba_ldexp", "i32")(x, n), product(x, n))


@pytest.mark.parametrize("n", [2**31 - 1, -(2**31)])
def test_extreme_powers_of_two_are_those_of_c(n: int) -> None:
    for x in EXTREMES:
        assert equal(module_function("numba_ldexp", "i32")(x, n), product(x, n))


@given(st.sampled_from(EXTREMES) | st.floats())
def test_the_parts_of_a_number_are_those_of_c(x: float) -> None:
    parts = module_function("numba_frexp", "ptr")
    fraction = parts(x, ADDRESS)
    content = parts.memory.read(parts.store, ADDRESS, ADDRESS + 4)
    expected, power = math.frexp(x)
    assert equal(fraction, expected)
    assert int.from_bytes(content, "little", signed=True) == power


def test_trials_have_the_bits_of_processors() -> None:
    """With maps, drawn obstacles, events and coverage; several programs in turn."""
    device = Wasm()
    jobs = some(heatmaps=True)
    for together in (jobs, small(OTHER), jobs[:1]):
        check(together, flown(together, device))


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_every_model_has_its_bits(model: str) -> None:
    """All presets, updates, borders and maps, with all metrics."""
    jobs = list(exact_jobs(model))
    check(jobs, DeviceTrials(Wasm).several(jobs))


@pytest.mark.slow
@pytest.mark.parametrize("model", MODELS)
def test_every_layer_has_its_bits(model: str) -> None:
    """Senses, motors, wind, goals in turn, and obstacles that move, of any shape."""
    base = test_all_layers.a_job(model)
    jobs = [replace(base, seed=base.seed + k) for k in range(3)]
    check(jobs, flown(jobs, Wasm()))


@pytest.mark.slow
def test_a_long_trial_has_its_bits() -> None:
    jobs = some(2, n=60, steps=5000, every=100)
    check(jobs, flown(jobs, Wasm()))


def test_a_trial_that_diverges_ends_alone() -> None:
    jobs = some(3)
    lost = replace(jobs[1], settings=jobs[1].settings | OVERFLOWS[FAST])
    together = [jobs[0], lost, jobs[2]]
    results = flown(together, Wasm())
    check(together, results)
    assert [one.status for one in results] == ["done", "diverged", "done"]


def test_built_in_models_call_nothing() -> None:
    assert on_device.refusal_of_wasm(some(1)[0]) == ""
    assert "relaxed" not in wasm.FEATURES


def test_a_module_that_calls_its_surroundings_is_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Such as a sine, which each machine rounds as it likes."""
    text = f"""
target triple = "{wasm.TRIPLE}"
declare double @sin(double)
define double @alone(double %x) {{
  %y = call double @sin(double %x)
  ret double %y
}}
"""
    module = wasm.Module(wasm._linked(wasm._for_wasm(text, "alone")))
    assert module.refusal == "calls of sin"
    monkeypatch.setattr(wasmtime_host, "module_of", lambda _: module)
    monkeypatch.setattr(wasm, "module_of", lambda _: module)
    jobs = some(1)
    assert on_device.refusal_of_wasm(jobs[0]) == "calls of sin"
    with pytest.raises(DeviceError, match=f"model {FAST}: calls of sin"):
        flown(jobs, Wasm())


def test_a_batch_without_room_is_halved(monkeypatch: pytest.MonkeyPatch) -> None:
    jobs = some(4)
    device = Wasm()
    check(jobs[:1], flown(jobs[:1], device))
    one = device._top
    check(jobs, flown(jobs, device))
    most = device._top
    monkeypatch.setattr(wasmtime_host, "MEMORY", (one + most) // 2)
    monkeypatch.setattr(on_device, "SHARE", 10.0)  # as if other programs took memory
    check(jobs, flown(jobs, device))
    monkeypatch.setattr(wasmtime_host, "MEMORY", one - 8)
    [result] = flown(jobs[:1], device)
    assert "WebAssembly has too little memory for one trial" in str(result.error)


def test_a_module_that_fails_is_a_failure_of_the_device(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    device = Wasm()
    jobs = some(1)
    load = Wasm.load

    def elsewhere(self: Wasm, kernel: Any) -> Any:
        return load(self, kernel)._replace(scratch=wasmtime_host.MEMORY - 8)

    monkeypatch.setattr(Wasm, "load", elsewhere)
    with pytest.raises(DeviceError, match=r"WebAssembly: error(.|\n)*out of bounds"):
        flown(jobs, device)
