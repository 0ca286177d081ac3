"""Further metrics of stored trials, from trajectories: `sweep measure`.

The result equals a launch that recorded the further metrics from the start. Each trial
gets more columns in all tables, and the id of the larger recording. So every command
that reads, verifies or deletes trials works as on any trial. The plan then lists the
new ids instead of the former ids, as after a launch of a spec with the metrics.

First the values of all trials are computed. Then the parts are stored, then the spec,
and the plan last. So no trial is stored if one trial is rejected. If the command ends
before the plan is stored, the study is unchanged, and a repeated command resumes.
"""

import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.campaigns.further_metrics import FurtherMetrics
from sweep.design import Job, Recording, as_texts, ids_recording, packed, packed_array
from sweep.errors import ChoiceError, StoreError
from sweep.spec import Column, Study, columns_of
from sweep.store import (
    FLIGHT,
    NONE_SERVED,
    Location,
    Lock,
    Served,
    Tables,
    custody,
    keep_code,
    measured_provenance,
)
from sweep.tables import (
    TABLES,
    Columns,
    StoredStudy,
    StoredTrial,
    by_part,
    checked,
    command,
    stored_point,
    stored_trials,
)
from sweep.trial import (
    FlownTrial,
    Remeasured,
    expected_steps,
    remeasure,
    seconds,
    sources,
    unmeasured,
    what_lacks,
)
from sweep.workers import ExecutorFactory, drive

ENDED = ("done", "diverged")
"""Statuses that a trial has again for any recording."""


@dataclass(frozen=True)
class MeasuredStudy:
    """The outcome of `measure`.

    Attributes
    ----------
    study : str
        Name of the study.
    metrics : list of str
        Metrics that the study records now, and did not before.
    measured : int
        Number of trials that were measured.
    stored : int
        Number of trials that had the metrics already.
    left : int
        Number of trials that are not stored, or not done: a launch runs them.
    record : dict
        Entries of the metrics under `record` in the spec of the study.
    path : str
        File of the spec when it was launched.
    """

    study: str
    metrics: list[str]
    measured: int
    stored: int
    left: int
    record: dict[str, Any]
    path: str

    def as_json(self) -> str:
        """Return the outcome as a JSON object."""
        return json.dumps(asdict(self))


CHAINED = (
    "the trials are links of chains, and their ids cover the recording of all earlier"
    ' links: add the metrics under "record" of the spec, and launch the spec'
)

ABSENT = (
    "individuals of the recording are absent in some frames: add the metrics under"
    ' "record" of the spec, and launch the spec'
)


def measure(
    name: str,
    requested: Sequence[str],
    results: Location,
    executor: ExecutorFactory,
    *,
    trust: bool = False,
    report: Callable[[int, int], None] = lambda _done, _all: None,
) -> MeasuredStudy:
    """Compute and store further metrics of the stored trials of a study.

    If an error is raised, all stored results remain.

    Parameters
    ----------
    name : str
        Name of the study.
    requested : sequence of str
        Names of metrics; files with metrics, such as `./mine.py` or `./mine.py:NAME`;
        expressions, such as `gain = polarization / speed`.
    results : Location
        Folder of results; the store of the study is below it.
    executor : ExecutorFactory
        Engine that measures the trials.
    trust : bool, default False
        Whether custom code of a study that another user has launched may run.
    report : callable, optional
        Called with the number of trials that were read and measured, and the number of
        all trials.

    Returns
    -------
    MeasuredStudy

    Raises
    ------
    ChoiceError
        If a metric is unknown or needs more than is stored, or if all are recorded.
    CodeError
        If custom code cannot be used, or may not run.
    StoreError
        If another process is launching the study, or if a new run on this machine and
        with this code would differ from a stored trial. Also if the store cannot be
        read or written.
    """
    unlocked = StoredStudy(name, results, trust=trust)
    with custody(unlocked.store) as lock:
        study = StoredStudy(name, results, trust=trust)  # locked from now on
        if study.about.continued:
            raise ChoiceError(CHAINED, name)
        model = study.known.models[study.provenance["model"]]
        if any(event.absent > 0.0 for event in model.events):
            raise ChoiceError(ABSENT, name)
        further = FurtherMetrics(study, requested)
        relisted = _relist(study)
        if not (further.names or relisted):
            message = f"{', '.join(requested)}: recorded already, see `sweep table`"
            raise ChoiceError(message, name)
        measuring = _Measuring(study, further, executor, report)
        return measuring.run(lock) if further.names else measuring.done([])


class _Point(NamedTuple):
    """A stored trial and its successor: the job with the larger recording.

    `study` is the study of this trial alone. `missing` has the metrics that the row
    lacks.
    """

    stored: StoredTrial
    study: Study
    job: Job
    missing: tuple[str, ...]

    @property
    def is_new(self) -> bool:
        """True if the row lacks anything."""
        return bool(self.job.trial_id != self.stored.row["trial_id"])


@dataclass(frozen=True)
class _Group:
    """Trials of a single part that are stored again with further metrics.

    Attributes
    ----------
    pairs : Served
        Former and new ids.
    study : Study
        Study of one of the trials.
    provenance : dict
        Provenance of the stored trials.
    tables : list of str
        Tables of the trials.
    metrics : tuple of str
        The further metrics.
    values : dict of dict
        Values of the new columns by new id; a diverged trial has no values.
    """

    pairs: Served
    study: Study
    provenance: dict[str, Any]
    tables: list[str]
    metrics: tuple[str, ...]
    values: dict[str, dict[str, float]]


class _Measuring:
    """Further metrics of a stored study, which this process has locked."""

    def __init__(
        self,
        study: StoredStudy,
        further: FurtherMetrics,
        executor: ExecutorFactory,
        report: Callable[[int, int], None],
    ) -> None:
        self.study = study
        self.store = study.store
        self.further = further
        self.executor = executor
        self.report = report
        if study.code is None:
            reason = "a version before 0.7 launched the study"
            raise StoreError(f"{reason}: {self._launch}", study.name)
        self.statuses = self.store.trial_ids()
        self.trials: list[str] = study.plan["trial_id"].to_pylist()
        self.ended = [
            trial for trial in self.trials if self.statuses.get(trial) in ENDED
        ]
        self.text = further.spec()
        self.processed = 0
        self.counts = Counter[str]()

    def run(self, lock: Lock) -> MeasuredStudy:
        """Compute, store the parts, and then the plan."""
        ended = self.ended
        if not ended:
            raise ChoiceError("no trial is done yet: launch the study", self.study.name)
        self.report(0, len(ended))
        groups = list[_Group]()
        pairs = NONE_SERVED
        for trial_ids in by_part(self.store, ended):
            points = [*self._points(stored_trials(self.store, trial_ids))]
            if new := [point for point in points if point.is_new]:
                pairs = pairs.also(_pairs(new))
            if lacking := [point for point in new if not self._is_stored(point)]:
                groups.append(self._group(lacking, len(ended)))
            self._note(len(points) - len(lacking), len(ended))
        for group in groups:
            self._store(group)
            lock.check()
        metrics = self._publish(pairs, points[0].study)
        self.store.compact()
        return self.done(metrics)

    def done(self, metrics: list[str]) -> MeasuredStudy:
        """Return the outcome for a study that now records some metrics."""
        ended = len(self.ended)
        measured = self.counts["measured"]
        return MeasuredStudy(
            self.study.name,
            metrics,
            measured=measured,
            stored=ended - measured,
            left=len(self.trials) - ended,
            record=self.further.recorded(self.text),
            path=str(self.study.provenance["spec_path"]),
        )

    def _points(self, trials: Sequence[StoredTrial]) -> Iterator[_Point]:
        """Yield the successors of some trials of one part.

        Raises StoreError if the id of a trial does not match the run in the row of the
        trial.
        """
        name = self.study.name
        maps = self.study.maps
        first = trials[0]
        if first.keeps_state:
            reason = "the trials record last states, which lack further metrics"
            raise ChoiceError(f"{reason}: {self._launch}", name)
        catalogue = self.further.catalogue(first.provenance)
        before, _ = stored_point(name, catalogue, maps, first, record=first.record)
        record = self.further.record(first)
        for stored in trials:
            study, job = stored_point(name, catalogue, maps, stored, record=record)
            former = replace(study, record=before.record)
            ids = [
                ids_recording(variant, [job], Recording.of(variant))
                for variant in (former, study)
            ]
            former_id, new_id = as_texts(np.concatenate(ids)).to_pylist()
            if former_id != job.trial_id:
                raise StoreError(
                    f"trial {job.trial_id} was computed by another version of the code,"
                    f" or has another map: {self._launch}",
                    name,
                )
            lacks = set(study.record.names) - set(before.record.names)
            missing = tuple(metric for metric in study.record.names if metric in lacks)
            yield _Point(stored, study, replace(job, trial_id=new_id), missing)

    @property
    def _launch(self) -> str:
        """Fix for trials that must run again, in words."""
        metrics = ", ".join(self.further.names)
        return f'add {metrics} under "record" of the spec, and launch the spec'

    def _is_stored(self, point: _Point) -> bool:
        return self.statuses.get(point.job.trial_id) in ENDED

    def _group(self, points: Sequence[_Point], total: int) -> _Group:
        """Measure trials, and return the trials with the values.

        The first trial shows whether the metrics are possible, and compiles the kernels
        for all trials.
        """
        first, *_ = points
        done = [point for point in points if point.stored.row["status"] == "done"]
        self._check_sources(first)
        flown = [self._flown(point, flies=point is done[0]) for point in done]
        former_ids = {
            point.job.trial_id: point.stored.row["trial_id"] for point in done
        }
        values = dict[str, dict[str, float]]()
        for results in self._measured(flown):
            for result in results:
                trial = result.trial_id
                values[trial] = self._checked(result, former_ids[trial])
            self._note(len(results), total)
        self.counts["measured"] += len(points)
        self._note(len(points) - len(done), total)
        stored = first.stored
        pairs = _pairs(points)
        tables = [name for name in TABLES if name in {"trials", *stored.tables}]
        for name in tables:
            if name not in ("trials", "trajectories"):  # all else of these was met
                self._read(name, pairs, first.study)
        return _Group(
            pairs,
            first.study,
            stored.provenance,
            tables,
            metrics=first.missing,
            values=values,
        )

    def _measured(self, flown: list[FlownTrial]) -> Iterator[list[Remeasured]]:
        yield [remeasure(trial) for trial in flown[:1]]
        if rest := flown[1:]:
            yield from drive(
                rest,
                remeasure,
                executor=self.executor,
                costs=seconds,
                failed=unmeasured,
            )

    def _check_sources(self, point: _Point) -> None:
        """Raise ChoiceError if the stored tables are not enough for a metric."""
        stored = point.stored
        record = point.study.record
        series = stored.tables.get("series", {})
        for name in sources(record, point.missing, series)[0]:
            if lacking := what_lacks(point.study.catalogue.metrics[name], record.every):
                reason = f"{name} needs {lacking}; trajectories lack this information"
                raise ChoiceError(f"{reason}: {self._launch}", self.study.name)
            if "trajectories" not in stored.tables:
                reason = (
                    f"{name} needs trajectories, and the study stores no trajectory"
                )
                raise ChoiceError(f"{reason}: {self._launch}", self.study.name)

    def _checked(self, result: Remeasured, trial: str) -> dict[str, float]:
        """Return the further columns of a trial.

        Raises the errors of `measure` if a value is missing.
        """
        if result.need:
            reason = (
                f"{result.need[0]} needs more than trajectories have: counted events,"
                " or the velocities one step earlier"
            )
            raise ChoiceError(f"{reason}: {self._launch}", self.study.name)
        if result.wrong:
            reason = f"trial {trial} cannot be measured: {result.wrong}"
            raise StoreError(reason, self.study.name)
        means = {
            str(Column(name, half=True)): mean for name, mean in result.mean.items()
        }
        return {**result.last, **means}

    def _note(self, more: int, total: int) -> None:
        self.processed += more
        self.report(self.processed, total)

    def _flown(self, point: _Point, *, flies: bool) -> FlownTrial:
        """Return a trial with its frames.

        Raises StoreError if the frames differ from the output of a launch.
        """
        job = point.job
        tables = point.stored.tables
        steps = expected_steps(job)
        n = int(job.settings["n"])
        series = tables.get("series", {})
        flight = tables.get("trajectories", {})
        metrics = [name for name in series if name != "frame"]
        state = [*job.catalogue.models[job.model].state] if flight else []
        try:
            values = _in_frames(series, metrics, steps, 1)
            bodies = _in_frames(flight, FLIGHT if flight else (), steps, n)
            states = _in_frames(flight, state, steps, n)
            if not (np.isfinite(bodies).all() and np.isfinite(states).all()):
                raise ValueError("a number is not finite")
        except ValueError as error:
            reason = f"the frames of trial {point.stored.row['trial_id']} are damaged"
            message = f"{reason}, {error}: {self._launch}"
            raise StoreError(message, self.study.name) from None
        measured = dict(zip(metrics, values[:, :, 0].T, strict=True))
        return FlownTrial(
            job,
            point.missing,
            steps,
            bodies,
            states=states,
            series=measured,
            flies=flies,
        )

    def _read(self, name: str, pairs: Served, point: Study) -> pa.Table:
        """Return the stored rows of trials in a table.

        Raises StoreError for a table that differs from the output of a launch.
        """
        trials = as_texts(pairs.missing.ids).combine_chunks()
        table = self.store.read(name, trial_ids=trials)
        return checked(self.study.name, name, table, point.catalogue)

    def _store(self, group: _Group) -> None:
        """Store the trials of a group with further columns, as one part."""
        origin = measured_provenance(group.provenance, group.study, self.text)
        keep_code(self.store, group.study.catalogue)
        schemas = Tables(group.study, origin)
        pairs = group.pairs
        tables = dict[str, pa.Table]()
        for name in group.tables:
            read = self._read(name, pairs, group.study)
            schema: pa.Schema = getattr(schemas, name)
            columns = dict(zip(read.column_names, read.columns, strict=True))
            trials = packed_array(read["trial_id"].combine_chunks())
            columns["trial_id"] = as_texts(pairs.into(trials))
            if name == "trials":
                columns |= _columns(self.study.name, group, columns["trial_id"])
            try:
                table = pa.table(columns).select(schema.names).cast(schema)
            except (KeyError, pa.ArrowException) as error:
                reason = f"the stored {name} are not the output of a launch ({error})"
                raise StoreError(f"{reason}: {self._launch}", self.study.name) from None
            tables[name] = table
        self.store.append(tables)
        self.store.gather()

    def _publish(self, pairs: Served, point: Study) -> list[str]:
        """Store the plan and the spec that list the trials with the further metrics.

        Returns the names of the metrics.
        """
        metadata = self.study.about
        catalogue = self.further.catalogue(self.study.provenance)
        keep_code(self.store, catalogue)
        here = replace(point, catalogue=catalogue)
        origin = measured_provenance(self.study.provenance, here, self.text)
        metrics, derived = sources(point.record, self.further.names, ())
        recorded = {*metadata.record, *metrics, *(column.name for column in derived)}
        record = [name for name in point.record.names if name in recorded]
        listed = pairs.into_rows(self.study.plan.to_reader()).read_all()
        plan = replace(metadata, record=record).into(listed, origin)
        search_table = self.store.read_asked()
        if search_table is not None:
            search_table = pairs.into_rows(search_table.to_reader()).read_all()
        self.store.write_spec(self.text)
        self.store.write_plan(plan.to_reader(), search_table)
        return [name for name in record if name not in metadata.record]


def _relist(study: StoredStudy) -> bool:
    """Repair the table of a search that still names trials without further metrics.

    The plan lists such trials with the metrics. The plan is stored again, with equal
    trials in the plan and in the table. Returns whether the repair was needed. Raises
    StoreError for a trial that is not stored.

    Up to version 0.18 plan and table were two files. A measurement that was killed
    between the two files has left such a study.
    """
    store = study.store
    search_table = study.store.read_asked()
    if search_table is None:
        return False
    listed = study.plan["trial_id"].combine_chunks()
    former = search_table.filter(
        pc.invert(pc.is_in(search_table["trial_id"], value_set=listed))
    )
    if not former.num_rows:
        return False
    flight = ("point", "replicate", "seed")
    ids = former["trial_id"].unique()
    trials = store.read("trials", trial_ids=ids, columns=["trial_id", *flight])
    listed_rows = {
        tuple(row[name] for name in flight): row for row in study.plan.to_pylist()
    }
    former_rows = {
        row["trial_id"]: listed_rows.get(tuple(row[name] for name in flight))
        for row in trials.to_pylist()
    }
    new_ids = {trial: row["trial_id"] for trial, row in former_rows.items() if row}
    if len(new_ids) < len(ids):
        reason = (
            f"the plan lacks {len(ids) - len(new_ids):,} trials that the search needs"
        )
        raise StoreError(f"{reason}: run the search again", study.name)
    pairs = Served.of(packed(new_ids), packed(new_ids.values()))
    search_table = pairs.into_rows(search_table.to_reader()).read_all()
    store.write_plan(study.plan.to_reader(), search_table)
    return True


def _pairs(points: Sequence[_Point]) -> Served:
    """Return the former and the new ids of trials."""
    former = [point.stored.row["trial_id"] for point in points]
    current = [point.job.trial_id for point in points]
    return Served.of(packed(former), packed(current))


def _columns(study: str, group: _Group, trials: pa.ChunkedArray) -> dict[str, pa.Array]:
    """Return the new or changed columns of some trials of a group."""
    ids = trials.to_pylist()
    values = [group.values.get(trial, {}) for trial in ids]
    columns = {
        name: pa.array([row.get(name) for row in values], pa.float64())
        for name in columns_of(group.metrics)
    }
    return columns | {"replay": pa.array([command("replay", study, i) for i in ids])}


def _in_frames(
    table: Columns, columns: Sequence[str], steps: NDArray[np.int64], size: int
) -> NDArray[np.float64]:
    """Return the columns of some names as an array (F, names, size).

    The columns have `size` values per frame. Raises ValueError if frames are not at the
    given steps, or if a column has an unexpected type or size.
    """
    values = np.empty((len(steps), len(columns), size))
    frames = table.get("frame", np.empty(0))
    if columns and not np.array_equal(frames, steps):
        raise ValueError("the steps are wrong")
    for place, name in enumerate(columns):
        column = table.get(name, np.empty(0))
        if column.dtype != np.float64 or column.size != len(steps) * size:
            raise ValueError(f"{name} has an unexpected type or size")
        values[:, place] = column.reshape(len(steps), size)
    return values
