"""The strategy of a grid that becomes finer where a mean crosses a level.

Each look is at all points together, once all trials of the last round are stored: see
`sweep.methods.refinement.rule` and `sweep.methods.refinement.steepest`.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sweep.campaigns import Look, Progress, Round, beyond, filled, plan_tables
from sweep.design import Counts, Design, Jobs, expand
from sweep.methods.refinement import rule as rules
from sweep.methods.refinement import steepest
from sweep.methods.refinement.rule import Place, Refinement
from sweep.spec import TORUS, Axis, Study, Value


class RefineStrategy:
    """The strategy of a refined study.

    The first round has the points of the grid. Each look adds trials of points with an
    unknown side, and points that halve a cell. The halved cells are at the boundary, or
    around the position at which the mean changes most. SpecError if a design is not
    possible.
    """

    grows = True

    def __init__(self, study: Study, rule: Refinement) -> None:
        """Begin with the grid and the rule of a study."""
        self.study = study
        self.rule = rule
        self.grid = _Grid(study, rule)
        self.looks_at = (rule.metric,)
        self.distribution = study.distribution(rule.metric)
        points = len(self.grid.first)
        self.progress = Progress(points, rule.budget, settled=0)

    def rounds(self, look: Look) -> Iterator[Round]:
        """Yield a round per look."""
        rule = self.rule
        groups = len(self.grid.groups)
        values = np.empty(0)
        had = dict[Place, int]()
        trials = dict.fromkeys(self.grid.first, rule.least)
        while trials != had:
            counts = _counts(trials, trials)
            new = beyond(_counts(had, trials), counts)
            yield self._round(trials, new)
            values = filled(new, look()[rule.metric].to_numpy(), values)
            observed = rules.look(rule, counts, values, self.distribution)
            following = (steepest if rule.steepest else rules).next_trials
            further = following(
                rule, groups, trials, observed, allowed=self.grid.allowed
            )
            had = trials
            trials = dict(sorted((trials | further).items()))
            self.progress.points = len(trials)
            self.progress.settled = len(trials) - len(further)

    def _round(self, trials: dict[Place, int], new: NDArray[np.bool_]) -> Round:
        jobs = Jobs(self.study, self.grid.design(trials), _counts(trials, trials))
        places = np.flatnonzero(new)
        ids = jobs.ids()
        return Round(
            ids[places],
            lambda some: jobs.to_run(places[some]),
            partial(plan_tables, ids, jobs),
        )


def _counts(trials: dict[Place, int], places: Iterable[Place]) -> Counts:
    return np.array([trials.get(place, 0) for place in places], np.int64)


class _Grid:
    """The grid of a study, which turns positions into points.

    Attributes
    ----------
    settings : list of str
        The parameters by which groups differ: all varied parameters except the refined
        parameters.
    groups : list of tuple
        Values of `settings` of each group.
    first : list of Place
        Positions of the points of the spec, ascending.
    """

    def __init__(self, study: Study, rule: Refinement) -> None:
        self.study = study
        self.rule = rule
        varied = [name for axis in study.axes for name in axis.columns]
        settings = [name for name in varied if name not in rule.scales]
        design = expand(study)
        if "borders" in settings and TORUS in design.values_of("borders"):
            # Points of a torus have a value of `minimum_image` too.
            settings = [*dict.fromkeys([*settings, "minimum_image"])]
        rows = _rows(design, [*settings, *rule.scales])
        end = len(settings)
        self.settings = settings
        self.groups = list(dict.fromkeys(row[:end] for row in rows))
        numbers = {group: number for number, group in enumerate(self.groups)}
        place_of: list[dict[Value, int]] = [
            {value: place * scale.step for place, value in enumerate(scale.values)}
            for scale in rule.scales.values()
        ]
        self.first = sorted(
            (
                numbers[row[:end]],
                *(of[value] for of, value in zip(place_of, row[end:], strict=True)),
            )
            for row in rows
        )

    def design(self, places: Iterable[Place]) -> Design:
        """Return the points at positions, all of which are allowed."""
        return expand(replace(self.study, axes=(self._axis([*places]),)))

    def allowed(self, places: Sequence[Place]) -> set[Place]:
        """Return the positions that no condition of the spec leaves out."""
        if not self.study.require:
            return {*places}
        # One point that is known to be allowed keeps the design from being empty.
        axis = self._axis([*places, self.first[0]])
        points = {*_rows(expand(replace(self.study, axes=(axis,))), [*axis.columns])}
        rows = zip(*(column.tolist() for column in axis.columns.values()), strict=True)
        # The last row is of the point that was added.
        at = zip(places, rows, strict=False)
        return {place for place, row in at if row in points}

    def _axis(self, places: Sequence[Place]) -> Axis:
        """Return an axis with one row per position."""
        group, *along = zip(*places, strict=True)
        rows = [self.groups[number] for number in group]
        values: dict[str, list[Value]] = {
            name: [row[number] for row in rows]
            for number, name in enumerate(self.settings)
        }
        for (name, scale), at in zip(self.rule.scales.items(), along, strict=True):
            values[name] = [scale.at(place) for place in at]
        settings = self.study.settings
        columns = {
            name: settings[name].column(of_setting)
            for name, of_setting in values.items()
        }
        return Axis("points", columns, place=("refine",))


def _rows(design: Design, settings: Sequence[str]) -> list[tuple[Value, ...]]:
    """Return the values of parameters at each point, as plain Python values."""
    count = design.n_points
    columns = [
        design.columns[name].tolist()
        if name in design.columns
        else [design.base[name]] * count
        for name in settings
    ]
    return list(zip(*columns, strict=True))
