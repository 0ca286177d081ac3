"""What numba cannot compile is said in a sentence: each usual mistake, made."""

from pathlib import Path

import numpy as np
import pytest

from kernels.jit import jit
from sweep.testing.flights import a_job
from sweep.testing.subject import subject
from sweep.trial.numba_errors import explained
from sweep.trial.simulation import Simulation, run
from sweep.workers.failures import in_a_line
from tests.cases import slow_but
from tests.commands import sweep
from tests.testing.models import LINE, doing, inside, written

ALLOCATES = "this allocates memory for a new array, list, dictionary or string, which"
MISTAKES = {
    "a = np.zeros(3)": ALLOCATES,
    "a = np.array([vx, vy])": ALLOCATES,
    "vx += (flock.x - flock.y).sum()": ALLOCATES,
    "flock.vx[:] = seen.vx": ALLOCATES,
    "a = [vx, vy]; vx = a[0]": ALLOCATES,
    "vx = sorted((vx, vy))[0]": ALLOCATES,
    "vx += rng.normal(0.0, 1.0, 3)[0]": ALLOCATES,
    "vx += params.gian": 'there is no "gian" in Params; did you mean "gain"?',
    "vx += flock.z[i]": 'there is no "z" in Flock, which has x, y, vx,',
    "vx += gian": 'the name "gian" is not defined; define or import it',
    "vx += np.zeross(3)": 'there is no "zeross" in numpy',
    "vx += math.sine(vx)": 'there is no "sine" in math',
    "vx = plain(vx)": '"plain" is a plain Python function; put @jit above it',
    'vx += WORDS["a"]': '"WORDS" is a dict, which kernels cannot use',
    "TABLE[0] = vx": "this changes an array of the module, which is a constant",
    "a, b, c = pull(work.near, found)": (
        "3 names are on the left, and 2 values on the right"
    ),
    "a, b = vx": "several names are on the left, and one value (float64) on",
    "a, b = pull(work.near)": (
        "the call does not fit (near, found): missing a required argument: 'found'"
    ),
    "a, b = pull(work.near, found, 1)": "too many positional arguments",
    'vx = vx + "fast"': "numba has no add(float64, 'fast'); a name keeps one type",
    "vx = flock.x[0.5]": "numba has no getitem(array of float64, float64)",
    'flock.x[i] = "a"': "numba has no setitem(array of float64, int64, 'a')",
    "params.gain = 2.0": '"gain" of Params cannot be set, because a tuple is',
    "import math as m": "kernels know only a part of Python: put the import at the",
    "vx = sum(q for q in (vx, vy))": (
        "numba cannot compile this: The use of yield in a closure is unsupported."
    ),
}


def said_of(path: Path) -> str:
    """The sentence about the model in a file, whose kernels cannot be compiled."""
    with pytest.raises(Exception) as raised:  # noqa: PT011
        Simulation(a_job(subject(path), "as_run", obstacles=False)).advance(1)
    said = explained(raised.value)
    assert said is not None
    return said


ALLOCATING = [code for code, said in MISTAKES.items() if said == ALLOCATES]
OTHERS = [code for code in MISTAKES if code not in ALLOCATING]


@pytest.mark.parametrize("code", slow_but([*ALLOCATING[:2], *OTHERS], MISTAKES))
def test_a_mistake_is_said_with_file_line_code_and_rule(
    code: str, tmp_path: Path
) -> None:
    path, line = written(tmp_path, inside(code))
    said = said_of(path)
    assert said.startswith(f'drawn.py, line {line}, "{code}  {LINE}": ')
    assert MISTAKES[code] in said
    assert "\n" not in said


def test_the_line_is_that_of_the_function_with_the_mistake(tmp_path: Path) -> None:
    """In a function that `advance` calls, and whose mistake numba finds there."""
    within = ("    return x, y", f"    return x, y, np.zeros(found)  {LINE}")
    path, line = written(tmp_path, within)
    assert said_of(path).startswith(f"drawn.py, line {line}, ")
    early = f"    if found > 3:\n        return x  {LINE}\n    return x, y"
    path, line = written(tmp_path, ("    return x, y", early))
    said = said_of(path)
    assert said.startswith("drawn.py, line ")
    assert "returns values of different types" in said
    assert abs(int(said.split(",")[1].split()[1]) - line) <= 1


def test_a_name_that_stands_for_nothing_is_found_in_what_advance_calls(
    tmp_path: Path,
) -> None:
    """There numba says only where the function is called."""
    within = ("    return x, y", f"    return x, y + gian  {LINE}")
    path, line = written(tmp_path, within)
    assert said_of(path) == (
        f'drawn.py, line {line}, "return x, y + gian  {LINE}": the name "gian" is'
        " not defined; define or import it"
    )


def test_a_name_that_changes_its_type_is_found_where_it_is_used(tmp_path: Path) -> None:
    path, _ = written(tmp_path, doing("vx = None"))
    assert "numba has no mul(none, float64); a name keeps one type" in said_of(path)


def test_a_read_before_the_first_write_is_said(tmp_path: Path) -> None:
    after = (
        "        if not sequential:\n",
        "        later = 1.0\n        if not sequential:\n",
    )
    path, line = written(tmp_path, inside("vx += later"), after)
    assert f'line {line}, "vx += later  {LINE}": "later" is read before' in said_of(
        path
    )


@jit
def ranks(x: np.ndarray) -> float:
    """A kernel that is no model's."""
    return x[np.argsort(x)][0]


def test_a_kernel_of_any_kind_is_explained() -> None:
    with pytest.raises(Exception) as raised:  # noqa: PT011
        ranks(np.zeros(3))
    said = explained(raised.value)
    assert said is not None
    assert "test_numba_errors.py, line " in said
    assert f'"return x[np.argsort(x)][0]": {ALLOCATES}' in said


def test_other_errors_are_not_explained() -> None:
    with pytest.raises(ZeroDivisionError) as raised:
        _ = 1 / 0
    assert explained(raised.value) is None


def test_a_failed_trial_begins_with_the_sentence_and_has_the_traceback(
    tmp_path: Path,
) -> None:
    path, line = written(tmp_path, inside("vx += params.gian"))
    result = run(a_job(subject(path), "as_run", obstacles=False))
    sentence = f'drawn.py, line {line}, "vx += params.gian  {LINE}": there is no "gian"'
    assert result.status == "failed"
    assert result.error.startswith(sentence)
    assert "Traceback (most recent call last)" in result.error
    assert in_a_line(result.error).startswith(sentence)


def test_commands_say_it_before_any_work(tmp_path: Path) -> None:
    path, line = written(tmp_path, inside("vx += params.gian"))
    spec = f"study: mine\nmodel: ./{path.name}\npreset: as_run\nseed: 1\n"
    (tmp_path / "spec.yaml").write_text(f"{spec}replicates: 2\n")
    commands = (("plan",), ("launch",), ("warm",), ("view", "--no-open"))
    for command, *options in commands:
        done = sweep(tmp_path, command, "spec.yaml", *options)
        assert (done.returncode, done.stdout) == (2, "")
        *_, said = done.stderr.splitlines()
        where = "" if command == "view" else "spec.yaml:2: no trial can be run: "
        assert said == (
            f'{where}drawn.py, line {line}, "vx += params.gian  {LINE}": there is no'
            ' "gian" in Params; did you mean "gain"?'
        )
        assert done.stderr == said + "\n"
