"""The plan of a study with points from axes."""

import numpy as np
import pyarrow as pa

from sweep.campaigns.strategy import Origin, PlanTables
from sweep.design import BLOCK, Ids, Jobs
from sweep.store import PlanAbout


def plan_table(jobs: Jobs, origin: Origin) -> pa.Table:
    """Return the plan: the trials of the spec in its order, with the columns that vary.

    The metadata of the table hold the origin and the fields of PlanAbout.
    """
    return plan_tables(jobs.ids(), jobs, origin)[0].read_all()


def plan_tables(ids: Ids, jobs: Jobs, origin: Origin) -> PlanTables:
    """Return `plan_table` as a stream of batches, and no table of a search.

    The whole table of a million trials would take a hundred megabytes.

    Parameters
    ----------
    ids : Ids
        Ids of the n jobs, shape (n,).
    jobs : Jobs
        Jobs of the study, in the order of the spec.
    origin : Origin
        Provenance, for the metadata.

    Returns
    -------
    PlanTables
        A reader with BLOCK rows per batch, and None.
    """
    columns = jobs.design.told_apart
    metadata = PlanAbout.of(jobs.study, columns, jobs.study.axes)

    def batch(some: slice) -> pa.RecordBatch:
        places = np.arange(len(jobs))[some]
        rows = jobs.rows(places, ids[some])
        points = jobs.points_at(places)
        for name, column in columns.items():
            rows = rows.append_column(name, pa.array(column[points]))
        return metadata.into(rows, origin).combine_chunks().to_batches()[0]

    every = (slice(first, first + BLOCK) for first in range(0, len(jobs), BLOCK))
    schema = batch(slice(1)).schema
    return pa.RecordBatchReader.from_batches(schema, map(batch, every)), None
