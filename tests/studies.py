"""Small studies that tests launch."""

import json
from pathlib import Path

from sweep.campaigns.launch import launch
from sweep.campaigns.progress import Progress
from sweep.spec.study import parse_spec
from sweep.store.origin import PROVENANCE
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import ExecutorFactory, Serial

SMALL = """
study: small
model: nguyen2024
preset: as_run
fixed: {n: 12, steps: 9}
sweep:
  separation_weight: [0.5, 1]
replicates: 3
seed: 5
record: {series: [speed], every: 2}
"""

COVERING = """
study: covering
model: aziel_chen2025
preset: as_run
fixed: {n: 10, steps: 20, map: cafeteria}
sweep:
  cohesion_weight: [0.1, 0.2]
seeds: [27, 729]
seed: 5
record: {series: [coverage], heatmaps: true}
"""

DERIVING = SMALL.replace(
    "record: {series: [speed], every: 2}",
    """record:
  metrics: [dispersion]
  series: [gain, speed, polarization, loss]
  every: 2
  derive:
    loss: 1 - start_speed * gain
    gain: polarization / speed
    size: sqrt(dispersion * flock_radius) if dispersion > 170 else dispersion
""",
)

ABOUT = dict.fromkeys(("spec", "kernels_sha", "platform", "cpu"), "") | {
    "git": {},
    "versions": dict.fromkeys(("python", "numpy", "numba", "llvmlite"), ""),
}
ORIGIN = {PROVENANCE.decode(): json.dumps(ABOUT)}
"""Metadata without which a table of trials is not taken for one; they say nothing."""

IMPOSSIBLE = SMALL.replace(
    "n: 12,", "n: 12, n_obstacles: 4000, obstacle_radius: 250, start_free: true,"
)
"""No free place for a boid: every trial raises."""


def launched(
    spec: str, results: Path, executor: ExecutorFactory | None = None
) -> StoredStudy:
    """The study of `spec` after a launch into `results`."""
    study = parse_spec(spec)
    launch(study, results, executor or Serial())
    return StoredStudy(study.name, results)


def relaunch(spec: str, results: Path, *, retry: bool = False) -> Progress:
    """The progress of a launch in this process."""
    return launch(parse_spec(spec), results, Serial(), retry=retry)
