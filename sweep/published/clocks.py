"""Stored studies, converted to the time steps of another study.

With a shorter time step, a study has more steps in the same time. Parameters that act
once per step have other values. The converted tables have the steps and the parameters
of the other study. So claims and functions of figures.py find the same points, and the
same frames at the same times.

A metric over one step cannot be converted: stored values are over a shorter step, and
nothing is stored between frames. Such metrics are left out.
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
    """Return the recorded metrics over one step, and those derived from them."""
    known = study.known.metrics
    over_step = [name for name in known if known[name].per_step]
    for derived in study.record.derive:
        if not derived.expression.names.isdisjoint(over_step):
            over_step.append(derived.name)
    return [name for name in study.record.names if name in over_step]


class RetoldStudy(StoredStudy):
    """Stored trials of a study, `clock` of whose steps are one of the other study."""

    def __init__(self, study: Study, results: Path, clock: int) -> None:
        self.clock = clock
        self._changed = changed_by_steps(study)
        self._left_out = dict.fromkeys(over_one_step(study), OF_ONE_STEP)
        super().__init__(study.name, results)
        self.plan = self._converted(self.plan)

    @property
    def left_out(self) -> dict[str, str]:
        """Metrics that cannot be converted, each with the reason."""
        return self._left_out

    @property
    def metrics(self) -> list[str]:
        """Recorded metrics that can be converted."""
        return [name for name in super().metrics if name not in self._left_out]

    def read(
        self, name: str, trial_ids: pa.Array, columns: Iterable[str] = ()
    ) -> pa.Table:
        """Return rows of a stored table, converted to the other steps.

        Parameters
        ----------
        name : str
            Name of the table.
        trial_ids : pa.Array
            Ids of the trials.
        columns : iterable of str, default ()
            Columns to read, as `StoredStudy.read` takes them.
        """
        table = super().read(name, trial_ids, columns)
        untold = {*columns_of(self._left_out)}.intersection(table.column_names)
        return self._converted(table.drop_columns(list(untold)))

    def _converted(self, table: pa.Table) -> pa.Table:
        for index, column in enumerate(table.schema):
            if column.name == FRAME:
                converted = pc.divide(table[index], self.clock)
            elif column.name in self._changed:
                converted = self._original(table[index], self._changed[column.name])
            else:
                continue
            table = table.set_column(index, column, converted.cast(column.type))
        return table

    def _original(self, values: pa.ChunkedArray, setting: Setting) -> pa.Array:
        """Return the values of a parameter in the study with the longer steps."""
        coded = pc.dictionary_encode(values).combine_chunks()
        originals = [
            None if value is None else setting.in_parts(value, 1.0 / self.clock)
            for value in coded.dictionary.to_pylist()
        ]
        return pc.take(pa.array(originals, pa.float64()), coded.indices)
