"""What the assembler makes of a model for GPUs of several kinds, without one."""

from typing import Any

import pytest

from kernels.models import MODELS
from sweep.trial import on_device
from tests.builders import exact_jobs

assembly: Any = pytest.importorskip(
    "kernels.device.assembly", reason="the extra `gpu` is not installed"
)
ptx: Any = pytest.importorskip("kernels.device.ptx")

CAPABILITIES = (8, 0), (9, 0), (10, 0), (12, 0)
"""Of an A100, an H100 or H200, a B200, and a card of that generation for desks."""
REGISTERS = 255
"""Of a thread at most, in all of these."""
PARAMETER_BYTES = 4096
"""Of a kernel that any of them takes."""
STACK = 2**19
"""The bytes of its own that a thread may have, in all of these."""
FAST = "vicsek1995"


def kernel(model: str) -> Any:
    prepared = on_device._prepared(next(iter(exact_jobs(model))))
    assert prepared is not None
    return on_device._batch([prepared]).kernel


@pytest.mark.slow
@pytest.mark.parametrize(
    "model",
    [
        pytest.param(model, marks=() if model == FAST else pytest.mark.slow)
        for model in MODELS
    ],
)
def test_a_model_is_assembled_within_what_a_thread_has(model: str) -> None:
    one = kernel(model)
    made = assembly.assemble(ptx.ptx_of(one, (9, 0)).text, (9, 0))
    assert made.code.startswith(b"\x7fELF")
    assert 0 < made.needs.registers <= REGISTERS
    assert made.needs.stack <= STACK
    assert 8 * (len(one.numbers) + len(one.arrays)) <= PARAMETER_BYTES


@pytest.mark.slow
@pytest.mark.parametrize("capability", CAPABILITIES)
def test_other_gpus_have_their_code(capability: tuple[int, int]) -> None:
    made = ptx.ptx_of(kernel(FAST), capability)
    assert made.refusal == ""
    assert assembly.assembled(made.text, capability).code.startswith(b"\x7fELF")


@pytest.mark.slow
def test_with_fewer_registers_more_is_in_memory() -> None:
    text = ptx.ptx_of(kernel(FAST), (9, 0)).text
    many, few = (assembly.assembled(text, (9, 0), most).needs for most in (255, 128))
    assert few.registers <= 128 < many.registers
    assert few.spilled > many.spilled


def test_what_is_no_text_of_a_gpu_is_refused_with_the_words_of_the_assembler() -> None:
    with pytest.raises(assembly.AssemblyError, match="does not match type"):
        assembly.assemble("no text", (9, 0))
    with pytest.raises(assembly.AssemblyError, match=r"sm_13: .*UNSUPPORTED_ARCH"):
        assembly.assemble("no text", (1, 3))


TEXT = """
.version 7.0
.target sm_80
.address_size 64
.visible .entry nothing(.param .u64 nothing_param_0)
{
    ret;
}
"""


def test_code_is_assembled_once(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("kernels.caching.FOLDER", tmp_path)
    first = assembly.assembled(TEXT, (8, 0))
    assert first == assembly.assemble(TEXT, (8, 0))
    [place] = tmp_path.glob("*.cubin")
    assert place.read_bytes().endswith(first.code)
    place.write_bytes(b"1 2 3 4\nkept")
    assert assembly.assembled(TEXT, (8, 0)) == (b"kept", (1, 2, 3, 4))
    other = TEXT.replace("ret;", "bar.sync 0; ret;")
    codes = first.code, b"kept"
    assert assembly.assembled(TEXT, (9, 0)).code not in codes
    assert assembly.assembled(other, (8, 0)).code not in codes


def test_what_a_thread_needs_is_that_of_an_empty_function() -> None:
    needs = assembly.assemble(TEXT, (9, 0)).needs
    assert 0 < needs.registers < 32
    assert needs[1:] == (0, 0, 0)
