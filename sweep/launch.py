"""Run what is missing of a study and store it."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import overload

import numpy as np
import pyarrow as pa

from kernels import KERNELS_SHA
from sweep.axes import Axis
from sweep.cost import job_seconds
from sweep.design import Design, expand
from sweep.executors import ExecutorFactory
from sweep.jobs import Job, Jobs
from sweep.provenance import provenance
from sweep.result import Result, failed, result_bytes
from sweep.rows import PROVENANCE, Tables
from sweep.runner import drive
from sweep.spec import Study
from sweep.store import Store
from sweep.trial import run, warm
from sweep.writer import Writer


@dataclass
class Progress:
    """How far a launch is: trials of the spec, those stored before, and the new ones by status."""

    trials: int
    stored: int
    apart: int
    statuses: Counter[str] = field(default_factory=Counter)

    @property
    def missing(self) -> int:
        return self.trials - self.stored

    @property
    def troubled(self) -> int:
        """New trials that did not come to their end."""
        return sum(count for status, count in self.statuses.items() if status != "done")


class _Some(Sequence[Job]):
    """Jobs at some indices, made when asked for."""

    def __init__(self, jobs: Jobs, indices: Sequence[int]) -> None:
        self.jobs, self.indices = jobs, indices

    def __len__(self) -> int:
        return len(self.indices)

    @overload
    def __getitem__(self, index: int) -> Job: ...
    @overload
    def __getitem__(self, index: slice) -> list[Job]: ...
    def __getitem__(self, index: int | slice) -> Job | list[Job]:
        if isinstance(index, slice):
            return [self.jobs[place] for place in self.indices[index]]
        return self.jobs[self.indices[index]]


def launch(
    study: Study,
    results: Path,
    executor: ExecutorFactory,
    *,
    retry: bool = False,
    report: Callable[[Progress], None] = lambda _progress: None,
) -> Progress:
    """Run the trials of `study` that its store below `results` lacks, and with `retry` those not done.

    The store's plan becomes that of this spec; trials of an earlier one stay stored, apart. `report` is called
    before the first trial and after each batch. Raises SpecError for a design that cannot be, StoreError where
    the store cannot be read or written, KeyboardInterrupt after Ctrl-C with all finished trials stored.
    """
    design = expand(study)
    jobs = Jobs(study, design, KERNELS_SHA)
    store = Store(results / study.name)
    origin = provenance(study)
    plan = plan_table(study, design, jobs, origin)
    stored = store.trial_ids()
    ids = plan["trial_id"].to_pylist()
    kept = [trial in stored and not (retry and stored[trial] != "done") for trial in ids]
    missing = _Some(jobs, [index for index, keep in enumerate(kept) if not keep])
    progress = Progress(len(ids), sum(kept), len(stored.keys() - set(ids)))
    store.write_plan(plan)
    (store.folder / "spec.yaml").write_text(study.text, encoding="utf-8")
    report(progress)
    if missing:

        def note(results: list[Result]) -> None:
            progress.statuses.update(result.status for result in results)
            report(progress)

        run_jobs(missing, store, Tables(study, origin), executor, note)
        store.compact()
    return progress


def run_jobs(
    jobs: Sequence[Job],
    store: Store,
    tables: Tables,
    executor: ExecutorFactory,
    noted: Callable[[list[Result]], None] = lambda _results: None,
) -> None:
    """Run `jobs` and store their results; `noted` is told of each batch as it is stored.

    Raises KeyboardInterrupt after Ctrl-C with all finished trials stored.
    """
    # Compiled here once, or four cold workers would each compile the same.
    warm(jobs[0])
    batches = drive(jobs, run, executor=executor, cost=job_seconds, failed=failed)
    with Writer[Result](store, tables, size=result_bytes) as writer:
        for results in batches:
            writer.add(results)
            noted(results)


def plan_table(study: Study, design: Design, jobs: Jobs, origin: dict[str, object]) -> pa.Table:
    """The trials of the spec in its order, with the settings that vary.

    The metadata adds their names, what each axis samples or ablates, and the spec's maps.
    """
    repeats = study.trials_per_point
    table = pa.table(jobs.table() | {name: np.repeat(column, repeats) for name, column in design.columns.items()})
    about = origin | {
        "varied": list(design.columns),
        "record": list(study.record.metrics),
        "maps": {name: own.as_json() for name, own in study.maps.items()},
        "ablated": {axis.ablated: axis.details for axis in study.axes if axis.ablated},
        "axes": {axis.name: _axis(axis) for axis in study.axes},
    }
    return table.replace_schema_metadata({PROVENANCE: json.dumps(about, sort_keys=True).encode()})


def _axis(axis: Axis) -> dict[str, object]:
    """The fields of an axis, what sampled them, and of a sample in blocks which row each of its points is."""
    about: dict[str, object] = {"fields": list(axis.columns), "sampler": axis.sampler}
    if axis.blocks and axis.rows is not None:
        about |= {"size": axis.blocks.size, "levels": axis.blocks.levels}
        about |= {"rows": axis.rows.tolist()} if axis.merged else {}
    return about
