"""A stored study of very many trials, made within a minute: its plan and one trial are
those of a launch, and all other rows are this trial's with ids, settings and numbers of
their own.
"""

from pathlib import Path

import numpy as np
import pyarrow as pa

from sweep.campaigns.launching import launch
from sweep.spec.recorded import columns_of
from sweep.store.shares import Share
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import Serial
from tests.studies import read

SPEC = """
study: many
model: nguyen2024
preset: as_run
fixed: {{n: 2, steps: 2, map: empty}}
sweep:
  separation_weight: {{linspace: [0, 2, {across}]}}
  alignment_weight: {{linspace: [0, 1, {up}]}}
replicates: {replicates}
seed: 1
record: {{metrics: [speed, polarization, dispersion, flock_radius]}}
"""
LAUNCHED = 5
"""About so many trials are launched, and never none."""
FAILING = 100
"""One of so many trials failed."""


def many_trials(
    results: Path, across: int, up: int, replicates: int, parts: int = 10
) -> StoredStudy:
    """The study of so many trials in so many parts and a small one, the numbers of
    whose metrics are normal about 1. They are not stored in the order of the plan.
    """
    study = read(SPEC.format(across=across, up=up, replicates=replicates))
    shares = -(-across * up * replicates // LAUNCHED)
    for number in range(1, shares + 1):
        launch(study, results, Serial(), share=Share(number, shares))
        stored = StoredStudy(study.name, results)
        if len(stored.trials):
            break
    found = stored.store.read("trials")
    generator = np.random.default_rng(1)
    others = stored.plan.filter(_apart(stored.plan, found))
    others = others.take(pa.array(generator.permutation(others.num_rows)))
    size = -(-others.num_rows // parts)
    for start in range(0, others.num_rows, size):
        rows = others.slice(start, size)
        stored.store.append({"trials": _rows(found, rows, generator)})
    return StoredStudy(study.name, results)


def _apart(plan: pa.Table, stored: pa.Table) -> pa.Array:
    """Which trials of the plan are not stored."""
    there = set(stored["trial_id"].to_pylist())
    return pa.array([one not in there for one in plan["trial_id"].to_pylist()])


def _rows(stored: pa.Table, plan: pa.Table, generator: np.random.Generator) -> pa.Table:
    """A row for each trial of the plan, like the first of the stored ones."""
    first, count = stored.slice(0, 1).to_pylist()[0], plan.num_rows
    failed = np.arange(count) % FAILING == FAILING - 1
    metrics = columns_of(["speed", "polarization", "dispersion", "flock_radius"])
    columns = []
    for field in stored.schema:
        if field.name in plan.column_names:
            column = plan[field.name].combine_chunks().cast(field.type)
        elif field.name in metrics:
            column = pa.array(generator.normal(1, 0.1, count), mask=failed)
        elif field.name == "status":
            column = pa.array(np.where(failed, "failed", "done"))
        elif field.name == "error":
            column = pa.array(["made up"] * count, mask=~failed)
        else:
            column = pa.repeat(pa.scalar(first[field.name], field.type), count)
        columns.append(column)
    return pa.table(columns, schema=stored.schema)
