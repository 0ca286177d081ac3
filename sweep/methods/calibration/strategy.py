"""The strategy of a calibrated study: generations of simulations near the data.

A round has the proposals of one generation, for the data and for all synthetic data
sets. All trials of a round are stored before the next proposals follow. So the trials
do not depend on the number of workers, or on interruptions.
"""

import json
from collections.abc import Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from sweep.campaigns import Look, Origin, PlanTables, Progress, Round
from sweep.design import Counts, Ids, Jobs, as_texts, expand
from sweep.errors import SpecError, UserError
from sweep.methods.calibration.rule import Calibration, summarised
from sweep.methods.calibration.targets import (
    DATA,
    PRIOR,
    TRUTH,
    PriorDraws,
    Target,
    targets_of,
)
from sweep.methods.comparison import read_side
from sweep.spec import Axis, Study, Value, Values
from sweep.store import Location, PlanAbout

Floats = NDArray[np.float64]
ABOUT = b"calibrate"
"""Key of the description in the metadata of the table of requested trials, as JSON."""
DRAW = "draw of "
"""Beginning of the columns with the draws of parameters in the unit cube."""


class Data(NamedTuple):
    """The data of a calibration.

    Attributes
    ----------
    summaries : list of float
    trials : int
        Number of trials of the data.
    """

    summaries: list[float]
    trials: int


class Batch(NamedTuple):
    """Draws of one generation of one data set.

    Attributes
    ----------
    number : int
        Number of the data set.
    generation : int
    draws : array of float, shape (n, D)
    """

    number: int
    generation: int
    draws: Floats


class CalibrationStrategy:
    """The strategy of a calibrated study.

    Raises SpecError if the design is not possible, or if the data are not stored or
    lack a summary.
    """

    grows = True

    def __init__(
        self, study: Study, rule: Calibration, results: Location | None
    ) -> None:
        self.study = study
        self.rule = rule
        self.looks_at = rule.columns
        self.prior = PriorDraws(rule, study.settings, study.seed)
        self.simulations = _Simulations(study, self.prior)
        self.data = read_data(study, rule, results) if results else None
        most = rule.most_trials(0)
        self.progress = Progress(most=most)
        self.description: dict[str, Any] = {
            "rule": rule.as_json(),
            "data": None if self.data is None else list(self.data.summaries),
            "data_trials": 0 if self.data is None else self.data.trials,
            "allowed": [[] for _ in range(rule.checks + 1)],
            "finished": False,
        }

    def rounds(self, look: Look) -> Iterator[Round]:
        """Yield a round for the prior, and a round per generation.

        The last round has no trials, only the plan of the finished calibration.
        """
        assert self.data
        drawn = self.prior.first()
        prior = drawn[self.simulations.allowed(drawn)]
        truths = self.prior.truths(self.simulations.allowed)
        batches = [Batch(DATA, PRIOR, prior)]
        batches += [
            Batch(number, TRUTH, draw) for number, draw in enumerate(truths, start=1)
        ]
        yield self._round(batches)
        summaries, *synthetic = self._summaries(batches, look())
        targets = targets_of(
            self.rule,
            np.array(self.data.summaries),
            prior,
            summaries,
            [row for (row,) in synthetic],
        )
        while active := [target for target in targets if not target.ended]:
            batches = [*self._proposals(active)]
            if not batches:
                break
            yield self._round(batches)
            numbered = {target.number: target for target in active}
            for batch, simulated in zip(
                batches, self._summaries(batches, look()), strict=True
            ):
                allowed = self.description["allowed"][batch.number][-1]
                numbered[batch.number].add(batch.draws, simulated, allowed)
            self._note(targets[0])
        self.description["finished"] = True
        yield self._round([])

    def _proposals(self, active: list[Target]) -> Iterator[Batch]:
        """Yield the proposals of data sets; a data set without any is stuck."""
        for target in active:
            try:
                draws, allowed = target.propose(
                    self.study.seed, self.simulations.allowed
                )
            except ValueError:
                target.stuck = True
                continue
            self.description["allowed"][target.number].append(allowed)
            generation = len(target.population.generations)
            yield Batch(target.number, generation, draws)

    def _note(self, target: Target) -> None:
        if target.number != DATA:
            return
        generations = target.population.generations
        last = generations[-1]
        self.progress.note = (
            f"generation {len(generations) - 1}: tolerance {last.tolerance:.3g},"
            f" {100 * last.accepted:.0f} % accepted"
        )

    def _round(self, batches: list[Batch]) -> Round:
        requested = self.simulations.request(batches)
        self.progress.points = len(self.simulations.counts)
        return Round(requested.ids, requested.some, self._plan)

    def _plan(self, origin: Origin) -> PlanTables:
        return self.simulations.tables(self.description, origin)

    def _summaries(self, batches: list[Batch], table: pa.Table) -> list[Floats]:
        """Return the summaries of the simulations of each batch."""
        counts = [len(batch.draws) for batch in batches]
        shape = sum(counts), self.rule.replicates
        values = {
            name: table[name].to_numpy().astype(np.float64).reshape(shape)
            for name in self.rule.columns
        }
        every = summarised(self.rule.summaries, values)
        return np.split(every, np.cumsum(counts)[:-1])


class _Requested(NamedTuple):
    """Trials of a round: jobs, their indices, and their ids."""

    jobs: Jobs | None
    places: Counts
    ids: Ids

    def some(self, which: Counts) -> Any:
        """Return the jobs at some indices into `ids`."""
        return self.jobs.to_run(self.places[which]) if self.jobs else []


class _Simulations:
    """Requested simulations, and the tables of the plan.

    Attributes
    ----------
    counts : dict
        Number of requested trials of each point, by the values of the parameters.
    """

    def __init__(self, study: Study, prior: PriorDraws) -> None:
        self.study = study
        self.prior = prior
        self.counts: dict[tuple[Value, ...], int] = {}
        self.requested: list[_Requested] = []
        self.rows: list[pa.Table] = []
        design = expand(study)
        self.known = {name: design.columns[name][:1] for name in prior.names}

    def allowed(self, draws: Floats) -> NDArray[np.bool_]:
        """Return which draws the spec allows, shape (n,).

        The spec leaves out points by `require`, by derived values that are not allowed,
        and by parameters that do not fit together.
        """
        study = self.study
        if not study.require and not study.derive:
            return np.ones(len(draws), np.bool_)
        columns = self.prior.values(draws)
        # One point that is allowed keeps the design from being empty.
        marked = {
            name: np.concatenate([column, self.known[name]])
            for name, column in columns.items()
        }
        try:
            kept = _points(expand(replace(study, axes=(_axis(marked),))), columns)
        except SpecError:
            if len(draws) == 1:
                return np.zeros(1, np.bool_)
            each = [self.allowed(draw[None]) for draw in draws]
            return np.concatenate(each)
        among = {*kept}
        return np.array([row in among for row in _rows(columns)])

    def request(self, batches: list[Batch]) -> _Requested:
        """Return the trials of the simulations of some draws, in order.

        Draws with equal values get further replicates of the same point.
        """
        if not batches:
            return _Requested(None, np.empty(0, np.int64), np.empty(0, "S24"))
        replicates = self.prior.rule.replicates
        draws = np.concatenate([batch.draws for batch in batches])
        columns = self.prior.values(draws)
        rows = _rows(columns)
        first = {row: place for place, row in reversed([*enumerate(rows)])}
        distinct = sorted(first.values())
        design = expand(replace(self.study, axes=(_axis(columns, distinct),)))
        numbers = {rows[place]: number for number, place in enumerate(distinct)}
        begins = list[int]()
        for row in rows:
            begins.append(self.counts.get(row, 0))
            self.counts[row] = begins[-1] + replicates
        trials = np.array([self.counts[rows[place]] for place in distinct], np.int64)
        jobs = Jobs(self.study, design, trials)
        offsets = np.cumsum(trials) - trials
        starts = np.array(
            [
                offsets[numbers[row]] + begin
                for row, begin in zip(rows, begins, strict=True)
            ]
        )
        places = (starts[:, None] + np.arange(replicates)).reshape(-1)
        requested = _Requested(jobs, places, jobs.ids_at(places))
        self.requested.append(requested)
        self.rows.append(self._rows(batches, requested.ids))
        return requested

    def _rows(self, batches: list[Batch], ids: Ids) -> pa.Table:
        """Return a row per trial: data set, generation, simulation, and draw."""
        replicates = self.prior.rule.replicates
        counts = [len(batch.draws) for batch in batches]
        numbers = np.repeat([batch.number for batch in batches], counts)
        generations = np.repeat([batch.generation for batch in batches], counts)
        simulations = np.concatenate([np.arange(count) for count in counts])
        draws = np.concatenate([batch.draws for batch in batches])
        columns = {
            "data_set": np.repeat(numbers, replicates),
            "generation": np.repeat(generations, replicates),
            "simulation": np.repeat(simulations, replicates),
        }
        for name, column in zip(self.prior.names, draws.T, strict=True):
            columns[f"{DRAW}{name}"] = np.repeat(column, replicates)
        return pa.table({**columns, "trial_id": as_texts(ids)})

    def tables(self, description: dict[str, Any], origin: Origin) -> PlanTables:
        """Return the plan, and the table of the requested simulations."""
        parts = list[pa.Table]()
        names = list[str]()
        for requested in self.requested:
            jobs = requested.jobs
            assert jobs
            part = jobs.rows(requested.places, requested.ids)
            points = jobs.points_at(requested.places)
            names = list(jobs.design.told_apart)
            for name, column in jobs.design.told_apart.items():
                part = part.append_column(name, pa.array(column[points]))
            parts.append(part)
        about = PlanAbout.of(self.study, names, self.study.axes)
        plan = about.into(pa.concat_tables(parts).combine_chunks(), origin)
        table = pa.concat_tables(self.rows).combine_chunks()
        described = {ABOUT: json.dumps(description)}
        return plan.to_reader(), table.replace_schema_metadata(described)


def read_data(study: Study, rule: Calibration, results: Location) -> Data:
    """Return the summaries of the data. Raises SpecError if one is missing.

    Parameters
    ----------
    study : Study
    rule : Calibration
    results : Location
        Folder of stored studies.
    """
    place = (*rule.place, "to")
    try:
        side = read_side(rule.to, results)
    except UserError as error:
        raise study.document.error(place, f"the data cannot be read: {error}") from None
    lacking = [name for name in rule.columns if name not in side.trials]
    if lacking:
        recorded = ", ".join(side.study.metrics)
        raise study.document.error(
            place,
            f"{side.study.name} lacks {', '.join(lacking)}; recorded: {recorded}",
        )
    trials = len(side.trials)
    values = {
        name: side.trials[name].to_numpy(np.float64, na_value=np.nan)[None]
        for name in rule.columns
    }
    (summaries,) = summarised(rule.summaries, values)
    unknown = [
        summary.words
        for summary, value in zip(rule.summaries, summaries, strict=True)
        if not np.isfinite(value)
    ]
    if unknown:
        raise study.document.error(
            place, f"the {trials:,} trials of {side.text} have no {', '.join(unknown)}"
        )
    return Data(summaries.tolist(), trials)


def _axis(columns: dict[str, Values], places: list[int] | None = None) -> Axis:
    """Return an axis with some rows of columns; by default all rows."""
    if places is not None:
        columns = {name: column[places] for name, column in columns.items()}
    return Axis("draws", dict(columns), place=("calibrate",))


def _rows(columns: dict[str, Values]) -> list[tuple[Value, ...]]:
    """Return the values of each draw, as plain Python values."""
    return list(zip(*(column.tolist() for column in columns.values()), strict=True))


def _points(design: Any, columns: dict[str, Values]) -> list[tuple[Value, ...]]:
    """Return the values of each point of a design."""
    return _rows({name: design.columns[name] for name in columns})
