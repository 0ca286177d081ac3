"""The strategy of adaptive replicates.

Each look is at all open points together, after the trials of the last round are stored:
see `sweep.methods.adaptive.rule`.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sweep.campaigns import Look, Progress, Round, beyond, filled, plan_tables
from sweep.design import Jobs, expand
from sweep.methods.adaptive import rule as rules
from sweep.methods.adaptive.rule import Until
from sweep.spec import Study


class AdaptiveStrategy:
    """The rounds of a study whose rule adds trials.

    The first round has the least number of trials of each point. After each look, the
    next round has more trials of the points with wide intervals, up to the largest
    number. Raises SpecError for an impossible design.
    """

    grows = True

    def __init__(self, study: Study, rule: Until) -> None:
        self.study = study
        self.rule = rule
        self.design = expand(study)
        self.looks_at = tuple(rule.widths)
        self.distributions = {name: study.distribution(name) for name in rule.widths}
        points = self.design.n_points
        self.progress = Progress(points, points * study.trials_per_point, settled=0)

    def rounds(self, look: Look) -> Iterator[Round]:
        """Return a round per look."""
        rule = self.rule
        values = dict.fromkeys(rule.widths, np.empty(0))
        before = np.zeros(self.design.n_points, np.int64)
        trials = np.full(self.design.n_points, rule.least)
        while (trials > before).any():
            new = beyond(before, trials)
            yield self._round(Jobs(self.study, self.design, trials), new)
            stored = look()
            values = {
                name: filled(new, stored[name].to_numpy(), values[name])
                for name in values
            }
            points = rules.look(
                rule, rule.nominal, trials, values, distributions=self.distributions
            )
            before = trials
            trials = points.further
            self.progress.settled = int((trials == before).sum())

    def _round(self, jobs: Jobs, new: NDArray[np.bool_]) -> Round:
        places = np.flatnonzero(new)
        ids = jobs.ids()
        return Round(
            ids[places],
            lambda some: jobs.to_run(places[some]),
            partial(plan_tables, ids, jobs),
        )
