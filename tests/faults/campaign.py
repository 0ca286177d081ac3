"""Launches of a real study that are killed, whose workers are killed and whose parts
are cut off, until it is whole.

Each launch is the `sweep launch` of a user in a process of its own, except that it
stores a part five times a second: so more of the moments that are drawn fall into
writing one.
"""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from random import Random

from sweep.store.store import Store
from tests.own_models import FILES
from tests.patience import PATIENCE
from tests.runner_jobs import processes_below
from tests.studies import launched

SPEC = """
study: faulty
model: nguyen2024
preset: as_run
fixed: {n: 60, steps: 500}
sweep:
  separation_weight: [0.5, 1, 1.5, 2]
replicates: 30
seed: 5
record: {series: [speed], every: 50}
"""
OWN = (
    SPEC.replace("model: nguyen2024", "model: ./drawn.py")
    .replace("separation_weight: [0.5, 1, 1.5, 2]", "swirl_weight: [0, 1, 2, 3]")
    .replace("steps: 500", "steps: 1500, map: ./places.py")
)
"""The same with an own model and map."""
DATA = """
study: data
model: nguyen2024
preset: as_run
fixed: {n: 60, steps: 300, separation_weight: 1.5}
replicates: 3
record: {series: [speed], every: 50}
"""
CALIBRATED = """
study: faulty
model: nguyen2024
preset: as_run
fixed: {n: 60, steps: 300}
sweep:
  prior: {sample: random, points: 60, separation_weight: {uniform: [0, 3]}}
calibrate: {to: data, summaries: [speed], population: 50, generations: 3}
replicates: 3
seed: 5
record: {series: [speed], every: 50}
"""
"""A calibration to `DATA`: which trials come next depends on those that are stored."""
LAUNCH = [
    sys.executable,
    "-c",
    (
        "from sweep.store.writer import Writer;"
        " Writer.__init__.__kwdefaults__['seconds'] = 0.2; from sweep.cli import main;"
        " main()"
    ),
    *("launch", "spec.yaml", "--workers", "2"),
]
WORKER_SECONDS = 1.5
LAUNCH_SECONDS = 5.0
LAST_RESORT = 120.0
TIMING = "seconds"


def tables(folder: Path) -> dict[str, str]:
    """The rows of the stored study as text, which tells any two numbers apart; wall
    times left out.
    """
    found = {}
    for name in ("trials", "series"):
        table = Store(folder).read(name)
        keys = [("trial_id", "ascending")] + (
            [("frame", "ascending")] if name == "series" else []
        )
        wanted = sorted(set(table.column_names) - {TIMING})
        found[name] = repr(table.sort_by(keys).select(wanted).to_pylist())
    return found


class Campaign:
    """Disturbed studies of a spec below `folder`, each compared with one in peace;
    `counts` says what was done to them. The spec `data` is launched before each.
    """

    def __init__(
        self, folder: Path, seed: int, spec: str = SPEC, data: str = ""
    ) -> None:
        self.folder = folder
        self.files = FILES | {"spec.yaml": spec}
        self.random = Random(seed)
        self.counts: Counter[str] = Counter()
        self.data = data
        if data:
            launched(data, folder / "undisturbed")
        launched(spec, folder / "undisturbed")
        self.whole = tables(folder / "undisturbed" / "faulty")
        self.trials = len(Store(folder / "undisturbed" / "faulty").trial_ids())

    def study(self, launches: int) -> None:
        """Disturb a new study by that many launches, then let it be completed, and
        compare.
        """
        self.counts["studies"] += 1
        place = self.folder / f"study-{self.counts['studies']}"
        place.mkdir()
        for name, text in self.files.items():
            (place / name).write_text(text)
        if self.data:
            launched(self.data, place / "results")
        for _ in range(launches):
            self.disturbed_launch(place)
            if self.random.random() < 0.75:
                self.cut(place / "results" / "faulty" / "parts")
        done = subprocess.run(
            LAUNCH, cwd=place, capture_output=True, text=True, timeout=LAST_RESORT
        )
        assert done.returncode == 0, done.stderr
        self.check(place / "results" / "faulty")

    def disturbed_launch(self, place: Path) -> None:
        """A launch that is killed at a random moment; mostly that comes after one or
        two kills of its workers.
        """
        self.counts["launches"] += 1
        with (place / "errors.txt").open("w") as errors:
            process = subprocess.Popen(
                LAUNCH, cwd=place, stderr=errors, start_new_session=True
            )
        kills = self.random.choices([0, 1, 2], [4, 2, 5])[0]
        for _ in range(kills):
            self.kill_worker(process)
        if self.random.random() < 0.6:
            await_part(place / "results" / "faulty" / "parts", process)
        if not ended(
            process,
            self.random.uniform(0, LAUNCH_SECONDS if kills == 0 else WORKER_SECONDS),
        ):
            process.kill()
            self.counts["coordinator kills"] += 1
        code, said = process.wait(LAST_RESORT), (place / "errors.txt").read_text()
        assert code in (0, -signal.SIGKILL), said
        self.counts["came to their end"] += code == 0
        assert_no_orphans(process.pid)

    def kill_worker(self, process: "subprocess.Popen[bytes]") -> None:
        """Kill one of the worker processes, a random while after the moment at which
        there are any.
        """
        while process.poll() is None and not workers(process.pid):
            time.sleep(0.02)
        if not ended(process, self.random.uniform(0, WORKER_SECONDS)) and (
            found := workers(process.pid)
        ):
            with suppress(ProcessLookupError):
                os.kill(self.random.choice(found), signal.SIGKILL)
                self.counts["worker kills"] += 1

    def cut(self, parts: Path) -> None:
        """Cut a file of a part off at a random place, if there is one."""
        files = (
            sorted(file for file in parts.glob("*/*") if file.stat().st_size)
            if parts.is_dir()
            else []
        )
        if files:
            file = self.random.choice(files)
            os.truncate(file, self.random.randrange(file.stat().st_size))
            self.counts["truncations"] += 1

    def check(self, folder: Path) -> None:
        """The study is that of the undisturbed launch, no trial is stored twice, and
        nothing is left over.
        """
        assert tables(folder) == self.whole
        rows = sum(len(ids) for ids in map(trial_ids, Store(folder).all_parts()))
        assert rows == len(Store(folder).trial_ids()) == self.trials
        assert list((folder / "writing").iterdir()) == []
        assert not (folder / "lock").exists()
        damaged = folder / "damaged"
        self.counts["set aside"] += (
            len(list(damaged.iterdir())) if damaged.exists() else 0
        )


def trial_ids(part: Path) -> list[str]:
    """The trials of one part."""
    from sweep.store.parquet import load_table

    ids: list[str] = load_table(part, "trials", ["trial_id"])["trial_id"].to_pylist()
    return ids


def ended(process: "subprocess.Popen[bytes]", seconds: float) -> bool:
    """Whether a process ends within that time."""
    with suppress(subprocess.TimeoutExpired):
        process.wait(seconds)
    return process.returncode is not None


def await_part(parts: Path, process: "subprocess.Popen[bytes]") -> None:
    """Wait until a process has stored a part."""
    before = set(parts.glob("*"))
    while process.poll() is None and set(parts.glob("*")) <= before:
        time.sleep(0.02)


def workers(launcher: int) -> list[int]:
    """The worker processes of a launch."""
    return sorted(filter(is_worker, processes_below(launcher)))


def is_worker(process: int) -> bool:
    """Whether a process is a worker of a pool."""
    try:
        return b"loky.backend.popen" in Path(f"/proc/{process}/cmdline").read_bytes()
    except (FileNotFoundError, ProcessLookupError):
        return False


def session(leader: int) -> set[int]:
    """The live processes of a session."""
    found = set()
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(FileNotFoundError, ProcessLookupError):
            state, _, _, number = stat.read_text().rpartition(")")[2].split()[:4]
            if int(number) == leader and state not in "ZX":
                found.add(int(stat.parent.name))
    return found


def assert_no_orphans(leader: int, patience: float = PATIENCE) -> None:
    """Wait until no process of a session is left."""
    deadline = time.monotonic() + patience
    while left := session(leader):
        assert time.monotonic() < deadline, f"orphans: {left}"
        time.sleep(0.02)
