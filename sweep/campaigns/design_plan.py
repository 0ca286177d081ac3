"""The plan of a study whose points come from its axes."""

import numpy as np
import pyarrow as pa

from sweep.campaigns.strategy import Origin, PlanTables
from sweep.design.jobs import Jobs
from sweep.store.plan_about import PlanAbout


def plan_table(jobs: Jobs, origin: Origin) -> pa.Table:
    """The trials of the spec in its order, with the settings that vary.

    Its metadata say where it comes from, and what PlanAbout has.
    """
    return plan_tables(jobs.table(), jobs, origin)[0]


def plan_tables(trials: pa.Table, jobs: Jobs, origin: Origin) -> PlanTables:
    """`plan_table` from `trials`, which is `jobs.table()`, and no asked.parquet."""
    plan = trials
    for name, column in jobs.design.columns.items():
        plan = plan.append_column(name, pa.array(np.repeat(column, jobs.trials)))
    about = PlanAbout.of(jobs.study, jobs.design.columns, jobs.study.axes)
    return about.into(plan, origin), None
