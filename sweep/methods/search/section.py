"""The `search` section of a spec: its reader, and its effects on a study.

All functions raise SpecError, with file and line, for values that are not allowed.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from sweep.methods.search.checks import check_search
from sweep.methods.search.known_samplers import FOR_ONE, FOR_SEVERAL
from sweep.methods.search.objectives import Constraint, Objective, Statistic
from sweep.methods.search.schema import definitions, model_schema
from sweep.methods.search.section_keys import Parameter, Search
from sweep.methods.search.statistics import STATISTICS
from sweep.spec import (
    DISTRIBUTIONS,
    Axis,
    AxisReader,
    Entry,
    Key,
    KnownMetrics,
    LaterSectionOf,
    Mistakes,
    NotAllowedError,
    Place,
    Setting,
    SettingValues,
    SpecContext,
    SpecSection,
    Study,
    Value,
    check_keys,
    read_axes,
    read_values,
)
from sweep.store import Location
from sweep.text import unknown

MOST_REFERENCES = 1000
KEY = Key(
    LaterSectionOf(Search),
    "an optimisation of parameters, instead of a sweep",
    name="search",
    otherwise="none",
)


def read_search(root: Entry, context: SpecContext) -> Search:
    """Return the section `search` of a spec.

    Raises SpecError with all mistakes together.
    """
    entry = root.get(KEY.name)
    assert entry
    reader = context.reader
    metrics = context.metrics
    taken = context.taken
    entry.mapping()
    mistakes = Mistakes()
    settings = reader.settings
    with mistakes.noted():
        check_keys(entry, Search)
    read = read_values(Search, entry, mistakes)
    parameters = mistakes.read(_parameters, entry.get("parameters"), settings) or ()
    names = [parameter.name for parameter in parameters]
    over = mistakes.read(_over, read.get("over"), reader, [*taken, *names]) or ()
    objectives = mistakes.read(_objectives, entry.get("objectives"), metrics) or ()
    constraints = mistakes.read(_constraints, entry.get("constraints"), metrics)
    all_right = not mistakes
    search = None
    references = None
    if parameters:  # references have values of these parameters
        references = mistakes.read(
            _references, read.get("references"), settings=settings, names=names
        )
    with mistakes.noted():
        _check_once(entry, names, over, taken)
    if all_right:
        usual = FOR_ONE if len(objectives) == 1 else FOR_SEVERAL
        several = {
            "parameters": parameters,
            "objectives": objectives,
            "constraints": constraints,
            "sampler": read.get("sampler") or usual,
            "over": over,
            "references": references or {},
        }
        search = Search(**(read | several))
        mistakes.read(check_search, entry, search)
    mistakes.check()
    assert search
    return search


def _parameters(
    entry: Entry | None, settings: dict[str, Setting]
) -> tuple[Parameter, ...]:
    parameters: list[Parameter] = []
    mistakes = Mistakes()
    for name, child in entry.mapping() if entry else ():
        with mistakes.noted():
            parameters.append(_parameter(name, child, settings))
    mistakes.check()
    return tuple(parameters)


def _parameter(name: str, entry: Entry, settings: dict[str, Setting]) -> Parameter:
    if name not in settings:
        raise entry.error(unknown("parameter", name, settings))
    bounded = [form for form, each in DISTRIBUTIONS.items() if each.bounded]
    content = entry.value if isinstance(entry.value, dict) else {}
    for form in DISTRIBUTIONS:
        if form in content and form not in bounded:
            raise entry.error(
                f'"{name}" cannot be {form}: a search needs bounds;'
                f" allowed: {', '.join(bounded)}"
            )
    entry.keys(bounded)
    if len(entry.value) > 1:
        raise entry.error(f'"{name}" needs exactly one of {", ".join(entry.value)}')
    (form,) = entry.value
    values = [child.value for child in entry.child(form).entries()]
    try:
        DISTRIBUTIONS[form].values(np.array([0.0, 0.5]), settings[name], values)
        return Parameter(
            name, form, tuple(settings[name].coerce(value) for value in values)
        )
    except NotAllowedError as error:
        raise entry.child(form).error(f"{form}: {error}") from None


def _over(
    entry: Entry | None, reader: AxisReader, taken: Iterable[str]
) -> tuple[Axis, ...]:
    """Return the axes of the scenarios, which are common to all candidates."""
    axes = read_axes(entry, reader, taken)
    for axis in axes:
        assert entry is not None
        if axis.when:
            raise (
                entry.child(axis.name)
                .child("when")
                .error("over takes no when: a scenario is for all candidates")
            )
        if axis.continued:
            raise (
                entry.child(axis.name)
                .child("continue")
                .error("over takes no continue: each trial starts a scenario again")
            )
        if axis.blocks:
            raise entry.child(axis.name).error(
                f"over takes no {axis.sampler} sample: a search is no sensitivity"
                " analysis"
            )
    return axes


def _check_once(
    entry: Entry, names: list[str], over: tuple[Axis, ...], taken: Mapping[str, Place]
) -> None:
    places = dict(taken)
    for axis in over:
        for setting in axis.columns:
            if setting in places:
                raise entry.document.error(
                    (*entry.place, "over", axis.name),
                    _has_a_value(setting, places[setting]),
                )
            places[setting] = ("search", "over", axis.name)
    for name in names:
        if name in places:
            raise (
                entry.child("parameters")
                .child(name)
                .error(_has_a_value(name, places[name]))
            )


def _has_a_value(setting: str, place: Place) -> str:
    where = ".".join(str(part) for part in place)
    return f'"{setting}" already has a value, under {where}'


def _objectives(entry: Entry | None, metrics: KnownMetrics) -> tuple[Objective, ...]:
    objectives: list[Objective] = []
    mistakes = Mistakes()
    for _, child in entry.mapping() if entry else ():
        with mistakes.noted():
            objectives.append(_objective(child, metrics))
    mistakes.check()
    return tuple(objectives)


def _objective(entry: Entry, metrics: KnownMetrics) -> Objective:
    column = metrics.column(entry)
    entry.keys(["minimize", "maximize"])
    if len(entry.value) > 1:
        raise entry.error(f'"{column}" needs minimize or maximize, not both')
    (direction,) = entry.value
    statistic = _statistic(entry.child(direction))
    return Objective(column, direction == "maximize", statistic)


def _constraints(entry: Entry | None, metrics: KnownMetrics) -> tuple[Constraint, ...]:
    constraints: list[Constraint] = []
    mistakes = Mistakes()
    for _, child in entry.mapping() if entry else ():
        with mistakes.noted():
            constraints.append(_constraint(child, metrics))
    mistakes.check()
    return tuple(constraints)


def _constraint(entry: Entry, metrics: KnownMetrics) -> Constraint:
    column = metrics.column(entry)
    entry.keys(["at_most", "at_least", "statistic"])
    bounds = [key for key in ("at_most", "at_least") if key in entry.value]
    if len(bounds) != 1:
        raise entry.error(
            f'"{column}" needs at_most or at_least' + (", not both" if bounds else "")
        )
    bound = entry.child(bounds[0]).number()
    chosen = entry.get("statistic")
    statistic = _statistic(chosen) if chosen else Statistic()
    return Constraint(column, bound, bounds[0] == "at_most", statistic)


def _statistic(entry: Entry) -> Statistic:
    if not isinstance(entry.value, dict):
        kind = entry.one_of("statistic", STATISTICS)
        if STATISTICS[kind].takes_share:
            raise entry.error(f"{kind} needs a fraction, such as {{{kind}: 0.1}}")
        return Statistic(kind)
    sharing = [name for name, each in STATISTICS.items() if each.takes_share]
    entry.keys(sharing)
    if len(entry.value) > 1:
        names = " or ".join(name for name in sharing if name in entry.value)
        raise entry.error(f'"{entry.name}" needs {names}, not both')
    (kind,) = entry.value
    share = entry.child(kind).number()
    if not 0 < share < 1:
        raise entry.child(kind).expected("a number above 0 and below 1")
    return Statistic(kind, share)


def _references(
    entry: Entry | None, settings: dict[str, Setting], names: list[str]
) -> dict[str, dict[str, Value]]:
    references: dict[str, dict[str, Value]] = {}
    if entry and len(dict(entry.mapping())) > MOST_REFERENCES:
        raise entry.error(f'"references" allows at most {MOST_REFERENCES:,} names')
    mistakes = Mistakes()
    for reference, child in entry.mapping() if entry else ():
        read = dict[str, Value]()
        for name, value in child.mapping():
            with mistakes.noted():
                if name not in names:
                    raise value.error(unknown("parameter", name, names))
                read[name] = _coerced(settings[name], value)
        if child.value.keys() <= set(names):  # else a name is misspelt
            with mistakes.noted():
                child.keys(names, required=names)
        references[reference] = {name: read[name] for name in names if name in read}
    mistakes.check()
    return references


def _coerced(setting: Setting, entry: Entry) -> Value:
    try:
        return setting.coerce(entry.value)
    except NotAllowedError as error:
        raise entry.error(str(error)) from None


def _setting_values(search: Search) -> dict[str, SettingValues]:
    """Return the values of the searched parameters and of the scenarios, by name."""
    scenarios = {
        name: SettingValues((KEY.name, "over", axis.name), column)
        for axis in search.over
        for name, column in axis.columns.items()
    }
    searched = {
        parameter.name: SettingValues(
            (KEY.name, "parameters", parameter.name), parameter.arguments
        )
        for parameter in search.parameters
    }
    return scenarios | searched


def scenarios_of(study: Study, search: Search) -> Study:
    """Return the study of the scenarios, with the preset's values of parameters."""
    rest = {key: value for key, value in study.sections.items() if key != KEY.name}
    return replace(study, axes=search.over, require=(), sections=rest)


def _strategy(study: Study, _search: Search, results: Location | None) -> Any:
    """Return the strategy of a study. The call imports `sweep.campaigns`."""
    from sweep.methods.search.strategy import search_strategy

    return search_strategy(study, results)


def _plan(study: Study, workers: int, compiling_seconds: float) -> Any:
    """Return the plan of a study. The call imports `sweep.trial`."""
    from sweep.methods.search.plan import make_search_plan

    return make_search_plan(study, workers, compiling_seconds)


SCENARIOS = 'axes of the scenarios for all candidates belong in "search" under "over"'
SECTION = SpecSection(
    KEY,
    read=read_search,
    not_beside={
        "sweep": SCENARIOS,
        "sizes": SCENARIOS,
        "order": "a search proposes candidates in sequence",
    },
    strategy=_strategy,
    stand_in=scenarios_of,
    plan=_plan,
    command="search",
    setting_values=_setting_values,
    columns=lambda search: search.columns,
    columns_under=("objectives", "constraints"),
    # Block k has the same random numbers for every candidate.
    streams={"noise": "common"},
    definitions=definitions,
    model_schema=model_schema,
)
