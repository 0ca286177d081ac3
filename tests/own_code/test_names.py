"""A name that stands for nothing is said before anything is compiled, and what numba
alone can find is announced once.
"""

import logging
from pathlib import Path

import pytest

from tests.commands import sweep
from tests.testing.models import LINE, inside, written

SPEC = """
study: drawn
model: ./drawn.py
fixed: {n: 5, steps: 2}
sweep: {gain: [0.01, 0.02, 0.03]}
replicates: 1
"""


def said(folder: Path, command: str, caplog: pytest.LogCaptureFixture) -> list[str]:
    """What is said of a spec that cannot run: the log, then the error."""
    (folder / "spec.yaml").write_text(SPEC)
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        done = sweep(folder, command, "spec.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    lines = [line for line in done.stderr.splitlines() if "compiling" not in line]
    return [*(record.getMessage() for record in caplog.records), *lines]


@pytest.mark.parametrize("command", ["plan", "launch", "warm"])
@pytest.mark.parametrize(
    ("code", "within"),
    [
        ("vx += gian", inside("vx += gian")),
        ("return x, y + gian", ("    return x, y", f"    return x, y + gian  {LINE}")),
    ],
    ids=["in the step", "in what it calls"],
)
def test_nothing_is_compiled_before_names_stand_for_something(
    code: str,
    within: tuple[str, str],
    command: str,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
) -> None:
    path, line = written(tmp_path, within)
    assert path.name == "drawn.py"
    assert said(tmp_path, command, caplog) == [
        f'spec.yaml:3: drawn.py, line {line}, "{code}  {LINE}": the name "gian" is'
        " not defined; define or import it"
    ]


def test_compiling_is_said_once_though_three_trials_are_tried(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    written(tmp_path, inside("vx += flock.z[i]"))
    compiling, error = said(tmp_path, "plan", caplog)
    assert compiling.startswith("compiling drawn, about ")
    assert 'there is no "z" in Flock' in error
