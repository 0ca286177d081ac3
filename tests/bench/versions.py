"""Launches of this checkout against launches of earlier revisions, in turn, in one run.

All that revisions have in common is the command and the spec. A launch has eight trials
and one worker, and its processor time is that of all its processes. The difference
between a launch of many steps and a launch of few steps is the time of the steps
between: it has no start of processes, no compiling and no storing.

`make bench ONLY=versions REVISIONS="1318c73f"` names the revisions. By default they are
the last commits that changed the version of the project.
"""

import io
import os
import subprocess
import tarfile
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from kernels.lanes.vectors import WIDTH
from tests import ROOT
from tests.bench.scale import FULL, Scale
from tests.bench.timing import of_command

ROUNDS, NEWEST = 3, 3
FEW = 10
"""A short launch has so many times fewer steps than a long one."""
PARTS = ("kernels", "sweep", "pyproject.toml")
SPEC = """
study: bench
model: {model}
fixed: {{steps: {steps}, map: {map}}}
sweep: {{n: [{sizes}]}}
replicates: {replicates}
seed: 1
record: {{metrics: [speed]}}
"""


@dataclass(frozen=True)
class Case:
    """Trials of a model on a map, so large and so long."""

    model: str
    map: str
    n: int
    steps: int

    def spec(self, steps: int, *, together: bool) -> str:
        """Return eight trials of one point, or of eight points, which cannot be a
        batch.
        """
        sizes = [self.n] if together else [self.n + k for k in range(WIDTH)]
        return SPEC.format(
            model=self.model,
            map=self.map,
            steps=steps,
            sizes=", ".join(map(str, sizes)),
            replicates=WIDTH // len(sizes),
        )


CASES = [
    Case("aziel_chen2025", "cafeteria", 100, 6000),
    Case("nguyen2024", "random_obstacles", 200, 1000),
    Case("nanobot", "empty", 100, 6000),
    Case("patel2023", "random_obstacles", 10, 40000),
    Case("patel2023", "random_obstacles", 100, 4000),
    Case("rustamani2024", "arena", 10, 20000),
    Case("vicsek1995", "empty", 100, 6000),
    Case("couzin2002", "empty", 100, 3000),
    Case("dorsogna2006", "empty", 100, 3000),
    Case("cucker_smale2007", "empty", 50, 6000),
    Case("strombom2014", "empty", 50, 6000),
    Case("vasarhelyi2018", "empty", 30, 6000),
]


@dataclass(frozen=True)
class Revision:
    """The files of a revision in a folder, with a cache of compiled kernels."""

    folder: Path
    name: str

    def seconds(self, spec: str) -> float | None:
        """Return the processor time of a launch into an empty folder, or None where the
        revision refuses the spec.
        """
        settings = {
            "PYTHONPATH": str(self.folder),
            "XDG_CACHE_HOME": str(self.folder / "cache"),
        }
        with tempfile.TemporaryDirectory(dir=self.folder) as place:
            file = Path(place) / "spec.yaml"
            file.write_text(spec)
            launch = ["launch", str(file), "--workers", "1", "--results", place]
            return of_command(*launch, folder=Path(place), settings=settings)

    def steps(self, case: Case, steps: int, *, together: bool) -> float | None:
        """Return nanoseconds of a boid-step, from a long launch and a short one."""
        few = max(1, steps // FEW)
        long = self.seconds(case.spec(steps, together=together))
        short = self.seconds(case.spec(few, together=together))
        if long is None or short is None:
            return None
        extra = 0 if together else (WIDTH - 1) / 2
        return (long - short) / (WIDTH * (case.n + extra) * (steps - few)) * 1e9


def versions(scale: Scale = FULL) -> None:
    """Print for each case the cost of a boid-step here, and its ratio to those of the
    revisions: below 1 this checkout is slower.
    """
    names = os.environ.get("REVISIONS", "").split() or newest(scale.of(NEWEST))
    if not names:
        print("versions: this folder has no history, skipped")
        return
    with tempfile.TemporaryDirectory() as folder:
        here = laid_out(None, Path(folder))
        before = [laid_out(name, Path(folder)) for name in names]
        heads = ["here, ns", *(one.name for one in before)]
        print(f"| {'case':42} | " + " | ".join(f"{head:>8}" for head in heads) + " |")
        print("|" + "---|" * (len(heads) + 1))
        for case in CASES[: scale.of(len(CASES))]:
            for together in (False, True):
                _print_case(case, [here, *before], scale, together=together)


def _print_case(
    case: Case, revisions: list[Revision], scale: Scale, *, together: bool
) -> None:
    steps = scale.of(case.steps)
    for one in revisions:
        one.seconds(case.spec(FEW, together=together))  # compiles
    rounds = [
        [one.steps(case, steps, together=together) for one in revisions]
        for _ in range(scale.of(ROUNDS))
    ]
    here = [cost for cost, *_ in rounds if cost is not None]
    cells = [f"{median(here):8.1f}" if here else f"{'-':>8}"]
    for k in range(1, len(revisions)):
        ratios = [
            cost / mine
            for mine, *others in rounds
            if mine and (cost := others[k - 1]) is not None
        ]
        cells.append(f"{median(ratios):8.2f}" if ratios else f"{'-':>8}")
    way = "eight" if together else "alone"
    name = f"{case.model}, {case.map}, N={case.n}, {way}"
    print(f"| {name:42} | " + " | ".join(cells) + " |", flush=True)


def newest(count: int) -> list[str]:
    """Return the last commits that changed the version, the newest first."""
    said = _git("log", "--format=%h", "-G^version = ", "--", "pyproject.toml")
    return said.decode().split()[:count]


def laid_out(revision: str | None, folder: Path) -> Revision:
    """Return a revision in a folder of its own; None is the checkout as it is."""
    place = folder / (revision or "here")
    place.mkdir()
    if revision is None:
        for part in PARTS:
            (place / part).symlink_to(ROOT / part)
    else:
        archive = io.BytesIO(_git("archive", revision, *PARTS))
        with tarfile.open(fileobj=archive) as files:
            files.extractall(place, filter="data")
    project = tomllib.loads((place / "pyproject.toml").read_text())["project"]
    return Revision(place, str(project["version"]))


def _git(*arguments: str) -> bytes:
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True)
    return done.stdout
