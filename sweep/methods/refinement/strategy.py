"""Points where the mean of a metric crosses a level, or changes most: the grid becomes
finer there.

All points are looked at together, once the trials that were asked for before are
stored: see `sweep.methods.refinement.rule` and `sweep.methods.refinement.steepest`.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sweep.campaigns.design_plan import plan_tables
from sweep.campaigns.progress import Progress
from sweep.campaigns.strategy import Look, Round, beyond, filled
from sweep.design.design import Design, expand
from sweep.design.jobs import Counts, Jobs
from sweep.methods.refinement import rule as rules
from sweep.methods.refinement import steepest
from sweep.methods.refinement.rule import Place, Refinement
from sweep.spec.axes import Axis
from sweep.spec.settings import TORUS, Value
from sweep.spec.study import Study


class RefineStrategy:
    """Asks for the points of the grid, then after each look for more trials of those
    that may lie on either side of the level, and for points that halve a cell through
    which the boundary goes; or for those about the place where the mean changes most.

    Raises SpecError for a design that cannot be.
    """

    grows = True

    def __init__(self, study: Study, rule: Refinement) -> None:
        self.study, self.rule, self.grid = study, rule, _Grid(study, rule)
        self.looks_at = (rule.metric,)
        self.distribution = study.distribution(rule.metric)
        points = len(self.grid.first)
        self.progress = Progress(points, rule.budget, settled=0)

    def rounds(self, look: Look) -> Iterator[Round]:
        """A round a look."""
        rule, groups = self.rule, len(self.grid.groups)
        values, had = np.empty(0), dict[Place, int]()
        trials = dict.fromkeys(self.grid.first, rule.least)
        while trials != had:
            counts = _counts(trials, trials)
            new = beyond(_counts(had, trials), counts)
            yield self._round(trials, new)
            values = filled(new, look()[rule.metric].to_numpy(), values)
            seen = rules.look(rule, counts, values, self.distribution)
            following = (steepest if rule.steepest else rules).next_trials
            further = following(rule, groups, trials, seen, self.grid.allowed)
            had, trials = trials, dict(sorted((trials | further).items()))
            self.progress.points = len(trials)
            self.progress.settled = len(trials) - len(further)

    def _round(self, trials: dict[Place, int], new: NDArray[np.bool_]) -> Round:
        design, counts = self.grid.design(trials), _counts(trials, trials)
        jobs, places = Jobs(self.study, design, counts), np.flatnonzero(new)
        ids = jobs.ids()
        return Round(
            ids[places],
            lambda some: jobs.to_run(places[some]),
            partial(plan_tables, ids, jobs),
        )


def _counts(trials: dict[Place, int], places: Iterable[Place]) -> Counts:
    return np.array([trials.get(place, 0) for place in places], np.int64)


class _Grid:
    """Turns places into points of a study.

    `groups` are the values of all other settings that the spec varies, for each group;
    `first` are the places of the points of the spec.
    """

    def __init__(self, study: Study, rule: Refinement) -> None:
        self.study, self.rule = study, rule
        varied = [name for axis in study.axes for name in axis.columns]
        others = [name for name in varied if name not in rule.scales]
        design = expand(study)
        if "borders" in others and TORUS in design.values_of("borders"):
            others = [*dict.fromkeys([*others, "minimum_image"])]  # as it is there
        rows = _rows(design, [*others, *rule.scales])
        end = len(others)
        self.others = others
        self.groups = list(dict.fromkeys(row[:end] for row in rows))
        numbers = {group: number for number, group in enumerate(self.groups)}
        known: list[dict[Value, int]] = [
            {value: place * scale.step for place, value in enumerate(scale.values)}
            for scale in rule.scales.values()
        ]
        self.first = sorted(
            (
                numbers[row[:end]],
                *(of[value] for of, value in zip(known, row[end:], strict=True)),
            )
            for row in rows
        )

    def design(self, places: Iterable[Place]) -> Design:
        """The points at some places, which are all allowed."""
        return expand(replace(self.study, axes=(self._axis([*places]),)))

    def allowed(self, places: Sequence[Place]) -> set[Place]:
        """Those of the places that no condition of the spec leaves out."""
        if not self.study.require:
            return {*places}
        # One point that is known to be allowed keeps the design from being empty.
        axis = self._axis([*places, self.first[0]])
        kept = _rows(expand(replace(self.study, axes=(axis,))), [*axis.columns])
        rows = zip(*(column.tolist() for column in axis.columns.values()), strict=True)
        found = {*kept}
        return {place for place, row in zip(places, rows, strict=False) if row in found}

    def _axis(self, places: Sequence[Place]) -> Axis:
        """An axis with a row for each place."""
        group, *along = zip(*places, strict=True)
        rows = [self.groups[number] for number in group]
        values: dict[str, list[Value]] = {
            name: [row[number] for row in rows]
            for number, name in enumerate(self.others)
        }
        for (name, scale), at in zip(self.rule.scales.items(), along, strict=True):
            values[name] = [scale.at(place) for place in at]
        settings = self.study.settings
        columns = {name: settings[name].column(those) for name, those in values.items()}
        return Axis("points", columns, place=("refine",))


def _rows(design: Design, names: Sequence[str]) -> list[tuple[Value, ...]]:
    """The values of some settings at each point, as plain Python values."""
    count = design.n_points
    columns = [
        design.columns[name].tolist()
        if name in design.columns
        else [design.base[name]] * count
        for name in names
    ]
    return list(zip(*columns, strict=True))
