"""Stored trials, with the rows of all tables and the provenance."""

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.spec import LAST_FLOCKS, LAST_STATES, RecordedProfile, written_profiles
from sweep.store import (
    PROVENANCE,
    Location,
    Store,
    each,
    expressions,
    load_table,
    measured,
    part_provenance,
    recorded_profiles,
    stored_schema,
    table_names,
)

Columns = dict[str, NDArray[Any]]
"""The columns of one trial in a table by name; lists of a column are concatenated."""


class StoredTrial(NamedTuple):
    """One stored trial.

    Attributes
    ----------
    row : dict
        The row of the trial in the table of trials.
    tables : dict of str to Columns
        The columns of the trial in the other tables of the part, without last states.
    provenance : dict
        The provenance of the part of the store.
    derive : dict of str to str
        The expressions of derived metrics by name.
    keeps_state : bool
        Whether the last state of the trial is stored.
    profiles : tuple of RecordedProfile
        The stored profiles, with the extents of their axes.
    """

    row: dict[str, Any]
    tables: dict[str, Columns]
    provenance: dict[str, Any]
    derive: dict[str, str]
    keeps_state: bool = False
    profiles: tuple[RecordedProfile, ...] = ()

    @property
    def metrics(self) -> list[str]:
        """The metrics that kernels measured."""
        return measured(self.row, self.derive)

    @property
    def record(self) -> dict[str, Any]:
        """The recorded data of the trial, as the section `record` of a spec."""
        series = [name for name in self.tables.get("series", {}) if name != "frame"]
        return {
            "metrics": self.metrics,
            **({"series": series} if series else {}),
            **({"derive": self.derive} if self.derive else {}),
            **({"profiles": written_profiles(self.profiles)} if self.profiles else {}),
            "every": self.row.get("every"),
            "heatmaps": "heatmaps" in self.tables,
            "trajectories": "trajectories" in self.tables,
            LAST_FLOCKS: LAST_FLOCKS in self.tables,
        }


def stored_trials(store: Store, trial_ids: Sequence[str]) -> list[StoredTrial]:
    """Return the stored trials among `trial_ids`, part by part.

    Raises StoreError for a damaged part.
    """

    def read(parts: list[Location]) -> list[StoredTrial]:
        return [
            trial
            for part, own in _holders(parts, trial_ids).items()
            for trial in _trials_of(part, own)
        ]

    return store.steadily(read)


def by_part(store: Store, trial_ids: Sequence[str]) -> list[list[str]]:
    """Return the stored ids among `trial_ids`, in one list per part.

    Raises StoreError for a damaged part.
    """
    return store.steadily(lambda parts: list(_holders(parts, trial_ids).values()))


def origins(store: Store, trial_ids: Sequence[str]) -> list[tuple[dict[str, Any], int]]:
    """Return the provenances of trials, oldest part first, with the number of trials.

    Raises StoreError for a damaged part.
    """
    return [(origin, len(own)) for origin, own in by_origin(store, trial_ids)]


def by_origin(
    store: Store, trial_ids: Sequence[str]
) -> list[tuple[dict[str, Any], list[str]]]:
    """Return the provenances of trials, oldest part first, with the ids of the trials.

    Raises StoreError for a damaged part.
    """

    def read(parts: list[Location]) -> list[tuple[dict[str, Any], list[str]]]:
        trials = defaultdict[bytes, list[str]](list)
        provenances = dict[bytes, dict[str, Any]]()
        for part, own in _holders(parts, trial_ids).items():
            schema = stored_schema(part / "trials.parquet")
            provenance = part_provenance(schema, part / "trials.parquet")
            key = schema.metadata[PROVENANCE]
            trials[key] += own
            provenances[key] = provenance
        return [(provenances[key], own) for key, own in trials.items()]

    return store.steadily(read)


def _holders(
    parts: list[Location], trial_ids: Sequence[str]
) -> dict[Location, list[str]]:
    """Return the ids of trials by part; the latest part of a trial counts."""
    ids = pa.array(trial_ids, pa.string())
    latest = dict[str, Location]()
    tables = each(parts, lambda part: load_table(part, "trials", ["trial_id"]))
    for part, table in zip(parts, tables, strict=True):
        present = table["trial_id"]
        latest |= dict.fromkeys(
            present.filter(pc.is_in(present, value_set=ids)).to_pylist(), part
        )
    holders = defaultdict[Location, list[str]](list)
    for trial, part in latest.items():
        holders[part].append(trial)
    return holders


def _trials_of(part: Location, trial_ids: list[str]) -> Iterator[StoredTrial]:
    ids = pa.array(trial_ids, pa.string())
    stored_tables = table_names(part)
    tables = {
        name: _rows(part, name, ids) for name in stored_tables if name != LAST_STATES
    }
    trials = tables.pop("trials")
    provenance = part_provenance(trials.schema, part / "trials.parquet")
    derive = expressions(trials.schema)
    profiles = (
        recorded_profiles(tables["profiles"].schema) if "profiles" in tables else ()
    )
    rows = trials.to_pylist()
    ids = pa.array([row["trial_id"] for row in rows], pa.string())
    own = {name: _by_trial(table, ids) for name, table in tables.items()}
    for index, row in enumerate(rows):
        yield StoredTrial(
            row=row,
            tables={name: _columns(parts[index]) for name, parts in own.items()},
            provenance=provenance,
            derive=derive,
            keeps_state=LAST_STATES in stored_tables,
            profiles=profiles,
        )


def _rows(part: Location, name: str, trial_ids: pa.Array) -> pa.Table:
    table = load_table(part, name)
    return table.filter(pc.is_in(table["trial_id"], value_set=trial_ids))


def _by_trial(table: pa.Table, trial_ids: pa.Array) -> list[pa.Table]:
    """Return the rows of each trial, in the order of `trial_ids`.

    The table must have no other trials.
    """
    places = pc.index_in(table["trial_id"], value_set=trial_ids).to_numpy()
    if (np.diff(places) < 0).any():
        order = np.argsort(places, kind="stable")
        table = table.take(order)
        places = places[order]
    numbers = np.arange(len(trial_ids))
    firsts, ends = (
        np.searchsorted(places, numbers, side) for side in ("left", "right")
    )
    return [
        table.slice(first, end - first) for first, end in zip(firsts, ends, strict=True)
    ]


def _columns(table: pa.Table) -> Columns:
    return {
        name: _flat(table[name].combine_chunks())
        for name in table.column_names
        if name != "trial_id"
    }


def _flat(column: pa.Array) -> NDArray[Any]:
    return np.asarray(
        (column.flatten() if pa.types.is_list(column.type) else column).to_numpy(
            zero_copy_only=False
        )
    )
