"""Which trials are stored when a launch begins, and what came of those that it runs.

So the store is read once, however many rounds a campaign has.
"""

from collections.abc import Iterable, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from sweep.store.recordings import places_of
from sweep.store.rows import trial_metrics
from sweep.store.store import Store
from sweep.tables.stored_tables import checked_numbers
from sweep.trial.result import Result


class StoredTrials:
    """The stored trials of a study: of each its id, its status, and some `columns`.

    `table` has those that were stored when the launch began. `final` says which of them
    do not run again: all, or with `retry` those that are done. Raises StoreError where
    they cannot be read, or are not what a launch writes.
    """

    def __init__(self, store: Store, columns: Sequence[str], *, retry: bool) -> None:
        texts = {"trial_id": pa.string(), "status": pa.string()}
        self.schema = pa.schema(texts | dict.fromkeys(columns, pa.float64()))
        found = store.read("trials", columns=list(texts), optional=columns)
        checked_numbers(store.folder, found, columns)
        for name in columns:
            if name not in found.column_names:
                found = found.append_column(name, pa.nulls(len(found)))
        self.table = found.select(self.schema.names).cast(self.schema)
        del found
        pa.default_memory_pool().release_unused()
        self.final = np.ones(len(self.table), np.bool_)
        if retry:
            self.final = self.done
        self._asked = pa.chunked_array([], pa.string())
        self._noted = self.schema.empty_table()

    def ask(self, ids: pa.ChunkedArray) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Begin a round of the trials `ids`, shape (n,).

        Returns which of them were stored when the launch began, and which of these do
        not run again; shapes (n,).
        """
        self._asked, self._noted = ids, self.schema.empty_table()
        places = places_of(ids, self.table["trial_id"])
        stored = places >= 0
        final = stored.copy()
        final[stored] = self.final[places[stored]]
        return stored, final

    def final_ids(self) -> pa.ChunkedArray:
        """The ids of the trials of `table` that do not run again."""
        return self.table["trial_id"].filter(pa.array(self.final))

    @property
    def done(self) -> NDArray[np.bool_]:
        """Which of the trials of `table` are done."""
        done: NDArray[np.bool_] = pc.equal(self.table["status"], "done").to_numpy()
        return done

    def note(self, results: Sequence[Result]) -> None:
        """Enter trials of this round that are stored now."""
        rows = [
            {"trial_id": result.job.trial_id, "status": result.status}
            | trial_metrics(result)
            for result in results
        ]
        table = pa.Table.from_pylist(rows, self.schema)
        self._noted = pa.concat_tables([self._noted, table])

    def look(self) -> pa.Table:
        """What is stored of the trials of the round: see `sweep.campaigns.strategy`."""
        known = pa.concat_tables([self.table, self._noted])
        before = places_of(self._asked, self.table["trial_id"])
        new = places_of(self._asked, self._noted["trial_id"])
        places = np.where(new >= 0, new + len(self.table), before)
        rows = pa.array(places, mask=places < 0)
        return known.drop_columns("trial_id").take(rows)

    def forget(self) -> None:
        """Give the memory back: there is no further round."""
        self.table = self._noted = self.schema.empty_table()
        self._asked = pa.chunked_array([], pa.string())
        pa.default_memory_pool().release_unused()


def among(trials: Iterable[str], ids: pa.ChunkedArray) -> set[str]:
    """Those of some trials that are among `ids`."""
    named = pa.chunked_array([sorted(trials)], pa.string())
    return set(named.filter(pa.array(places_of(named, ids) >= 0)).to_pylist())
