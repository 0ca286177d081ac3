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
from sweep.design import Counts, Ids, Jobs, KnownIds, as_texts, expand
from sweep.errors import SpecError, UserError
from sweep.methods.calibration.rule import Calibration, summarised
from sweep.methods.calibration.targets import (
    DATA,
    PRIOR,
    TRUTH,
    PriorDraws,
    Target,
)
from sweep.methods.comparison import Side, read_side, study_named
from sweep.methods.profiles import profile_units, recorded_profiles
from sweep.spec import Axis, Column, Study, Value, Values, spelled
from sweep.store import AT, Location, PlanAbout, values_at
from sweep.tables import StoredStudy
from sweep.text import so_many

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


class Proposals(NamedTuple):
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
        self.looks_at = rule.sources
        self.prior = PriorDraws(rule, study.settings, study.seed)
        self.simulations = _Simulations(study, self.prior)
        drawn = self.prior.first()
        self.first = drawn[self.simulations.allowed(drawn)]
        if len(self.first) < rule.population:
            raise study.document.error(
                rule.place,
                f"the spec allows {len(self.first):,} of {rule.draws:,} draws from the"
                f' prior, fewer than the {rule.population:,} of "population": give the'
                " axis more points",
            )
        check_data(study, rule)
        self.data = read_data(study, rule, results) if results else None
        most = rule.most_trials(0)
        self.progress = Progress(most=most, trials=most, ahead=True)
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
        batches = self._from_prior()
        yield self._round(batches)
        targets = self._targets(batches, self._summaries(batches, look()))
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
        self.progress.trials = sum(self.simulations.counts.values())
        yield self._round([])

    def _from_prior(self) -> list[Proposals]:
        """Return the draws from the prior of all data sets, and the true draws."""
        batches = [Proposals(DATA, PRIOR, self.first)]
        for number in range(1, self.rule.checks + 1):
            drawn = self.prior.of_check(number)
            allowed = drawn[self.simulations.allowed(drawn)]
            batches.append(Proposals(number, TRUTH, allowed[:1]))
            batches.append(Proposals(number, PRIOR, allowed[1:]))
        return batches

    def _targets(
        self, batches: list[Proposals], summaries: list[Floats]
    ) -> list[Target]:
        """Return the data sets that have all summaries, with draws from the prior."""
        assert self.data
        data = {DATA: np.array(self.data.summaries)}
        targets = list[Target]()
        for batch, simulated in zip(batches, summaries, strict=True):
            if batch.generation == TRUTH:
                (data[batch.number],) = simulated
            elif np.isfinite(data[batch.number]).all():
                target = Target(batch.number, data[batch.number], self.rule)
                target.begin(batch.draws, simulated)
                targets.append(target)
        return targets

    def _proposals(self, active: list[Target]) -> Iterator[Proposals]:
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
            yield Proposals(target.number, generation, draws)

    def _note(self, target: Target) -> None:
        if target.number != DATA:
            return
        generations = target.population.generations
        last = generations[-1]
        self.progress.note = (
            f"generation {len(generations) - 1}: tolerance {last.tolerance:.3g},"
            f" {100 * last.accepted:.0f} % accepted"
        )

    def _round(self, batches: list[Proposals]) -> Round:
        requested = self.simulations.request(batches)
        self.progress.points = len(self.simulations.counts)
        return Round(requested.ids, requested.some, self._plan)

    def _plan(self, origin: Origin) -> PlanTables:
        return self.simulations.tables(self.description, origin)

    def _summaries(self, batches: list[Proposals], table: pa.Table) -> list[Floats]:
        """Return the summaries of the simulations of each batch."""
        counts = [len(batch.draws) for batch in batches]
        shape = sum(counts), self.rule.replicates
        values = {
            str(source): table[str(source)].to_numpy().astype(np.float64).reshape(shape)
            for source in self.rule.sources
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
        columns = self.prior.values(draws)
        # One point that is allowed keeps the design from being empty.
        marked = {
            name: np.concatenate([column, self.known[name]])
            for name, column in columns.items()
        }
        try:
            design = expand(replace(self.study, axes=(_axis(marked),)))
        except SpecError:
            if len(draws) == 1:
                return np.zeros(1, np.bool_)
            half = len(draws) // 2
            return np.concatenate(
                [self.allowed(draws[:half]), self.allowed(draws[half:])]
            )
        among = {*_points(design, columns)}
        return np.array([row in among for row in _rows(columns)])

    def request(self, batches: list[Proposals]) -> _Requested:
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

    def _rows(self, batches: list[Proposals], ids: Ids) -> pa.Table:
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
        """Return the plan, and the table of the requested simulations.

        Parameters
        ----------
        description : dict
            Description of the calibration, for the metadata of the table.
        origin : mapping
            Provenance, for the metadata of the plan.
        """
        designs = [each.jobs.design for each in self.requested if each.jobs]
        names = list(
            dict.fromkeys(name for each in designs for name in each.told_apart)
        )
        parts = list[pa.Table]()
        for requested in self.requested:
            jobs = requested.jobs
            assert jobs
            part = jobs.rows(requested.places, requested.ids)
            points = jobs.points_at(requested.places)
            for name in names:
                # A column that follows from others may be constant in a round.
                column = jobs.design.columns.get(name)
                if column is None:
                    column = self.study.settings[name].column([jobs.design.base[name]])
                    column = np.repeat(column, jobs.design.n_points)
                part = part.append_column(name, pa.array(column[points]))
            parts.append(part)
        record = PlanAbout.of(self.study, names, self.study.axes)
        plan = record.into(pa.concat_tables(parts).combine_chunks(), origin)
        table = pa.concat_tables(self.rows).combine_chunks()
        described = {ABOUT: json.dumps(description)}
        return plan.to_reader(), table.replace_schema_metadata(described)


def check_data(study: Study, rule: Calibration) -> None:
    """Raise SpecError if a study is to be calibrated to its own trials.

    Parameters
    ----------
    study : Study
    rule : Calibration
    """
    if study_named(rule.to) == study.name:
        raise study.document.error(
            (*rule.place, "to"), "the data must be another study, not the study itself"
        )


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
    why = _why_not(study, rule, side)
    if why:
        raise study.document.error(place, why)
    values = {
        name: side.trials[name].to_numpy(np.float64, na_value=np.nan)[None]
        for name in rule.columns
    }
    ids = pa.array(side.trials["trial_id"], pa.string())
    at_points = values_at_points(side.study, rule, ids)
    values |= {name: column[None] for name, column in at_points.items()}
    (summaries,) = summarised(rule.summaries, values)
    trials = min(int(np.isfinite(column).sum()) for column in values.values())
    unknown = [
        summary.words
        for summary, value in zip(rule.summaries, summaries, strict=True)
        if not np.isfinite(value)
    ]
    if unknown:
        raise study.document.error(
            place,
            f"the {so_many(len(side.trials), 'trial')} of {side.text} have no"
            f" {', '.join(unknown)}",
        )
    return Data(summaries.tolist(), trials)


def values_at_points(
    study: StoredStudy, rule: Calibration, trials: pa.Array
) -> dict[str, Floats]:
    """Return the values of trials at the points of profiles, by point.

    Parameters
    ----------
    study : StoredStudy
    rule : Calibration
    trials : array of str, shape (n,)
        Ids of trials.

    Returns
    -------
    dict of arrays, shape (n,)
        NaN for a trial without the profile.
    """
    if not rule.points:
        return {}
    table = study.read("profiles", trials)
    ids = KnownIds.of_column(table["trial_id"].cast(pa.string()))
    places = ids.places_of_column(pa.chunked_array([trials]))
    at_points = dict[str, Floats]()
    for point in rule.points:
        stored = np.append(values_at(point, table), np.nan)
        at_points[str(point)] = stored[places]
    return at_points


def _why_not(study: Study, rule: Calibration, side: Side) -> str:
    """Return why trials cannot be the data, in words; "" for data."""
    name = side.study.name
    profiles = recorded_profiles(side.study.profiles)
    lacking = [column for column in rule.columns if column not in side.trials]
    lacking += dict.fromkeys(
        point.profile for point in rule.points if point.profile not in profiles
    )
    if lacking:
        recorded = ", ".join((*side.study.metrics, *profiles))
        return f"{name} lacks {', '.join(lacking)}; recorded: {recorded}"
    if side.missing:
        trials = so_many(side.missing, "trial")
        return f"{trials} of {name} are not stored; launch {name} first"
    points = side.trials["point"].nunique()
    if points > 1:
        varied = ", ".join(side.study.about.varied)
        return (
            f"{side.text} has {points:,} points, and data are trials of one point:"
            f" choose with {name}:parameter=value, of {varied}"
        )
    for column, stored, own in _units(study, rule, side.study):
        if stored != own:
            return (
                f"{column} cannot be compared: the unit is {stored or 'none'} in {name}"
                f" and {own or 'none'} here"
            )
    return _why_beyond(rule, side)


def _why_beyond(rule: Calibration, side: Side) -> str:
    """Return which position is not on the axis of the data, in words; "" for none."""
    if not rule.points:
        return ""
    profiles = side.study.profiles
    stored = profiles[profiles["trial_id"].isin(side.trials["trial_id"])]
    for profile, at in rule.points:
        stored_positions = stored[f"{profile}{AT}"].dropna()
        if stored_positions.empty:
            return f"no trial of {side.text} has {profile}"
        positions = np.concatenate([*stored_positions])
        first = positions.min()
        last = positions.max()
        if not first <= at <= last:
            return (
                f"{profile} has positions from {first:g} to {last:g} in {side.text}, so"
                f" there is no value at {at:g}"
            )
    return ""


def _units(
    study: Study, rule: Calibration, stored: StoredStudy
) -> Iterator[tuple[str, str, str]]:
    """Yield each value that is compared, with its unit in the data and in a study."""
    for column in rule.columns:
        yield column, stored.units.get(column, ""), _unit(study, column)
    model = study.catalogue.models[study.model]
    for name in dict.fromkeys(point.profile for point in rule.points):
        profile = study.catalogue.profiles[name]
        unit, axis_unit = profile_units(stored, name)
        yield name, unit, spelled(profile.unit, model)
        yield f"the axis of {name}", axis_unit, spelled(profile.axis_unit, model)


def _unit(study: Study, column: str) -> str:
    """Return the unit of a column of trials of a study."""
    name = Column.read(column).metric
    for derived in study.record.derive:
        if derived.name == name:
            return derived.unit
    model = study.catalogue.models[study.model]
    return spelled(study.catalogue.metrics[name].unit, model)


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
