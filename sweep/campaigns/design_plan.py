"""The plan of a study whose points come from its axes."""

import numpy as np
import pyarrow as pa

from sweep.campaigns.strategy import Origin, PlanTables
from sweep.design.jobs import Jobs
from sweep.design.trial_ids import BLOCK, Ids
from sweep.store.plan_about import PlanAbout


def plan_table(jobs: Jobs, origin: Origin) -> pa.Table:
    """The trials of the spec in its order, with the settings that vary.

    Its metadata say where it comes from, and what PlanAbout has.
    """
    return plan_tables(jobs.ids(), jobs, origin)[0].read_all()


def plan_tables(ids: Ids, jobs: Jobs, origin: Origin) -> PlanTables:
    """`plan_table` of jobs with these ids, some rows at a time, and nothing that a
    search has asked for. The whole of a million would take a hundred megabytes.
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
