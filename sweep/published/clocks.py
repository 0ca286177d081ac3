"""Stored studies, converted to the time steps of another study.

With a shorter time step, a study has more steps per unit of time. Parameters that act
once per step have different values. The converted tables have the steps and the
parameters of the study with longer steps. So claims and functions of figures.py find
equal points, and frames at equal times.

A metric over one step cannot be converted: stored values refer to a shorter step, and
the store has no values between frames. The tables leave out metrics of this kind.
"""

import pyarrow as pa
import pyarrow.compute as pc

from sweep.methods.robustness import changed_by_steps
from sweep.spec import Setting, Study
from sweep.tables import StoredStudy

FRAME = "frame"
OF_ONE_STEP = "is measured over one step"


def over_one_step(study: Study) -> list[str]:
    """Return the recorded metrics over one step, and dependent derived metrics."""
    metrics = study.catalogue.metrics
    over_step = [name for name in metrics if metrics[name].per_step]
    for derived in study.record.derive:
        if not derived.expression.names.isdisjoint(over_step):
            over_step.append(derived.name)
    return [name for name in study.record.names if name in over_step]


def converted(study: Study, stored: StoredStudy, clock: int) -> StoredStudy:
    """Return a stored study in the time steps of a study with longer steps.

    Parameters
    ----------
    study : Study
        The spec of the stored study.
    stored : StoredStudy
        The study with the shorter time step.
    clock : int
        Number of short steps per long step.
    """
    settings = changed_by_steps(study)

    def in_other_steps(table: pa.Table) -> pa.Table:
        for index, column in enumerate(table.schema):
            if column.name == FRAME:
                values = pc.divide(table[index], clock)
            elif column.name in settings:
                values = _original(table[index], settings[column.name], clock)
            else:
                continue
            table = table.set_column(index, column, values.cast(column.type))
        return table

    left_out = dict.fromkeys(over_one_step(study), OF_ONE_STEP)
    return stored.converted(in_other_steps, left_out)


def _original(values: pa.ChunkedArray, setting: Setting, clock: int) -> pa.Array:
    """Return the values of a parameter in the study with the longer steps."""
    coded = pc.dictionary_encode(values).combine_chunks()
    originals = [
        None if value is None else setting.in_parts(value, 1.0 / clock)
        for value in coded.dictionary.to_pylist()
    ]
    return pc.take(pa.array(originals, pa.float64()), coded.indices)
