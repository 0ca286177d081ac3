"""Small studies that tests launch."""

import json
from itertools import count
from pathlib import Path

import pandas as pd

from sweep.campaigns.launching import launch
from sweep.campaigns.progress import Progress
from sweep.design.design import expand
from sweep.design.jobs import Jobs
from sweep.own_code.reading import load_spec, study_of
from sweep.spec.study import Study
from sweep.store.locations import Location
from sweep.store.origin import PROVENANCE
from sweep.store.shares import Share
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import ExecutorFactory, Serial
from tests.own_models import SPEC, at_hand

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

OWN_SMALL = SPEC.replace("study: drawn", "study: small").replace(
    "[0.01, 0.02]", "[0.5, 1]"
)
"""The same with an own model, which tests change by the same words."""

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


def share_of_each_point(study: Study) -> Share:
    """A share that has some trials of each point, and not all. Which ones have depends
    on ids, and ids on the code of the kernels.
    """
    jobs = list(Jobs(study, expand(study)))
    ids = pd.DataFrame([(job.point, job.trial_id) for job in jobs])
    shares = (Share(number, of) for of in count(2) for number in range(1, of + 1))
    for share in shares:
        parts = ids.groupby(0)[1].agg(lambda some, share=share: share.has(some).mean())
        if parts.between(0, 1, inclusive="neither").all():
            return share
    raise AssertionError("ids are not spread")


ABOUT = dict.fromkeys(("spec", "kernels_sha", "platform", "cpu"), "") | {
    "git": {},
    "versions": dict.fromkeys(("python", "numpy", "numba", "llvmlite"), ""),
}
ORIGIN = {PROVENANCE.decode(): json.dumps(ABOUT)}
"""Metadata without which a table of trials is not taken for one; they say nothing."""

NO_ROOM = "n: 12, n_obstacles: 1, obstacle_radius: 5000, start_free: true,"
IMPOSSIBLE = SMALL.replace("n: 12,", NO_ROOM)
"""No free place for a boid: every trial raises."""


def read(spec: str | Path) -> Study:
    """The study of the file of a spec, or of a text, which may name the files of
    `tests/own_models.py`.
    """
    return load_spec(spec) if isinstance(spec, Path) else study_of(spec, at_hand())


def launched(
    spec: str | Path, results: Location, executor: ExecutorFactory | None = None
) -> StoredStudy:
    """The study of `spec` after a launch into `results`."""
    study = read(spec)
    launch(study, results, executor or Serial())
    return StoredStudy(study.name, results)


def relaunch(spec: str | Path, results: Location, *, retry: bool = False) -> Progress:
    """The progress of a launch in this process."""
    return launch(read(spec), results, Serial(), retry=retry)


def numbers(study: StoredStudy) -> list[pd.DataFrame]:
    """All numbers of a study, without what tells its code and its time."""
    order = {
        trial: f"{point} {replicate}"
        for trial, point, replicate in zip(
            *(
                study.plan[name].to_pylist()
                for name in ("trial_id", "point", "replicate")
            ),
            strict=True,
        )
    }
    tables = []
    rows = study.trials.drop(columns=["seconds", "replay"])
    for table in (rows, study.series):
        named = table.assign(trial_id=table["trial_id"].map(order))
        keys = [name for name in ("trial_id", "frame") if name in named]
        tables.append(named.sort_values(keys, ignore_index=True))
    return tables


def same(one: StoredStudy, other: StoredStudy) -> bool:
    """Whether two studies have the same numbers, to the last bit."""
    pairs = zip(numbers(one), numbers(other), strict=True)
    return all(first.equals(second) for first, second in pairs)
