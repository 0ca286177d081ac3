"""Tables of a part from results.

The metadata of columns have units, and the metadata of the file have the provenance.
"""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import lru_cache
from itertools import starmap
from operator import itemgetter
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from kernels.model import Model
from sweep.design import Job, LastFlock
from sweep.spec import (
    DIRECTION,
    LAST_FLOCKS,
    LAST_STATES,
    PARENT,
    Column,
    ProfilePoint,
    Setting,
    Streams,
    Study,
    averaged_frames,
    spelled,
)
from sweep.store.origin import PROVENANCE
from sweep.trial import ProfileValues, Result, kinds_of

Floats = NDArray[np.float64]
Numbers = NDArray[Any]
EXPRESSION = b"expression"
"""Key of the expression of a derived metric, in the metadata of its column."""
DISTRIBUTION = b"distribution"
"""Key of the distribution of a derived metric, in the metadata of its column."""
NOT_DERIVED: Mapping[bytes, str] = MappingProxyType({})
EXTENT = b"extent"
"""Key of the wanted extent of the axis of a profile, in the metadata of its column."""
AT = "_at"
"""Ending of the column with the positions of the values of a profile."""
VALUES = pa.list_(pa.float64())
BODIES = pa.list_(pa.float64())
KINDS = pa.list_(pa.int64())
FLIGHT = ("x", "y", "vx", "vy")
"""Columns of trajectories that every model has."""
HEADINGS = ("heading_x", "heading_y")
"""Columns of last flocks in addition to `FLIGHT`."""
ARROW = {
    "float": pa.float64(),
    "int": pa.int64(),
    "bool": pa.bool_(),
    "choice": pa.string(),
    "places": pa.string(),
}

ABOUT_TRIAL = (
    (
        "trial_id",
        pa.string(),
        "",
        "hash of all inputs of the trial and of the recorded data",
    ),
    (
        "point",
        pa.string(),
        "",
        "hash of the model, the preset and the parameters that differ from the preset",
    ),
    ("replicate", pa.int64(), "", "number of the trial at its point"),
    ("seed", pa.int64(), "", "seed of the study, or the listed seed"),
    (
        "seed_listed",
        pa.bool_(),
        "",
        "whether the spec lists the seed, which then also replaces the replicate",
    ),
    ("streams", pa.string(), "", "random streams: common to all points, or not"),
    ("model", pa.string(), "", "model"),
    ("preset", pa.string(), "", "preset of the parameters that the spec does not give"),
    (
        "every",
        pa.int64(),
        "step",
        "steps between recorded frames, over which means are taken",
    ),
    ("status", pa.string(), "", "done, failed, diverged or timeout"),
    ("error", pa.string(), "", "error message"),
    ("replay", pa.string(), "", "command that runs the trial again"),
    ("last_step", pa.int64(), "step", "last step taken"),
    ("seconds", pa.float64(), "s", "wall time in the worker"),
)
ABOUT_LINK = (
    (DIRECTION, pa.string(), "", "direction of the chain of the trial"),
    (PARENT, pa.string(), "", "trial whose last flock begins this trial"),
)
"""Columns of studies with chains of trials."""
ABOUT_EVENT = (("event", pa.string(), "", "event of the recording"),)
"""Columns of recordings."""


def trials_schema(study: Study, provenance: dict[str, Any]) -> pa.Schema:
    """Return the schema of `trials`, which has one row per trial.

    Columns are the identity of the trial, every parameter by name, and every metric at
    the last frame and as `<metric>_mean`.
    """
    model = study.catalogue.models[study.model]
    columns = [_column(*fields) for fields in ABOUT_TRIAL]
    columns += [_column(*fields) for fields in ABOUT_EVENT if model.events]
    columns += [_column(*fields) for fields in ABOUT_LINK if study.continued]
    columns += [_setting(setting) for setting in study.settings.values()]
    for name, (unit, text, derived) in _recorded(study).items():
        columns.append(
            _column(
                name,
                pa.float64(),
                unit,
                f"{text}, at the last frame",
                derived=derived,
            )
        )
        mean = f"{text}, mean over {averaged_frames(model)}"
        columns.append(_column(str(Column(name, half=True)), pa.float64(), unit, mean))
    return pa.schema(columns, _metadata(provenance))


def series_schema(study: Study, provenance: dict[str, Any]) -> pa.Schema:
    """Return the schema of `series`, which has one row per recorded frame.

    Columns are the steps done (`frame`) and the series metrics.
    """
    columns = [
        _column("trial_id", pa.string(), "", "trial"),
        _column("frame", pa.int64(), "step", "steps done"),
    ]
    recorded = _recorded(study)
    for name in study.record.series:
        columns.append(_column(name, pa.float64(), *recorded[name]))
    return pa.schema(columns, _metadata(provenance))


def heatmaps_schema(provenance: dict[str, Any]) -> pa.Schema:
    """Return the schema of `heatmaps`, which has one row per trial.

    The column `visits` has visit counts row after row, -1 in obstacles. A pixel is a
    square of the world, with the parameter `pixel` as the length of a side.
    """
    columns = [
        _column("trial_id", pa.string(), "", "trial"),
        _column("rows", pa.int32(), "pixels", "height of the map"),
        _column("columns", pa.int32(), "pixels", "width of the map"),
        _column(
            "visits",
            pa.list_(pa.int32()),
            "",
            "visits per pixel, row after row, -1 in obstacles",
        ),
    ]
    return pa.schema(columns, _metadata(provenance))


def profiles_schema(study: Study, provenance: dict[str, Any]) -> pa.Schema:
    """Return the schema of `profiles`, which has one row per trial.

    Each profile has a column of values, and a column `<profile>_at` with the positions
    of the values along the axis.
    """
    model = study.catalogue.models[study.model]
    columns = [_column("trial_id", pa.string(), "", "trial")]
    for recorded in study.record.profiles:
        profile = study.catalogue.profiles[recorded.name]
        unit = spelled(profile.unit, model)
        text = f"{profile.text}, mean over {averaged_frames(model)}"
        extent = {EXTENT: json.dumps([recorded.to, recorded.bins])}
        columns.append(_column(recorded.name, VALUES, unit, text, derived=extent))
        unit = spelled(profile.axis_unit, model)
        columns.append(_column(f"{recorded.name}{AT}", VALUES, unit, profile.axis))
    return pa.schema(columns, _metadata(provenance))


def trajectories_schema(model: Model, provenance: dict[str, Any]) -> pa.Schema:
    """Return the schema of `trajectories`, which has one row per recorded frame.

    Columns are the steps done (`frame`), and x, y, vx and vy of all boids in the order
    of the boids. Then come the rows of the model's state, and the kinds of boids if the
    model has kinds.
    """
    length = spelled("length", model)
    speed = spelled("length/time", model)
    columns = [
        _column("trial_id", pa.string(), "", "trial"),
        _column("frame", pa.int64(), "step", "steps done"),
        _column("x", BODIES, length, "positions"),
        _column("y", BODIES, length, "positions"),
        _column("vx", BODIES, speed, "velocities"),
        _column("vy", BODIES, speed, "velocities"),
    ]
    for name, row in model.state.items():
        columns.append(_column(name, BODIES, spelled(row.unit, model), row.text))
    if model.kinds:
        named = ", ".join(f"{index} {kind}" for index, kind in enumerate(model.kinds))
        columns.append(_column("kind", KINDS, "", f"kinds: {named}"))
    return pa.schema(columns, _metadata(provenance))


def last_states_schema(provenance: dict[str, Any]) -> pa.Schema:
    """Return the schema of `last_states`, which has one row per trial.

    The column `state` has the complete state at the end of the trial, see
    `sweep.workers.last_state`.
    """
    columns = [
        _column("trial_id", pa.string(), "", "trial"),
        _column("step", pa.int64(), "step", "steps done"),
        _column("state", pa.large_binary(), "", "sealed by the worker"),
    ]
    return pa.schema(columns, _metadata(provenance))


def last_flocks_schema(model: Model, provenance: dict[str, Any]) -> pa.Schema:
    """Return the schema of `last_flocks`, which has one row per trial.

    Columns are x, y, vx and vy of all boids at the end of the trial, the last nonzero
    velocity of each boid, and the rows of the model's state.
    """
    speed = spelled("length/time", model)
    positions = (spelled("length", model), "positions")
    velocities = (speed, "velocities")
    headings = (speed, "last velocities that were not zero")
    described = (positions, positions, velocities, velocities, headings, headings)
    columns = [_column("trial_id", pa.string(), "", "trial")]
    for name, (unit, text) in zip((*FLIGHT, *HEADINGS), described, strict=True):
        columns.append(_column(name, BODIES, unit, text))
    for name, row in model.state.items():
        columns.append(_column(name, BODIES, spelled(row.unit, model), row.text))
    return pa.schema(columns, _metadata(provenance))


class Tables:
    """Builder of the tables of a part from results, with the schemas of one launch."""

    def __init__(self, study: Study, provenance: dict[str, Any]) -> None:
        self.study = study
        self.trials = trials_schema(study, provenance)
        self.series = series_schema(study, provenance)
        self.heatmaps = heatmaps_schema(provenance)
        self.profiles = profiles_schema(study, provenance)
        self.trajectories = trajectories_schema(
            study.catalogue.models[study.model], provenance
        )
        self.last_states = last_states_schema(provenance)
        self.last_flocks = last_flocks_schema(
            study.catalogue.models[study.model], provenance
        )

    def __call__(self, results: Sequence[Result]) -> dict[str, pa.Table]:
        """Return `trials`, and the further tables that the study records.

        Further tables are `series`, `heatmaps`, `profiles`, `trajectories`,
        `last_states` and `last_flocks`.
        """
        tables = {"trials": self._trials(results)}
        if self.study.record.series:
            tables["series"] = self._series(
                [result for result in results if result.frames is not None]
            )
        if self.study.record.heatmaps:
            tables["heatmaps"] = self._heatmaps(
                [result for result in results if result.heatmap is not None]
            )
        if self.study.record.profiles:
            tables["profiles"] = self._profiles(
                [result for result in results if result.profiles]
            )
        if self.study.record.trajectories:
            tables["trajectories"] = self._trajectories(
                [result for result in results if result.trajectory is not None]
            )
        if self.study.record.last_states:
            tables[LAST_STATES] = self._last_states(
                [result for result in results if result.last_state]
            )
        if self.study.record.last_flocks:
            tables[LAST_FLOCKS] = self._last_flocks(
                [
                    (result.job, result.last_flock)
                    for result in results
                    if result.last_flock
                ]
            )
        return tables

    def _trials(self, results: Sequence[Result]) -> pa.Table:
        nulls = dict.fromkeys(self.trials.names)
        cells = itemgetter(*self.trials.names)
        rows = (cells(nulls | trial_row(self.study.name, result)) for result in results)
        columns = [
            pa.array(column, kind)
            for column, kind in zip(
                zip(*rows, strict=True), self.trials.types, strict=True
            )
        ]
        return pa.Table.from_arrays(columns, schema=self.trials)

    def _series(self, results: Sequence[Result]) -> pa.Table:
        columns = _ids_and_frames(results)
        for name in self.study.record.series:
            columns.append(
                _joined([result.series[name] for result in results], pa.float64())
            )
        return pa.Table.from_arrays(columns, schema=self.series)

    def _profiles(self, results: Sequence[Result]) -> pa.Table:
        rows = [
            {"trial_id": [result.job.trial_id]} | profile_columns(result.profiles)
            for result in results
        ]
        columns = [
            pa.array([value for row in rows for value in row[name]], kind)
            for name, kind in zip(self.profiles.names, self.profiles.types, strict=True)
        ]
        return pa.Table.from_arrays(columns, schema=self.profiles)

    def _trajectories(self, results: Sequence[Result]) -> pa.Table:
        recorded = [
            (result.job, result.trajectory, result.states)
            for result in results
            if result.trajectory is not None and result.states is not None
        ]
        sizes = np.concatenate(
            [[0], *(np.full(len(bodies), bodies.shape[2]) for _, bodies, _ in recorded)]
        )
        offsets = pa.array(np.cumsum(sizes), pa.int32())
        columns = _ids_and_frames(results)
        trials = list(starmap(boid_columns, recorded))
        for field in list(self.trajectories)[len(columns) :]:
            numbers = _joined(
                [trial[field.name] for trial in trials], field.type.value_type
            )
            columns.append(pa.ListArray.from_arrays(offsets, numbers))
        return pa.Table.from_arrays(columns, schema=self.trajectories)

    def _last_states(self, results: Sequence[Result]) -> pa.Table:
        columns = (
            [result.job.trial_id for result in results],
            [result.step for result in results],
            [result.last_state for result in results],
        )
        return pa.Table.from_arrays(
            [*map(pa.array, columns, self.last_states.types)], schema=self.last_states
        )

    def _last_flocks(self, ended: Sequence[tuple[Job, LastFlock]]) -> pa.Table:
        sizes = [flock.bodies.shape[1] for _, flock in ended]
        offsets = pa.array(np.cumsum([0, *sizes]), pa.int32())
        columns: list[Any] = [pa.array([job.trial_id for job, _ in ended], pa.string())]
        rows = [flock_columns(job, flock) for job, flock in ended]
        for name in self.last_flocks.names[1:]:
            numbers = _joined([row[name] for row in rows], pa.float64())
            columns.append(pa.ListArray.from_arrays(offsets, numbers))
        return pa.Table.from_arrays(columns, schema=self.last_flocks)

    def _heatmaps(self, results: Sequence[Result]) -> pa.Table:
        maps = [result.heatmap for result in results if result.heatmap is not None]
        rows = [
            {
                "trial_id": result.job.trial_id,
                "rows": visits.shape[0],
                "columns": visits.shape[1],
                "visits": visits.ravel(),
            }
            for result, visits in zip(results, maps, strict=True)
        ]
        return pa.Table.from_pylist(rows, self.heatmaps)


def boid_columns(job: Job, bodies: Floats, states: Floats) -> dict[str, Numbers]:
    """Return the columns of a table of trajectories that have a value per boid.

    The columns have all frames of a trial, frame after frame.

    Parameters
    ----------
    job : Job
        The trial.
    bodies : array
        x, y, vx and vy, shape (F, 4, N).
    states : array
        Rows of the model's state, shape (F, S, N).
    """
    state = job.catalogue.models[job.model].state
    columns: dict[str, Numbers] = {
        name: rows[:, row].ravel()
        for names, rows in ((FLIGHT, bodies), (state, states))
        for row, name in enumerate(names)
    }
    if kinds := kinds_of(job):
        kind = np.repeat(np.arange(len(kinds)), list(kinds.values()))
        columns["kind"] = np.tile(kind, len(bodies))
    return columns


def flock_columns(job: Job, flock: LastFlock) -> dict[str, Floats]:
    """Return the columns of a table of last flocks, with a value per boid."""
    state = job.catalogue.models[job.model].state
    names = (*FLIGHT, *HEADINGS, *state)
    rows = [*flock.bodies, *flock.headings, *flock.state]
    return dict(zip(names, rows, strict=True))


def trial_row(study: str, result: Result) -> dict[str, Any]:
    """Return the row of a trial; metrics are null unless the trial is done."""
    job = result.job
    events = job.catalogue.models[job.model].events
    return {
        "trial_id": job.trial_id,
        "point": job.point,
        "replicate": job.replicate,
        "seed": job.seed,
        "seed_listed": job.literal,
        "streams": _written(job.streams),
        "model": job.model,
        "preset": job.preset,
        "every": job.record.every,
        "status": result.status,
        "error": result.error,
        "replay": f"sweep replay {study} {job.trial_id}",
        "last_step": result.step,
        "seconds": result.seconds,
        **({"event": events[job.replicate].name} if events else {}),
        **({DIRECTION: job.direction} if job.direction else {}),
        **({PARENT: job.parent} if job.parent else {}),
        **job.settings,
        **trial_metrics(result),
    }


def profile_columns(profiles: Mapping[str, ProfileValues]) -> dict[str, list[Floats]]:
    """Return the profiles of a trial by the names of their columns."""
    return {
        column: [values]
        for name, profile in profiles.items()
        for column, values in ((name, profile.value), (f"{name}{AT}", profile.at))
    }


def values_at(point: ProfilePoint, profiles: pa.Table) -> Floats:
    """Return the values at a point of a profile, of the trials of a table, shape (n,).

    NaN for a trial without the profile.
    """
    at = f"{point.profile}{AT}"
    if not {point.profile, at} <= {*profiles.column_names}:
        return np.full(len(profiles), math.nan)
    rows = zip(profiles[at], profiles[point.profile], strict=True)
    return np.array(
        [
            point.of(positions.values.to_numpy(), values.values.to_numpy())
            if positions.is_valid and values.is_valid
            else math.nan
            for positions, values in rows
        ],
        np.float64,
    )


def trial_metrics(result: Result) -> dict[str, float]:
    """Return the metrics of a trial by the names of their columns.

    The result is empty unless the trial is done.
    """
    return result.last | {
        str(Column(name, half=True)): value for name, value in result.mean.items()
    }


@lru_cache(maxsize=8)
def _written(streams: Streams) -> str:
    kinds = asdict(streams).items()
    return " ".join(f"{purpose}={kind}" for purpose, kind in kinds)


def _ids_and_frames(results: Sequence[Result]) -> list[pa.Array]:
    """Return the columns `trial_id` and `frame` of a table with one row per frame."""
    lengths = [len(_frames(result)) for result in results]
    which = pa.array(np.repeat(np.arange(len(results), dtype=np.int32), lengths))
    ids = pa.array([result.job.trial_id for result in results], pa.string())
    trials = pa.DictionaryArray.from_arrays(which, ids).cast(pa.string())
    return [trials, _joined([_frames(result) for result in results], pa.int64())]


def _frames(result: Result) -> NDArray[np.int64]:
    assert result.frames is not None
    return result.frames


def _joined(arrays: Sequence[Numbers], kind: pa.DataType) -> pa.Array:
    return pa.array(np.concatenate(arrays) if arrays else [], kind)


class _Recorded(NamedTuple):
    """Description of the columns of a metric.

    `derived` has the further metadata of a derived metric.
    """

    unit: str
    text: str
    derived: Mapping[bytes, str] = NOT_DERIVED


def _recorded(study: Study) -> dict[str, _Recorded]:
    catalogue = study.catalogue
    model = catalogue.models[study.model]
    metrics = ((name, catalogue.metrics[name]) for name in study.record.metrics)
    measured = {
        name: _Recorded(spelled(metric.unit, model), metric.text)
        for name, metric in metrics
    }
    return measured | {
        derived.name: _Recorded(
            derived.unit,
            derived.expression.text,
            {EXPRESSION: derived.expression.text, DISTRIBUTION: derived.distribution},
        )
        for derived in study.record.derive
    }


def _column(
    name: str,
    kind: pa.DataType,
    unit: str,
    text: str,
    derived: Mapping[bytes, str] = NOT_DERIVED,
) -> pa.Field:
    texts = {b"unit": unit, b"text": text, **derived}
    return pa.field(
        name, kind, metadata={key: value.encode() for key, value in texts.items()}
    )


def _setting(setting: Setting) -> pa.Field:
    return _column(setting.name, ARROW[setting.kind], setting.unit, setting.text)


def _metadata(provenance: dict[str, Any]) -> dict[bytes, bytes]:
    return {PROVENANCE: json.dumps(provenance, sort_keys=True).encode()}
