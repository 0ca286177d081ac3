"""The `search` section of a spec: what is searched for, among what, and how much it may cost.

All functions raise SpecError, with file and line, for what is not allowed.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from kernels.settings import Model
from sweep.axes import Axis, AxisReader
from sweep.document import Entry, Place
from sweep.fields import Field, NotAllowedError, Value
from sweep.limits import MOST_SEARCHED
from sweep.names import unknown
from sweep.recorded import read_column
from sweep.sampling import DISTRIBUTIONS
from sweep.search.checks import check_search
from sweep.search.objectives import Constraint, Objective, Statistic
from sweep.values import read_axes

FORMS = ("uniform", "loguniform", "integers", "choice")
"""The distributions that have bounds, which a search needs."""

SAMPLERS = ("random", "qmc", "tpe", "cmaes", "gp", "nsga2", "nsga3")
REQUIRED = ("parameters", "objectives", "budget")
KEYS = (*REQUIRED, "constraints", "sampler", "batch", "racing", "over", "held_out", "references")

BATCH = 12
LEVEL = 0.1
HELD_OUT_CANDIDATES, HELD_OUT_REPLICATES = 5, 40
MOST_BATCH, MOST_REFERENCES = 10_000, 1000


@dataclass(frozen=True)
class Parameter:
    """A field that the search varies: `form` is one of FORMS, `arguments` are its bounds, or the values to choose."""

    name: str
    form: str
    arguments: tuple[Value, ...]


@dataclass(frozen=True)
class HeldOut:
    """How many candidates are judged on new seeds at the end, and with how many replicates."""

    candidates: int = HELD_OUT_CANDIDATES
    replicates: int = HELD_OUT_REPLICATES


@dataclass(frozen=True, eq=False)
class Search:
    """A checked `search` section.

    `level` is that of the tests by which candidates are dropped, None where all get all of their blocks. `over` are
    the axes of the scenarios. `references` are settings of all parameters by name.
    """

    parameters: tuple[Parameter, ...]
    objectives: tuple[Objective, ...]
    constraints: tuple[Constraint, ...]
    budget: int
    sampler: str
    batch: int
    level: float | None
    over: tuple[Axis, ...]
    held_out: HeldOut
    references: dict[str, dict[str, Value]]

    @property
    def scenarios(self) -> int:
        """The number of scenarios."""
        return int(np.prod([len(axis) for axis in self.over], dtype=np.int64))

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns of trials that decide, each once."""
        objectives = [objective.column for objective in self.objectives]
        return tuple(dict.fromkeys([*objectives, *(constraint.column for constraint in self.constraints)]))

    def held_out_trials(self, repetitions: int) -> int:
        """The most trials on held-out seeds: of the best candidates and the references, and a winner a further run."""
        several = self.held_out.candidates if len(self.objectives) > 1 else 1
        settings = self.held_out.candidates + len(self.references) + 2 * repetitions * several
        return settings * self.held_out.replicates * self.scenarios

    def most_trials(self, repetitions: int) -> int:
        """The most trials of the search, with repetitions and as many random searches."""
        return (1 + 2 * repetitions) * self.budget + self.held_out_trials(repetitions)

    def place_of(self, field: str) -> Place | None:
        """Where in the spec the search gives a field its values, or None where it does not."""
        if any(parameter.name == field for parameter in self.parameters):
            return ("search", "parameters", field)
        return next((("search", "over", axis.name) for axis in self.over if field in axis.columns), None)


def read_search(entry: Entry, reader: AxisReader, model: Model, given: Mapping[str, Place]) -> Search:
    """The section that `entry` writes; `given` are the places of the fields with a value elsewhere in the spec."""
    entry.keys(KEYS, required=REQUIRED)
    parameters = _parameters(entry.child("parameters"), reader.fields)
    names = [parameter.name for parameter in parameters]
    over = _over(entry.get("over"), reader, [*given, *names])
    _check_once(entry, names, over, given)
    search = Search(
        parameters=parameters,
        objectives=_objectives(entry.child("objectives"), model),
        constraints=_constraints(entry.get("constraints"), model),
        budget=entry.child("budget").whole(1, MOST_SEARCHED),
        sampler=_sampler(entry),
        batch=_whole(entry.get("batch"), BATCH, MOST_BATCH),
        level=_level(entry.get("racing")),
        over=over,
        held_out=_held_out(entry.get("held_out")),
        references=_references(entry.get("references"), reader.fields, names),
    )
    check_search(entry, search)
    return search


def _parameters(entry: Entry, fields: dict[str, Field]) -> tuple[Parameter, ...]:
    return tuple(_parameter(name, child, fields) for name, child in entry.mapping())


def _parameter(name: str, entry: Entry, fields: dict[str, Field]) -> Parameter:
    if name not in fields:
        raise entry.error(unknown("field", name, fields))
    if isinstance(entry.value, dict) and "normal" in entry.value:
        raise entry.error(f'"{name}" cannot be normal: a search needs bounds, as {", ".join(FORMS)} have')
    entry.keys(FORMS)
    if len(entry.value) > 1:
        raise entry.error(f'"{name}" needs one of {", ".join(entry.value)}, not all of them')
    (form,) = entry.value
    values = [child.value for child in entry.child(form).entries()]
    try:
        DISTRIBUTIONS[form](np.array([0.0, 0.5]), fields[name], values)
        return Parameter(name, form, tuple(fields[name].coerce(value) for value in values))
    except NotAllowedError as error:
        raise entry.child(form).error(f"{form}: {error}") from None


def _over(entry: Entry | None, reader: AxisReader, given: Iterable[str]) -> tuple[Axis, ...]:
    """The axes of the scenarios, which are the same for every candidate."""
    axes = read_axes(entry, reader, given)
    for axis in axes:
        assert entry is not None
        if axis.when:
            raise (entry.child(axis.name).child("when").error("over takes no when: a scenario is for all candidates"))
        if axis.blocks:
            raise entry.child(axis.name).error(f"over takes no {axis.sampler} sample: it is no analysis of sensitivity")
    return axes


def _check_once(entry: Entry, names: list[str], over: tuple[Axis, ...], given: Mapping[str, Place]) -> None:
    taken = dict(given)
    for axis in over:
        for field in axis.columns:
            if field in taken:
                raise entry.document.error((*entry.place, "over", axis.name), _has_a_value(field, taken[field]))
            taken[field] = ("search", "over", axis.name)
    for name in names:
        if name in taken:
            raise entry.child("parameters").child(name).error(_has_a_value(name, taken[name]))


def _has_a_value(field: str, place: Place) -> str:
    return f'"{field}" has a value already, under {".".join(str(part) for part in place)}'


def _objectives(entry: Entry, model: Model) -> tuple[Objective, ...]:
    found = []
    for _, child in entry.mapping():
        column = read_column(child, model)
        child.keys(["minimize", "maximize"])
        if len(child.value) > 1:
            raise child.error(f'"{column}" needs minimize or maximize, not both')
        (direction,) = child.value
        found.append(Objective(column, direction == "maximize", _statistic(child.child(direction))))
    return tuple(found)


def _constraints(entry: Entry | None, model: Model) -> tuple[Constraint, ...]:
    found = []
    for _, child in entry.mapping() if entry else ():
        column = read_column(child, model)
        child.keys(["at_most", "at_least", "statistic"])
        bounds = [key for key in ("at_most", "at_least") if key in child.value]
        if len(bounds) != 1:
            raise child.error(f'"{column}" needs at_most or at_least' + (", not both" if bounds else ""))
        statistic = child.get("statistic")
        kind = _statistic(statistic) if statistic else Statistic("mean")
        found.append(Constraint(column, child.child(bounds[0]).number(), bounds[0] == "at_most", kind))
    return tuple(found)


def _statistic(entry: Entry) -> Statistic:
    if not isinstance(entry.value, dict):
        kind = entry.one_of("statistic", ["mean", "worst", "quantile", "cvar"])
        if kind in ("quantile", "cvar"):
            raise entry.error(f"{kind} needs its share, as in {{{kind}: 0.1}}")
        return Statistic(kind)
    entry.keys(["quantile", "cvar"])
    if len(entry.value) > 1:
        raise entry.error(f'"{entry.name}" needs quantile or cvar, not both')
    (kind,) = entry.value
    share = entry.child(kind).number()
    if not 0 < share < 1:
        raise entry.child(kind).expected("a number above 0 and below 1")
    return Statistic(kind, share)


def _sampler(entry: Entry) -> str:
    given = entry.get("sampler")
    if given:
        return given.one_of("sampler", SAMPLERS)
    return "tpe" if len(entry.value["objectives"]) == 1 else "nsga2"


def _whole(entry: Entry | None, default: int, most: int) -> int:
    return entry.whole(1, most) if entry else default


def _level(entry: Entry | None) -> float | None:
    if entry is None or entry.value is True:
        return LEVEL
    if entry.value is False:
        return None
    if not isinstance(entry.value, dict):
        raise entry.expected("true, false or {level: a number}")
    entry.keys(["level"])
    level = entry.child("level").number()
    if not 0 < level < 0.5:
        raise entry.child("level").expected("a number above 0 and below 0.5")
    return level


def _held_out(entry: Entry | None) -> HeldOut:
    if entry is None:
        return HeldOut()
    entry.keys(["candidates", "replicates"])
    return HeldOut(
        _whole(entry.get("candidates"), HELD_OUT_CANDIDATES, MOST_SEARCHED),
        _whole(entry.get("replicates"), HELD_OUT_REPLICATES, MOST_SEARCHED),
    )


def _references(entry: Entry | None, fields: dict[str, Field], names: list[str]) -> dict[str, dict[str, Value]]:
    references: dict[str, dict[str, Value]] = {}
    if entry and len(dict(entry.mapping())) > MOST_REFERENCES:
        raise entry.error(f'"references" are at most {MOST_REFERENCES:,}')
    for reference, child in entry.mapping() if entry else ():
        for name, value in child.mapping():
            if name not in names:
                raise value.error(unknown("parameter", name, names))
        child.keys(names, required=names)
        references[reference] = {name: _coerced(fields[name], child.child(name)) for name in names}
    return references


def _coerced(field: Field, entry: Entry) -> Value:
    try:
        return field.coerce(entry.value)
    except NotAllowedError as error:
        raise entry.error(str(error)) from None
