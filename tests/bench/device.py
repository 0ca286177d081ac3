"""What a GPU does with trials, in one command of less than ten minutes:

    python -m tests.bench.device              on the GPU of this machine
    python -m tests.bench.device --emulated   all of it small, on this processor

It writes a table with the machine's name, as Markdown and as JSON, into the folder that
`--into` names, by default `tests/bench/measured`. Nothing of it is edited by hand.

Each part runs in a process of its own: after an error of a GPU's driver its process can
do no more, and others go on. A part that takes longer than its time is ended. Its rows
so far are kept, and what did not fit is said.
"""

import argparse
import json
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryDirectory

from sweep.trial import on_device
from tests import ROOT
from tests.bench.device_parts import (
    Machine,
    Row,
    compiling,
    golden,
    limits,
    others,
    study,
    throughput,
)

INTO = ROOT / "tests" / "bench" / "measured"
GRACE = 10.0
"""Seconds that a part has beyond its time, to end the row at which it is."""
PACKAGES = "boidsweep", "numba", "numba-cuda", "cuda-bindings", "nvidia-nvjitlink"
EMULATED_SECONDS = 300.0


@dataclass(frozen=True)
class Part:
    """A part of the table: its title, the seconds it has, and what gives its rows."""

    title: str
    seconds: float
    rows: Callable[[Machine], Iterator[Row]]


PARTS = {
    "compiling": Part("What is compiled, and what a thread needs", 80.0, compiling),
    "golden": Part("Small trials of every model, bit for bit", 50.0, golden),
    "study": Part("The gain study of aziel_chen2025", 120.0, study),
    "throughput": Part("Boid-steps a second", 160.0, throughput),
    "limits": Part("What limits it", 70.0, limits),
    "others": Part("Others", 30.0, others),
}
"""They have 510 s, and each its grace: less than ten minutes."""


@dataclass
class Found:
    """What a part has found: its rows, its seconds, and why it ended early, if so."""

    rows: list[Row] = field(default_factory=list)
    seconds: float = 0.0
    error: str = ""


def part(name: str, machine: Machine, file: Path) -> None:
    """Run a part here, and write each of its rows as a line of JSON into a file."""
    with file.open("a") as lines:
        for row in PARTS[name].rows(machine):
            lines.write(json.dumps(row) + "\n")
            lines.flush()


def measured(name: str, emulated: bool, folder: Path, seconds: float) -> Found:
    """What a part finds in a process of its own."""
    file, said = folder / f"{name}.jsonl", folder / f"{name}.log"
    command = [sys.executable, "-m", __spec__.name, "--part", name]
    command += ["--into", str(file), "--seconds", str(seconds)]
    command += ["--emulated"] if emulated else []
    began, error = time.monotonic(), ""
    with said.open("w") as log:
        process = subprocess.Popen(
            command,
            stdout=log,
            stderr=log,
            cwd=ROOT,
            env=os.environ
            | {"TMPDIR": str(folder)},  # goes with all that is left there
            start_new_session=True,
        )
        try:
            if process.wait(seconds + GRACE):
                error = _last_line(said) or f"exit code {process.returncode}"
        except subprocess.TimeoutExpired:
            error = f"ended after {seconds + GRACE:.0f} s; the rest did not fit"
        finally:
            with suppress(ProcessLookupError):  # what it has started ends with it
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    rows = file.read_text().splitlines() if file.exists() else []
    whole = [one for one in rows if one.endswith("}")]
    found = [json.loads(one) for one in whole]
    return Found(found, time.monotonic() - began, error)


def _last_line(file: Path) -> str:
    lines = [one for one in file.read_text(errors="replace").splitlines() if one]
    return lines[-1] if lines else ""


def about(emulated: bool) -> dict[str, str]:
    """The machine, in words. It asks the driver in a process of its own."""
    found = {"processor": _processor(), "cores": str(len(os.sched_getaffinity(0)))}
    found |= {"GPU": "none: emulated on the processor" if emulated else _gpu()}
    found |= {"Python": platform.python_version()}
    for name in PACKAGES:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def _processor() -> str:
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text().splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def _gpu() -> str:
    code = """
from sweep.trial.on_device import gpu
one = gpu()
major, minor = divmod(one.driver, 1000)
print(f"{one.name}, capability {one.capability[0]}.{one.capability[1]},"
      f" CUDA {major}.{minor // 10} of its driver, {one.free_bytes():,} bytes free")
"""
    ended = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=False,
    )
    words = ended.stdout if ended.returncode == 0 else ended.stderr
    return words.strip().rpartition("\n")[2]


def as_markdown(machine: dict[str, str], found: dict[str, Found]) -> str:
    """The table, as a document."""
    lines = ["# Trials on a GPU", "", "Made by `python -m tests.bench.device`.", ""]
    lines += ["| machine | |", "|---|---|"]
    lines += [f"| {name} | {words} |" for name, words in machine.items()]
    for name, one in found.items():
        lines += ["", f"## {PARTS[name].title}", ""]
        for columns, rows in _tables(one.rows):
            lines += [f"| {' | '.join(columns)} |", "|---" * len(columns) + "|"]
            lines += [
                f"| {' | '.join(_words(row.get(column, '')) for column in columns)} |"
                for row in rows
            ]
            lines.append("")
        lines.append(f"{one.seconds:.0f} s.")
        lines += [f"Ended early: {_words(one.error)}"] if one.error else []
    return "\n".join(lines) + "\n"


def _tables(rows: Sequence[Row]) -> Iterator[tuple[list[str], list[Row]]]:
    """Rows by their columns but for errors, which are the last."""
    tables = dict[tuple[str, ...], list[Row]]()
    for row in rows:
        key = tuple(column for column in row if column != "error")
        tables.setdefault(key, []).append(row)
    for key, some in tables.items():
        failed = any("error" in row for row in some)
        yield [*key, *(["error"] if failed else [])], some


def _words(value: object) -> str:
    if isinstance(value, float):
        return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    if isinstance(value, int):
        return f"{value:,}"
    return " ".join(str(value).replace("|", "/").split())


def device(names: Sequence[str] = (), emulated: bool = False, into: Path = INTO) -> int:
    """Measure these parts, or all, and write the table; the exit code."""
    if not emulated and (problem := on_device.problem()):
        print(f"device: {problem}, skipped; --emulated runs all on the processor")
        return 0
    machine, found = about(emulated), dict[str, Found]()
    with TemporaryDirectory() as folder:
        for name in names or PARTS:
            seconds = EMULATED_SECONDS if emulated else PARTS[name].seconds
            found[name] = measured(name, emulated, Path(folder), seconds)
            one = found[name]
            errors = sum("error" in row for row in one.rows) + bool(one.error)
            print(f"{name}: {len(one.rows)} rows, {errors} errors, {one.seconds:.0f} s")
            _write(into, machine, found)
    return int(any(one.error for one in found.values()))


def _write(into: Path, machine: dict[str, str], found: dict[str, Found]) -> None:
    """Write what is there so far."""
    into.mkdir(parents=True, exist_ok=True)
    name = machine["GPU"].partition(",")[0].partition(":")[0]
    file = into / f"device-{'-'.join(name.lower().split())}"
    parts = {one: asdict(about) for one, about in found.items()}
    text = json.dumps({"machine": machine, "parts": parts}, indent=1)
    file.with_suffix(".json").write_text(text + "\n")
    file.with_suffix(".md").write_text(as_markdown(machine, found))


def main() -> int:
    """The command."""
    parser = argparse.ArgumentParser(description="Measure trials on a GPU.")
    parser.add_argument("names", nargs="*", metavar="PART", help=", ".join(PARTS))
    parser.add_argument("--emulated", action="store_true", help="without a GPU, small")
    parser.add_argument("--into", type=Path, default=INTO, help="a folder")
    parser.add_argument("--part", choices=PARTS, help=argparse.SUPPRESS)
    parser.add_argument("--seconds", type=float, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if unknown := set(given.names) - set(PARTS):
        parser.error(f"{', '.join(sorted(unknown))}: the parts are {', '.join(PARTS)}")
    if given.part:
        part(
            given.part,
            Machine(given.emulated, time.monotonic() + given.seconds),
            given.into,
        )
        return 0
    return device(given.names, given.emulated, given.into)


if __name__ == "__main__":
    sys.exit(main())
