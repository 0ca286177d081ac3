"""Stored studies told in the steps of another one.

With a shorter time step a study has more steps in the same time, and other values of
settings that act once in each step. Its tables then have the steps and the settings of
the other study, so that claims and functions of figures.py find the same points, and
the same frames at the same times.

What a metric measures over one step cannot be told: the stored values are over a
shorter one, and nothing is stored between frames. Such metrics are left out.
"""

from collections.abc import Iterable
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from sweep.methods.robustness.variants import changed_by_steps
from sweep.spec.recorded import columns_of
from sweep.spec.settings import Setting
from sweep.spec.study import Study
from sweep.tables.stored_study import StoredStudy

FRAME = "frame"
OF_ONE_STEP = "is measured over one step"


def over_one_step(study: Study) -> list[str]:
    """The recorded metrics of a study that are measured over one step, or derived from
    such.
    """
    known = study.known.metrics
    found = [name for name in known if known[name].per_step]
    for one in study.record.derive:
        if not one.expression.names.isdisjoint(found):
            found.append(one.name)
    return [name for name in study.record.names if name in found]


class RetoldStudy(StoredStudy):
    """The stored trials of a study, `clock` of whose steps are one of the other."""

    def __init__(self, study: Study, results: Path, clock: int) -> None:
        self.clock = clock
        self._changed = changed_by_steps(study)
        self._left_out = dict.fromkeys(over_one_step(study), OF_ONE_STEP)
        super().__init__(study.name, results)
        self.plan = self._told(self.plan)

    @property
    def left_out(self) -> dict[str, str]:
        """The metrics that cannot be told, each with the reason."""
        return self._left_out

    @property
    def metrics(self) -> list[str]:
        """The recorded metrics that can be told."""
        return [name for name in super().metrics if name not in self._left_out]

    def read(
        self, name: str, trial_ids: pa.Array, columns: Iterable[str] = ()
    ) -> pa.Table:
        """The rows of some trials in a stored table, told in the other steps."""
        table = super().read(name, trial_ids, columns)
        untold = {*columns_of(self._left_out)}.intersection(table.column_names)
        return self._told(table.drop_columns(list(untold)))

    def _told(self, table: pa.Table) -> pa.Table:
        for place, column in enumerate(table.schema):
            if column.name == FRAME:
                told = pc.divide(table[place], self.clock)
            elif column.name in self._changed:
                told = self._original(table[place], self._changed[column.name])
            else:
                continue
            table = table.set_column(place, column, told.cast(column.type))
        return table

    def _original(self, values: pa.ChunkedArray, setting: Setting) -> pa.Array:
        """The values of a setting in the study with the longer steps."""
        coded = pc.dictionary_encode(values).combine_chunks()
        kept = [
            None if one is None else setting.in_parts(one, 1.0 / self.clock)
            for one in coded.dictionary.to_pylist()
        ]
        return pc.take(pa.array(kept, pa.float64()), coded.indices)
