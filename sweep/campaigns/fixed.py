"""A strategy with an equal number of trials for every point of a design.

If an axis is continued, the trials are links of chains. All trials are requested at
once: the results of earlier links decide which later links can run, see
`sweep.design.chains`.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from sweep.campaigns.design_plan import plan_tables
from sweep.campaigns.progress import Progress
from sweep.campaigns.strategy import Look, Round
from sweep.design import Jobs, expand
from sweep.spec import Study


class FixedStrategy:
    """A strategy that requests all trials of the design of `study`, in one round.

    Raises SpecError if the design is not possible.
    """

    grows = False
    looks_at = ()

    def __init__(self, study: Study) -> None:
        self.study = study
        self.design = expand(study)
        points = self.design.n_points
        self.progress = Progress(points, points * study.trials_per_point)

    def rounds(self, _look: Look) -> Iterator[Round]:
        """Yield the only round."""
        yield self._round(Jobs(self.study, self.design))

    def _round(self, jobs: Jobs) -> Round:
        ids = jobs.ids()
        first = None
        if jobs.links:
            first = ids[jobs.first(np.arange(len(jobs)))]
        return Round(ids, jobs.to_run, partial(plan_tables, ids, jobs), first)
