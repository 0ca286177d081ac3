"""The trials stored when a launch begins, and the results of new trials.

So the store is read only once, for any number of rounds of a campaign.
"""

from collections.abc import Iterable, Sequence

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from kernels.catalogue import Catalogue
from sweep.design import NO_IDS, Ids, KnownIds, as_texts, packed
from sweep.spec import ProfilePoint
from sweep.store import AT, Store, give_back, trial_metrics, values_at
from sweep.tables import checked, checked_numbers
from sweep.trial import FAILED, Result


class StoredTrials:
    """The stored trials of a study: id, status and some values of each trial.

    With `retry`, only trials that are done do not run again. Raises StoreError if the
    trials cannot be read, or differ from the output of a launch.

    Attributes
    ----------
    ids : KnownIds
        Ids of the n trials that were stored when the launch began.
    table : Table
        Status and columns of these trials, n rows.
    final : array of bool
        Whether each of these trials does not run again, shape (n,).
    """

    def __init__(
        self,
        store: Store,
        values: Sequence[str | ProfilePoint],
        *,
        catalogue: Catalogue,
        retry: bool,
    ) -> None:
        columns = [value for value in values if isinstance(value, str)]
        self.points = [value for value in values if isinstance(value, ProfilePoint)]
        texts = {"trial_id": pa.string(), "status": pa.string()}
        table = store.read("trials", columns=list(texts), optional=columns)
        checked_numbers(store.folder, table, columns)
        ids = table["trial_id"].cast(pa.string())
        self.ids = KnownIds.of_column(ids)
        table = table.drop_columns("trial_id")
        for name in columns:
            if name not in table.column_names:
                table = table.append_column(name, pa.nulls(len(table)))
        for name, column in self._stored_points(store, ids, catalogue).items():
            table = table.append_column(name, column)
        kinds = {"status": pa.string()} | dict.fromkeys(map(str, values), pa.float64())
        self.schema = pa.schema(kinds)
        self.table = table.select(self.schema.names).cast(self.schema)
        del table, ids
        give_back()
        self.final = np.ones(len(self.table), np.bool_)
        if retry:
            self.final = self.done
        self._begin(NO_IDS)

    def _stored_points(
        self, store: Store, ids: pa.ChunkedArray, catalogue: Catalogue
    ) -> dict[str, pa.Array]:
        """Return the values of the stored trials at the points of profiles."""
        if not self.points:
            return {}
        profiles = dict.fromkeys(point.profile for point in self.points)
        named = [name for each in profiles for name in (each, f"{each}{AT}")]
        table = store.read("profiles", columns=["trial_id"], optional=named)
        table = checked(store.folder.name, "profiles", table, catalogue)
        stored = KnownIds.of_column(table["trial_id"].cast(pa.string()))
        places = stored.places_of_column(ids)
        rows = pa.array(places, mask=places < 0)
        return {
            str(point): pa.array(values_at(point, table)).take(rows)
            for point in self.points
        }

    def _begin(self, ids: Ids) -> None:
        self._requested = ids
        self._noted = list[Ids]()
        self._noted_rows = self.schema.empty_table()

    def ask(self, ids: Ids) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Begin a round of trials, and return which trials need not run.

        Parameters
        ----------
        ids : Ids
            Ids of the trials, shape (n,).

        Returns
        -------
        stored : array of bool
            Whether each trial was stored when the launch began, shape (n,).
        final : array of bool
            Whether each trial is stored and does not run again, shape (n,).
        """
        self._begin(ids)
        places = self.ids.places(ids)
        stored = places >= 0
        final = stored.copy()
        final[stored] = self.final[places[stored]]
        return stored, final

    def final_ids(self) -> Ids:
        """Return the ids of the trials of `table` that do not run again."""
        return self.ids.where(self.final)

    def failed_ids(self) -> Ids:
        """Return the ids of the trials of `table` that failed."""
        failed = pc.is_in(self.table["status"], value_set=pa.array(FAILED))
        return self.ids.where(failed.to_numpy())

    @property
    def done(self) -> NDArray[np.bool_]:
        """Mask of the trials of `table` that are done, shape (n,)."""
        done: NDArray[np.bool_] = pc.equal(self.table["status"], "done").to_numpy()
        return done

    def note(self, results: Sequence[Result]) -> None:
        """Enter trials of this round that are stored now."""
        rows = [
            {"status": result.status}
            | trial_metrics(result)
            | {
                str(point): point.of(profile.at, profile.value)
                for point in self.points
                if (profile := result.profiles.get(point.profile))
            }
            for result in results
        ]
        table = pa.Table.from_pylist(rows, self.schema)
        self._noted.append(packed(result.job.trial_id for result in results))
        self._noted_rows = pa.concat_tables([self._noted_rows, table])

    def look(self) -> pa.Table:
        """Return the stored rows of the trials of the round, as described by Look."""
        both = pa.concat_tables([self.table, self._noted_rows])
        noted = KnownIds.of(np.concatenate([NO_IDS, *self._noted]))
        before, new = (ids.places(self._requested) for ids in (self.ids, noted))
        places = np.where(new >= 0, new + len(self.table), before)
        return both.take(pa.array(places, mask=places < 0))

    def forget(self) -> None:
        """Release the memory: there is no further round."""
        self.table = self.schema.empty_table()
        self.ids = KnownIds.of(NO_IDS)
        self._begin(NO_IDS)
        give_back()


def among(trials: Iterable[str], ids: Ids) -> set[str]:
    """Return the trials that are among `ids`."""
    named = packed(trials)
    return set(as_texts(named[np.isin(named, ids)]).to_pylist())
