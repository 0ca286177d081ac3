"""Points get trials until the intervals of their means are narrow.

All open points are looked at together, once the trials that were asked for before are
stored: see `sweep.analysis.sequential`.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sweep.analysis import sequential
from sweep.campaigns.design_plan import plan_tables
from sweep.campaigns.progress import Progress
from sweep.campaigns.strategy import Look, Round
from sweep.design.design import expand
from sweep.design.jobs import Counts, Jobs
from sweep.spec.study import Study


class UntilStrategy:
    """Asks for the least number of trials of every point, then after each look for more
    of those with an interval that is too wide, up to the most.

    Raises SpecError for a design that cannot be.
    """

    grows = True

    def __init__(self, study: Study, rule: sequential.Until) -> None:
        self.study, self.rule, self.design = study, rule, expand(study)
        self.looks_at = tuple(rule.widths)
        self.distributions = {name: study.distribution(name) for name in rule.widths}
        points = self.design.n_points
        self.progress = Progress(points, points * study.trials_per_point, settled=0)

    def rounds(self, look: Look) -> Iterator[Round]:
        """A round a look."""
        rule = self.rule
        values = dict.fromkeys(rule.widths, np.empty(0))
        had = np.zeros(self.design.n_points, np.int64)
        trials = np.full(self.design.n_points, rule.least)
        while (trials > had).any():
            new = beyond(had, trials)
            yield self._round(Jobs(self.study, self.design, trials), new)
            stored = look()
            values = {
                name: filled(new, stored[name].to_numpy(), values[name])
                for name in values
            }
            seen = sequential.look(
                rule, rule.nominal, trials, values, self.distributions
            )
            had, trials = trials, seen.further
            self.progress.settled = int((trials == had).sum())

    def _round(self, jobs: Jobs, new: NDArray[np.bool_]) -> Round:
        places = np.flatnonzero(new)
        ids = jobs.ids()
        return Round(
            ids[places],
            lambda some: jobs.to_run(places[some]),
            partial(plan_tables, ids, jobs),
        )


def beyond(had: Counts, trials: Counts) -> NDArray[np.bool_]:
    """Which of the trials of all points, point after point, come after the first `had`
    of their point; both shapes (n_points,).
    """
    first = np.repeat(np.cumsum(trials) - trials, trials)
    replicate = np.arange(trials.sum()) - first
    beyond: NDArray[np.bool_] = replicate >= np.repeat(had, trials)
    return beyond


def filled(
    new: NDArray[np.bool_], values: sequential.Floats, before: sequential.Floats
) -> sequential.Floats:
    """The new values and those from before, each in its order."""
    filled = np.empty(len(new))
    filled[new], filled[~new] = values, before
    return filled
