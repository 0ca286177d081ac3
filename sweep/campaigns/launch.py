"""Run what is missing of a study and store it."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kernels import KERNELS_SHA
from sweep.analysis.sequential import Until, look
from sweep.campaigns.progress import Progress
from sweep.design.design import Design, expand
from sweep.design.jobs import Counts, Jobs, SomeJobs
from sweep.spec.study import Study
from sweep.store.custody import custody
from sweep.store.locations import Location
from sweep.store.lock import Lock
from sweep.store.plan_about import PlanAbout
from sweep.store.provenance import provenance
from sweep.store.rows import Tables
from sweep.store.shares import Share
from sweep.store.store import Store
from sweep.tables.stored_tables import checked_numbers
from sweep.trial.result import Result
from sweep.workers.attempts import run_jobs
from sweep.workers.checkpoint_folder import Checkpoints
from sweep.workers.executors import ExecutorFactory
from sweep.workers.failures import Failures, failed_among

LOOKED_UP = 100_000


def launch(
    study: Study,
    results: Location,
    executor: ExecutorFactory,
    *,
    retry: bool = False,
    share: Share | None = None,
    report: Callable[[Progress], None] = lambda _progress: None,
) -> Progress:
    """Run the trials of `study` that its store below `results` lacks, and with `retry`
    those not done.

    The store's plan becomes that of this spec; trials of an earlier one stay stored,
    apart. Where a rule says how many trials a point gets, all open points are looked at
    together, and the plan lists what the looks so far have asked for: they see the
    stored values of the trials in the plan, so that neither the order of work nor an
    interruption matters. With a `share`, only the trials in it are run, while other
    launches may run the others. Damaged parts are set aside first, and their trials run
    again. `report` is called before trials run, after each batch and at the end. Raises
    SpecError for a design that cannot be, or be shared; StoreError where another
    process is launching the study and where the store cannot be read or written;
    FailedTrialsError where more trials have failed than the spec allows, and
    KeyboardInterrupt after Ctrl-C, SIGTERM or SIGHUP, both with all finished trials
    stored.
    """
    if study.search:
        raise study.document.error(
            ("search",), 'this study is a search: run it with "sweep search"'
        )
    if share and study.until:
        message = (
            "what trials follow depends on all that are stored:"
            " this study cannot be launched in shares"
        )
        raise study.document.error(("replicates", "until"), message)
    design, store = expand(study), Store(results / study.name, results)
    with custody(store, share) as lock:
        return _Launch(study, design, store, executor, lock, report, share, retry).run()


@dataclass
class _Launch:
    """One launch; `failed` are those of its trials that were not done, which it does
    not try again.
    """

    study: Study
    design: Design
    store: Store
    executor: ExecutorFactory
    lock: Lock
    report: Callable[[Progress], None]
    share: Share | None
    retry: bool
    failed: set[str] = field(default_factory=set)

    def run(self) -> Progress:
        study, n_points = self.study, self.design.n_points
        self.progress = Progress(
            n_points, n_points * study.trials_per_point, 0 if study.until else None
        )
        self.failures = Failures(study, self.store, self.progress.most)
        self.origin = provenance(study)
        self.checkpoints = Checkpoints.of(self.store.folder, self.share)
        trials, settled = (
            np.full(
                n_points, study.until.least if study.until else study.trials_per_point
            ),
            False,
        )
        while not settled:
            self._run_plan(Jobs(study, self.design, KERNELS_SHA, trials))
            if study.until is None:
                break
            further = _further(study.until, self.store, trials)
            self.progress.settled = int((further == trials).sum())
            trials, settled = further, self.progress.settled == n_points
        self.checkpoints.keep_only(())
        self.store.compact()
        self.report(self.progress)
        return self.progress

    def _run_plan(self, jobs: Jobs) -> None:
        """Publish a plan and run what is missing of it."""
        stored = _statuses(self.store)
        plan = plan_table(self.study, self.design, jobs, self.origin)
        missing = SomeJobs(jobs, self._missing(plan["trial_id"], stored))
        self._discard_idle(plan["trial_id"], missing.indices)
        if not self.retry:
            self.failures.note_stored(failed_among(stored, plan["trial_id"]))
        _publish(self.study, self.store, plan)
        # For a million trials they would hold a hundred megabytes all the while.
        del plan, stored
        pa.default_memory_pool().release_unused()
        if missing:
            self.report(self.progress)
            tables = Tables(self.study, self.origin)
            failures, note = self.failures, self._note
            run_jobs(
                self.study, missing, self.store, tables, self.executor, failures, note
            )

    def _missing(self, ids: pa.ChunkedArray, stored: pa.Table) -> Counts:
        """The places in the plan of the trials to run; notes how many are stored."""
        kept = _among(ids, stored["trial_id"])
        self.progress.apart = len(stored) - int(kept.sum())
        if self.retry:
            not_done = stored["trial_id"].filter(pc.not_equal(stored["status"], "done"))
            untried = not_done.filter(
                pc.invert(
                    pc.is_in(not_done, value_set=pa.array(self.failed, pa.string()))
                )
            )
            kept &= ~_among(ids, untried)
        ours = np.ones(len(ids), np.bool_)
        if self.share:
            ours = np.concatenate(
                [self.share.has(chunk.to_pylist()) for chunk in ids.chunks]
            )
        missing = np.flatnonzero(ours & ~kept)
        self.progress.trials = int(ours.sum())
        self.progress.stored = (
            self.progress.trials - len(missing) - self.progress.statuses.total()
        )
        return missing

    def _discard_idle(self, ids: pa.ChunkedArray, missing: Counts) -> None:
        """Delete the checkpoints of trials that do not run, being stored or in no plan.

        Where the plan grows, what it does not list yet may be asked for later.
        """
        if there := self.checkpoints.trials():
            named = pa.chunked_array([sorted(there)], pa.string())
            planned, running = _among(named, ids), _among(named, ids.take(missing))
            stays = running | ~planned if self.study.until else running
            self.checkpoints.keep_only(named.filter(pa.array(stays)).to_pylist())

    def _note(self, results: list[Result]) -> None:
        self.failed.update(
            result.job.trial_id for result in results if result.status != "done"
        )
        self.progress.statuses.update(result.status for result in results)
        self.lock.check()
        self.report(self.progress)


def _statuses(store: Store) -> pa.Table:
    """The status of every stored trial."""
    types = pa.schema({"trial_id": pa.string(), "status": pa.string()})
    table = checked_numbers(
        store.folder, store.read("trials", columns=["trial_id", "status"]), ()
    ).cast(types)
    pa.default_memory_pool().release_unused()
    return table


def _among(ids: pa.ChunkedArray, known: pa.ChunkedArray) -> NDArray[np.bool_]:
    """Which of `ids` are among the `known` ones, looked up LOOKED_UP at a time: a table
    of all would be large.
    """
    found = np.zeros(len(ids), np.bool_)
    for first in range(0, len(known), LOOKED_UP):
        found |= pc.is_in(
            ids, value_set=known.slice(first, LOOKED_UP).combine_chunks()
        ).to_numpy()
    return found


def _publish(study: Study, store: Store, plan: pa.Table) -> None:
    store.write_plan(plan)
    store.write_spec(study.text)


def _further(until: Until, store: Store, trials: Counts) -> Counts:
    """How many trials each point gets next, once all in the plan are stored."""
    wanted = store.read_plan()["trial_id"].combine_chunks()
    table = store.read("trials", trial_ids=wanted, columns=["trial_id", until.metric])
    checked_numbers(store.folder, table, [until.metric])
    place = pc.index_in(wanted, value_set=table["trial_id"].combine_chunks())
    values = table[until.metric].cast(pa.float64()).take(place).to_numpy()
    return look(until, until.nominal, trials, values).further


def plan_table(
    study: Study, design: Design, jobs: Jobs, origin: dict[str, object]
) -> pa.Table:
    """The trials of the spec in its order, with the settings that vary.

    Its metadata say where it comes from, and what PlanAbout has.
    """
    table = jobs.table()
    for name, column in design.columns.items():
        table = table.append_column(name, pa.array(np.repeat(column, jobs.trials)))
    about = PlanAbout.of(study, design.columns, study.axes)
    return about.into(table, origin)
