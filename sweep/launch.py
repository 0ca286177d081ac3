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
from sweep.batch import run_jobs
from sweep.custody import custody
from sweep.design import Design, expand
from sweep.executors import ExecutorFactory
from sweep.jobs import Counts, Job, Jobs
from sweep.lock import Lock
from sweep.provenance import provenance
from sweep.result import Result
from sweep.rows import PROVENANCE, Tables
from sweep.sequential import Until, look
from sweep.spec import Study
from sweep.store import Store


@dataclass
class Progress:
    """How far a launch is: trials of the plan, those stored before, and the new ones by status.

    Where a rule decides how many trials a point gets, `settled` of the `points` have had the last of theirs, and the
    plan grows to `most` trials at most; `settled` is None where their number is fixed.
    """

    points: int = 0
    most: int = 0
    settled: int | None = None
    trials: int = 0
    stored: int = 0
    apart: int = 0
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

    The store's plan becomes that of this spec; trials of an earlier one stay stored, apart. Where a rule says how many
    trials a point gets, all open points are looked at together, and the plan lists what the looks so far have asked
    for: they see the stored values of the trials in the plan, so that neither the order of work nor an interruption
    matters. Damaged parts are set aside first, and their trials run again. `report` is called before trials run, after
    each batch and at the end. Raises SpecError for a design that cannot be, StoreError where another process is
    launching the study and where the store cannot be read or written, KeyboardInterrupt after Ctrl-C, SIGTERM or
    SIGHUP with all finished trials stored.
    """
    if study.search:
        raise study.document.error(("search",), 'this study is a search: run it with "sweep search"')
    design, store = expand(study), Store(results / study.name)
    with custody(store) as lock:
        return _launch(study, design, store, executor, retry, lock, report)


def _launch(
    study: Study,
    design: Design,
    store: Store,
    executor: ExecutorFactory,
    retry: bool,
    lock: Lock,
    report: Callable[[Progress], None],
) -> Progress:
    origin, stored = provenance(study), store.trial_ids()
    kept = {trial for trial, status in stored.items() if not (retry and status != "done")}
    progress = Progress(design.n_points, design.n_points * study.trials_per_point, 0 if study.until else None)

    def note(results: list[Result]) -> None:
        kept.update(result.job.trial_id for result in results)
        progress.statuses.update(result.status for result in results)
        lock.check()
        report(progress)

    trials, settled = np.full(design.n_points, study.until.least if study.until else study.trials_per_point), False
    while not settled:
        jobs = Jobs(study, design, KERNELS_SHA, trials)
        plan = plan_table(study, design, jobs, origin)
        ids = plan["trial_id"].to_pylist()
        missing = _Some(jobs, [index for index, trial in enumerate(ids) if trial not in kept])
        progress.trials, progress.stored = len(ids), len(ids) - len(missing) - progress.statuses.total()
        progress.apart = len(stored.keys() - set(ids))
        if missing:
            _publish(study, store, plan)
            report(progress)
            run_jobs(missing, store, Tables(study, origin), executor, note)
        if study.until is None:
            break
        further = _further(study.until, store, ids, trials)
        progress.settled = int((further == trials).sum())
        trials, settled = further, progress.settled == design.n_points
    if not missing:
        _publish(study, store, plan)
    if progress.statuses:
        store.compact()
    report(progress)
    return progress


def _publish(study: Study, store: Store, plan: pa.Table) -> None:
    store.write_plan(plan)
    store.write_spec(study.text)


def _further(until: Until, store: Store, ids: list[str], trials: Counts) -> Counts:
    """How many trials each point gets from now on, all those in the plan being stored."""
    table = store.read("trials", trial_ids=pa.array(ids), columns=["trial_id", until.metric])
    known = dict(zip(*(column.to_pylist() for column in table.columns), strict=True))
    values = np.array([known[trial] for trial in ids], np.float64)
    return look(until, until.nominal, trials, values).further


def plan_table(study: Study, design: Design, jobs: Jobs, origin: dict[str, object]) -> pa.Table:
    """The trials of the spec in its order, with the settings that vary.

    The metadata adds their names, what each axis samples or ablates, the spec's maps, and by which rule trials are
    added.
    """
    table = pa.table(jobs.table() | {name: np.repeat(column, jobs.trials) for name, column in design.columns.items()})
    about = origin | {
        "varied": list(design.columns),
        "record": list(study.record.metrics),
        "maps": {name: own.as_json() for name, own in study.maps.items()},
        "ablated": {axis.ablated: axis.details for axis in study.axes if axis.ablated},
        "axes": {axis.name: _axis(axis) for axis in study.axes},
    }
    if study.until:
        rule = {"looks": study.until.looks, "nominal_confidence": study.until.nominal}
        about["until"] = study.until.as_json() | rule
    return table.replace_schema_metadata({PROVENANCE: json.dumps(about, sort_keys=True).encode()})


def _axis(axis: Axis) -> dict[str, object]:
    """The fields of an axis, what sampled them, and of a sample in blocks which row each of its points is."""
    about: dict[str, object] = {"fields": list(axis.columns), "sampler": axis.sampler}
    if axis.blocks and axis.rows is not None:
        about |= {"size": axis.blocks.size, "levels": axis.blocks.levels}
        about |= {"rows": axis.rows.tolist()} if axis.merged else {}
    return about
