"""Compiled kernels: the same bits as the interpreter, one signature a model, and a
cache that notices edits.
"""

import re
import shutil
from pathlib import Path

import pytest

from kernels.jit import jit
from sweep.trial.simulation import run
from tests import ROOT, builders
from tests.commands import python
from tests.interpreter import interpreted


@pytest.mark.slow
def test_the_interpreter_gives_the_same_bits() -> None:
    """And warns of nothing: every division by zero, overflow and invalid value in a
    rule is an error there.
    """
    code = (
        "from tests import builders\n"
        "for model in builders.MODELS:\n    for job in builders.exact_jobs(model):"
        " print(builders.bits(job))"
    )
    plain = interpreted(code).split()
    jobs = [job for model in builders.MODELS for job in builders.exact_jobs(model)]
    different = [
        job.settings
        for job, bits in zip(jobs, plain, strict=True)
        if builders.bits(job) != bits
    ]
    assert different == []


@pytest.mark.parametrize("model", builders.MODELS)
def test_whole_and_fractional_numbers_share_one_compiled_signature(model: str) -> None:
    """A large flock, which another test may have flown before, has its own."""
    run(builders.job(model, n=5, steps=2))
    before = list(builders.MODELS[model].advance.signatures)
    for number in (1, 1.0, 1.5, True + 1):
        weights = {
            name: number
            for name, off in builders.weightless(model).items()
            if isinstance(off, float) and name not in builders.IDEAL
        }
        size = builders.scaled(model, width=400 + number, height=300)
        assert (
            run(builders.job(model, n=5, steps=2, **size, **weights)).status == "done"
        )
    for update in builders.UPDATES:
        assert (
            run(builders.job(model, n=6, steps=2, update=update, heatmaps=True)).status
            == "done"
        )
    assert builders.MODELS[model].advance.signatures == before


@jit
def halved(x: float, times: int = 1) -> float:
    return x if times == 0 else 0.5 * halved(x, times - 1)


@jit
def quartered(x: float) -> float:
    return halved(times=2, x=x) + 0.0 * halved(x)


@pytest.mark.slow
def test_what_kernels_call_is_compiled_for_python_when_python_calls_it() -> None:
    """Without wrappers it could not be called there."""
    assert quartered(6.0) == 1.5
    assert halved.signatures == []
    assert (halved(6.0), halved(6.0, 2), quartered(2.0)) == (3.0, 1.5, 0.5)
    assert len(halved.signatures) == 2


@pytest.fixture
def copied(tmp_path: Path) -> Path:
    """A copy of the kernels alone, with what Python has made of their sources: so a
    process that imports them starts sooner.
    """
    shutil.copytree(ROOT / "kernels", tmp_path / "kernels")
    return tmp_path


def cache_files(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*.nb?")}


CALLER = """
from kernels.jit import jit
from kernels.rules.borders import confine

@jit
def reflected(x: float) -> float:
    return confine(x, 1.0, 800.0, 2)[0]
"""
CALL = (
    "from kernels.caller import reflected; from kernels.stamps import stamp;"
    " print(stamp(reflected), reflected(-3.0))"
)


def test_an_edited_rule_changes_the_number_and_the_stamp_though_its_caller_was_cached(
    copied: Path,
) -> None:
    """The caller stands in another file, which numba's own check of the cache does not
    look beyond. Without an edit a second process compiles nothing.
    """
    (copied / "kernels" / "caller.py").write_text(CALLER)
    cache = str(copied / "cache")
    outcomes, files = [], []
    for _ in range(2):
        outcomes.append(python(CALL, copied, NUMBA_CACHE_DIR=cache).split())
        files.append(cache_files(copied / "cache"))
    assert len(files[0]) > 0
    assert outcomes[0] == outcomes[1]
    assert files[0] == files[1]
    sha, value = outcomes[0]
    rule = copied / "kernels" / "rules" / "borders.py"
    edited = re.sub(r"= -position,", "= -2.0 * position,", rule.read_text())
    assert edited != rule.read_text()
    rule.write_text(edited)
    new_sha, new_value = python(CALL, copied, NUMBA_CACHE_DIR=cache).split()
    assert (float(value), float(new_value)) == (3.0, 6.0)
    assert sha != new_sha


FULL = """
import errno, os
from kernels import caching

def full(*_):
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

caching.IndexDataCacheFile.save = full
"""


def test_what_cannot_be_kept_is_compiled_all_the_same(copied: Path) -> None:
    (copied / "kernels" / "caller.py").write_text(CALLER)
    cache = str(copied / "cache")
    code = f"{FULL}{CALL}\nprint(caching.NOT_KEPT)"
    value, why = python(code, copied, NUMBA_CACHE_DIR=cache).splitlines()
    assert value.split()[1] == "3.0"
    assert why == str({f"{cache}/boidsweep/kernels": "No space left on device"})
    assert cache_files(copied / "cache") == {}


SCALED = """
from kernels.jit import jit
from kernels.scale import SCALE

@jit
def scaled(x: float) -> float:
    return SCALE * x
"""
EDIT = """
from pathlib import Path
from kernels import scale
from kernels.scaled import scaled

Path(scale.__file__).write_text("SCALE = 5.0")
print(scaled(1.0))
"""


def test_an_edit_after_the_import_is_not_taken_for_what_runs(copied: Path) -> None:
    """Else what is compiled of the earlier code would be kept as that of the edited."""
    (copied / "kernels" / "scale.py").write_text("SCALE = 2.0\n")
    (copied / "kernels" / "scaled.py").write_text(SCALED)
    cache = str(copied / "cache")
    values = [python(EDIT, copied, NUMBA_CACHE_DIR=cache) for _ in range(2)]
    assert list(map(float, values)) == [2.0, 5.0]


LARGE = """
import numpy as np
from kernels.jit import jit

TABLE = {} * np.arange(200_000.0)

@jit
def looked_up(index: int) -> float:
    return TABLE[index]

@jit
def doubled(index: int) -> float:
    return 2.0 * looked_up(index)
"""
LOOK = """
import warnings

with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    from kernels.large import doubled
    print(doubled(7), any("Cannot cache" in str(one.message) for one in said))
"""


def test_what_reads_a_table_of_over_a_megabyte_is_compiled_and_not_kept(
    copied: Path,
) -> None:
    """It has the address of the table, which another process has elsewhere."""
    cache = copied / "cache"
    for factor in (1.0, 3.0):
        (copied / "kernels" / "large.py").write_text(LARGE.format(factor))
        said = python(LOOK, copied, NUMBA_CACHE_DIR=str(cache)).split()
        assert said == [str(14.0 * factor), "True"]
    assert [file for file in cache_files(cache) if "large" in file.name] == []


@pytest.mark.slow
def test_what_is_compiled_without_optimization_is_kept_apart(copied: Path) -> None:
    """As far as it is kept: a function that calls another has its address then."""
    (copied / "kernels" / "caller.py").write_text(CALLER)
    cache = copied / "cache"
    outcomes, files = [], []
    for level in ("0", "0", "3", "3"):
        place = {"NUMBA_CACHE_DIR": str(cache), "NUMBA_OPT": level}
        outcomes.append(python(CALL, copied, **place))
        files.append(cache_files(cache))
    assert {float(one.split()[1]) for one in outcomes} == {3.0}
    assert files[0] == files[1]
    assert all(file.name.startswith("opt0-") for file in files[0])
    assert files[2] == files[3]
    added = files[2].keys() - files[0].keys()
    assert any("reflected" in file.name for file in added)
    assert not any("opt" in file.name for file in added)


CHANGED = """
import os
from kernels.jit import jit
from kernels.rules.borders import confine

confine(-3.0, 1.0, 800.0, 2)
os.environ["NUMBA_SHOW_HELP"] = "1"  # at the next call numba reads all settings again
confine(-3, 1.0, 800.0, 2)
from kernels.caller import reflected
print(reflected(-3.0))
"""


def test_kernels_are_kept_in_their_place_whatever_becomes_of_numbas_settings(
    copied: Path,
) -> None:
    (copied / "kernels" / "caller.py").write_text(CALLER)
    cache = copied / "cache"
    assert python(CHANGED, copied, NUMBA_CACHE_DIR=str(cache)) == "3.0\n"
    assert any("reflected" in file.name for file in cache_files(cache))


TAKING = """
from typing import NamedTuple
from kernels.jit import jit

class Step(NamedTuple):
    length: float

@jit
def doubled(step: Step) -> float:
    return 2.0 * step.length
"""
TAKE = "from kernels.caller import doubled; from {} import Step;"


@pytest.mark.slow
def test_what_takes_a_class_of_another_package_is_kept_apart(copied: Path) -> None:
    """That package may be gone, or be one's own code of another study: then what takes
    our classes is found as ever.
    """
    (copied / "kernels" / "caller.py").write_text(TAKING)
    other, cache = copied / "other.py", str(copied / "cache")
    other.write_text(TAKING)
    call = " print(doubled(Step(3.0)))"
    files, numbers = [], []
    for module in ("other", "kernels.caller", "other", "kernels.caller"):
        code = TAKE.format(module) + call
        if module != "other":
            other.rename(copied / "away.py")
        numbers.append(float(python(code, copied, NUMBA_CACHE_DIR=cache)))
        if module != "other":
            (copied / "away.py").rename(other)
        files.append(cache_files(copied / "cache"))
    assert numbers == [6.0] * 4
    assert files[0].keys() < files[1].keys()
    assert files[1] == files[2] == files[3]
