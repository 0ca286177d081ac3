"""Stored studies told in the steps of another one.

With a shorter time step a study has more steps in the same time. Its tables then count
in steps of the other study, so that claims and functions of figures.py find the same
frames at the same times.
"""

from collections.abc import Iterable
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc

from sweep.tables.stored_study import StoredStudy

TIME_STEP, STEPS = "dt", "steps"
IN_STEPS = (STEPS, "equilibrium_steps")
"""Settings that are counted in steps."""
FRAME = "frame"


class RetoldStudy(StoredStudy):
    """A stored study, `clock` of whose steps are one of the other study."""

    def __init__(self, name: str, results: Path, clock: int) -> None:
        self.clock = clock
        super().__init__(name, results)
        self.plan = self._told(self.plan)

    def read(
        self, name: str, trial_ids: pa.Array, columns: Iterable[str] = ()
    ) -> pa.Table:
        """The rows of some trials in a stored table, told in the other steps."""
        return self._told(super().read(name, trial_ids, columns))

    def _told(self, table: pa.Table) -> pa.Table:
        for place, column in enumerate(table.schema):
            if column.name in (FRAME, *IN_STEPS):
                told = pc.divide(table[place], self.clock)
            elif column.name == TIME_STEP:
                told = pc.multiply(table[place], self.clock)
            else:
                continue
            table = table.set_column(place, column, told.cast(column.type))
        return table
