"""A study of a million trials: the launcher's memory stays small, its folder has few
files, and it goes on at once.

The trials are as short as trials can be, so that nothing is measured but the machine
around them. Then the same is launched with one metric less, which runs nothing, and
with another metric, of which a hundredth runs: what is planned and compared before are
all trials.
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import pytest

from sweep.store.store import Store
from tests import ROOT

SPEC = """
study: trivial
model: nguyen2024
preset: as_run
fixed: {n: 2, steps: 1, map: empty}
sweep:
  separation_weight: {linspace: [0, 2, 1000]}
replicates: 1000
seed: 1
record: {metrics: [speed, polarization]}
"""
MEASURED = f"""
import sys
sys.path.append({str(ROOT)!r})
from tests.memory import most_megabytes
from sweep.cli import main
try:
    main()
finally:
    print("peak", most_megabytes(), "MB", file=sys.stderr)
"""
MOST_MEGABYTES = 400
"""The guide promises it of the launching process, as a worker takes up to as much: so a
launch needs no larger machine than one more worker would. The libraries take 200 MB of
it, and the compiled model 50.
"""
LEAST_RATIO = 10
"""A launch with nothing missing takes at most a tenth of the first. It takes a fiftieth
on two idle cores: the rest is room for whatever else a machine does meanwhile.
"""
MOST_FILES = 300
"""What is promised of such a study."""


def launched(place: Path, *options: str) -> tuple[float, int]:
    """Seconds of a launch, and the most memory that its own process held, in MB."""
    return measured(place, "launch", "spec.yaml", "--workers", "2", *options)


def measured(place: Path, *arguments: str) -> tuple[float, int]:
    """Seconds of a command, and the most memory that its own process held, in MB."""
    began = time.monotonic()
    command = [sys.executable, "-c", MEASURED, *arguments]
    done = subprocess.run(
        command,
        cwd=place,
        capture_output=True,
        text=True,
        env={**os.environ, "COLUMNS": "80"},
    )
    assert done.returncode == 0, done.stderr
    found = re.search(r"peak (\d+) MB", done.stderr)
    assert found is not None
    return time.monotonic() - began, int(found[1])


@pytest.mark.slow
def test_a_million_trials(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    # The promise is that of a launch alone: compiling takes 160 MB more.
    (tmp_path / "spec.yaml").write_text(SPEC)
    measured(tmp_path, "warm", "spec.yaml")
    first, peak = launched(tmp_path)
    again, peak_again = launched(tmp_path)
    store = Store(tmp_path / "results" / "trivial")
    files = sum(path.is_file() for path in (tmp_path / "results").rglob("*"))
    size = sum(
        path.stat().st_size
        for path in (tmp_path / "results").rglob("*")
        if path.is_file()
    )
    with capsys.disabled():
        print(
            f"\na million trials: {first:.0f} s, launcher at most {peak} MB; again,"
            f" with nothing missing: {again:.1f} s, {peak_again} MB; {files} files,"
            f" {size / 1e6:.0f} MB"
        )
    assert store.read("trials", columns=["trial_id"]).num_rows == 1_000_000
    assert max(peak, peak_again) < MOST_MEGABYTES
    assert again * LEAST_RATIO < first
    assert files <= MOST_FILES
    recorded_otherwise(tmp_path, capsys)


def recorded_otherwise(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The same study with one metric less, and with another one."""
    (place / "spec.yaml").write_text(SPEC.replace(", polarization", ""))
    fewer, peak_fewer = launched(place)
    store = Store(place / "results" / "trivial")
    assert store.read("trials", columns=["trial_id"]).num_rows == 1_000_000
    (place / "spec.yaml").write_text(SPEC.replace("polarization", "dispersion"))
    other, peak_other = launched(place, "--shard", "1/100")
    with capsys.disabled():
        print(
            f"one metric less: {fewer:.0f} s, {peak_fewer} MB; another metric, of which"
            f" a hundredth runs: {other:.0f} s, {peak_other} MB"
        )
    ran = store.read("trials", columns=["trial_id"]).num_rows - 1_000_000
    assert abs(ran - 10_000) < 5 * 100
    assert max(peak_fewer, peak_other) < MOST_MEGABYTES
