"""The section `calibrate` of a spec: parameters that reproduce data.

All functions raise SpecError, with file and line, for values that are not allowed.
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any

from sweep.methods.calibration.rule import (
    MEAN,
    STATISTICS,
    Calibration,
    Prior,
    Summary,
)
from sweep.spec import (
    ANY_METRIC,
    DISTRIBUTIONS,
    SAMPLERS,
    USUAL_BINS,
    Axis,
    Entry,
    Key,
    LaterSectionOf,
    ListOf,
    Mistakes,
    Number,
    ReadLater,
    Schema,
    SpecContext,
    SpecSection,
    Study,
    Text,
    Truth,
    Whole,
    check_keys,
    check_recorded,
    named,
    read_values,
    reference,
    section_schema,
)
from sweep.store import Location

LEAST_POPULATION = 50
MOST_POPULATION = 10_000
MOST_GENERATIONS = 50
MOST_CHECKS = 1000
PURPOSES = ("start", "world", "noise")


def _statistics_schema() -> Schema:
    """Return the schema of a statistic, or of a list of statistics."""
    share = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
    statistic: Schema = {"anyOf": [{"enum": list(STATISTICS)}, share]}
    several: Schema = {"type": "array", "items": statistic, "minItems": 1}
    return {"anyOf": [statistic, several]}


@dataclass(frozen=True, kw_only=True)
class AtPositions:
    """The keys of the summaries of a profile."""

    at: Annotated[
        tuple[float, ...],
        Key(
            ListOf(Number(above=0), "positions"),
            "positions along the axis of the profile; between two stored positions the"
            " value is on a straight line",
            example="[0.5, 1, 2]",
        ),
    ]
    statistics: Annotated[
        tuple[str | float, ...],
        Key(
            ReadLater(
                "mean, sd, a probability, or a list of these", _statistics_schema
            ),
            "statistics over trials of the value at each position",
            otherwise=MEAN,
            example="[mean, sd]",
        ),
    ]


def _summaries_schema() -> Schema:
    """Return the schema of columns with statistics, or of a list of columns."""
    of_column: Schema = {
        "anyOf": [*_statistics_schema()["anyOf"], section_schema(AtPositions)]
    }
    columns: Schema = {"type": "array", "items": reference("column"), "minItems": 1}
    return {"anyOf": [columns, named(of_column, reference("column"))]}


@dataclass(frozen=True, kw_only=True)
class Calibrate:
    """The keys of the section, from which `read_calibrate` makes a `Calibration`."""

    to: Annotated[
        str,
        Key(
            Text("a stored study, or some trials of a stored study"),
            "the data: a stored recording or study, `STUDY` or"
            " `STUDY:parameter=value,...`",
            example="sheep/drives",
        ),
    ]
    summaries: Annotated[
        tuple[Summary, ...],
        Key(
            ReadLater(
                "columns, each with mean, sd, a probability, or a list of these",
                _summaries_schema,
                parts=(AtPositions,),
                between=".PROFILE",
            ),
            "what data and simulations are compared by: statistics of recorded metrics"
            " over trials; a list of metrics means `mean`; a probability is a quantile;"
            " a profile has `{at: POSITIONS, statistics: ...}`",
            example=f"{{{ANY_METRIC}: [mean, sd]}}",
        ),
    ]
    population: Annotated[
        int,
        Key(
            Whole(LEAST_POPULATION, MOST_POPULATION),
            "number of nearest simulations to keep, and of proposals per generation",
            example="1000",
        ),
    ] = 500
    generations: Annotated[
        int,
        Key(
            Whole(0, MOST_GENERATIONS),
            "most generations after the draws from the prior",
            example="12",
        ),
    ] = 8
    acceptance: Annotated[
        float,
        Key(
            Number(least=0, below=1),
            "fraction of accepted proposals below which the calibration ends",
            example="0.02",
        ),
    ] = 0.05
    checks: Annotated[
        int,
        Key(
            Whole(0, MOST_CHECKS),
            "number of synthetic data sets for simulation-based calibration",
            example="100",
        ),
    ] = 0
    learnt: Annotated[
        bool,
        Key(
            Truth(),
            "whether a regression on the draws from the prior turns the summaries into"
            " estimates of the parameters",
            example="true",
        ),
    ] = False


KEY = Key(
    LaterSectionOf(Calibrate),
    "the parameters of the sampled axis are estimated from data",
    name="calibrate",
    otherwise="no calibration",
)


def read_calibrate(root: Entry, context: SpecContext) -> Calibration | None:
    """Return the rule that the section writes; None if another key is wrong."""
    entry = root.child(KEY.name)
    mistakes = Mistakes()
    entry.mapping()
    with mistakes.noted():
        check_keys(entry, Calibrate)
    with mistakes.noted():
        numbers = Mistakes()
        values = read_values(Calibrate, entry, numbers)
        numbers.check()
    summaries = mistakes.read(_summaries, entry.get("summaries"), context) or ()
    if context.replication:
        mistakes.read(_check_trials, root, summaries, context)
    axis = None
    if context.axes is not None:
        axis = mistakes.read(_axis, root, context)
    if axis and not numbers:
        mistakes.read(_check_draws, root, axis, values["population"])
    mistakes.read(_check_streams, root)
    mistakes.check()
    if axis is None or context.replication is None:
        return None
    replicates = context.replication.replicates
    assert replicates
    assert axis.sampler
    texts = [name for name, column in axis.columns.items() if column.dtype == object]
    if values["learnt"] and texts:
        raise entry.child("learnt").error(
            f"no regression estimates {texts[0]}, which has no numbers"
        )
    values |= {"summaries": summaries}
    written = root.child("sweep").child(axis.name)
    return Calibration(
        **values,
        priors=_priors(written, axis),
        axis=axis.name,
        sampler=axis.sampler,
        draws=written.value["points"],
        replicates=replicates,
    )


def _summaries(entry: Entry | None, context: SpecContext) -> tuple[Summary, ...]:
    """Return the summaries, and raise SpecError for columns that are not recorded."""
    if entry is None:
        return ()
    summaries = list[Summary]()
    mistakes = Mistakes()
    metrics = context.metrics.catalogue.metrics
    if isinstance(entry.value, dict):
        for column, child in entry.mapping():
            if _is_profile(column, context):
                summaries += mistakes.read(_of_profile, child, column, context) or ()
                continue
            with mistakes.noted():
                check_recorded(child, column, context.recorded, metrics)
            for statistic in _statistics(child, mistakes):
                summaries.append(Summary(column, statistic))
    else:
        for child in entry.entries():
            with mistakes.noted():
                if _is_profile(child.text(), context):
                    raise child.error(
                        f'"{child.text()}" is a profile: write {_form(child.text())}'
                    )
                check_recorded(child, child.text(), context.recorded, metrics)
                summaries.append(Summary(child.text(), MEAN))
    if len(summaries) > len(set(summaries)):
        with mistakes.noted():
            raise entry.error("summaries has a statistic twice")
    mistakes.check()
    return tuple(summaries)


def _is_profile(name: str, context: SpecContext) -> bool:
    """Return whether a name is that of a profile, and not of a derived metric."""
    return name in context.metrics.catalogue.profiles and name not in context.recorded


def _of_profile(entry: Entry, name: str, context: SpecContext) -> list[Summary]:
    """Return the summaries of a profile at some positions."""
    mistakes = Mistakes()
    recorded = {each.name for each in context.profiles or ()}
    if context.profiles is not None and name not in recorded:
        with mistakes.noted():
            raise entry.error(
                f'profile "{name}" is not recorded: list it under "profiles" of'
                ' "record"'
            )
    if context.metrics.catalogue.profiles[name].axis == "individual":
        raise entry.error(f'the positions of "{name}" are individuals, not a distance')
    if not isinstance(entry.value, dict):
        raise entry.expected(f"the positions of a profile: {_form(name)}")
    with mistakes.noted():
        check_keys(entry, AtPositions)
    positions = read_values(AtPositions, entry, mistakes).get("at", ())
    low, high = _known_range(name, context)
    for place, at in enumerate(positions):
        if not low <= at <= high:
            with mistakes.noted():
                raise (
                    entry.child("at")
                    .child(place)
                    .expected(
                        f"a position along {name}, whose values are from {low:g} to"
                        f" {high:g}"
                    )
                )
    statistics: list[str | float] = [MEAN]
    if written := entry.get("statistics"):
        statistics = _statistics(written, mistakes)
    mistakes.check()
    return [
        Summary(name, statistic, at) for at in positions for statistic in statistics
    ]


def _known_range(name: str, context: SpecContext) -> tuple[float, float]:
    """Return the ends of the positions of a recorded profile, as far as known.

    The values along a distance are at the centres of bins.
    """
    for recorded in context.profiles or ():
        if recorded.name == name and recorded.to is not None:
            if context.metrics.catalogue.profiles[name].axis != "distance":
                return 0.0, recorded.to
            half = recorded.to / (2 * (recorded.bins or USUAL_BINS))
            return half, recorded.to - half
    return 0.0, math.inf


def _form(profile: str) -> str:
    return f"{{{profile}: {{at: [0.5, 1], statistics: {MEAN}}}}}"


def _statistics(entry: Entry, mistakes: Mistakes) -> list[str | float]:
    """Return the statistics of a column, and note mistakes."""
    every = entry.entries() if isinstance(entry.value, list) else [entry]
    read = list[str | float]()
    for each in every:
        with mistakes.noted():
            read.append(_statistic(each))
    return read


def _statistic(entry: Entry) -> str | float:
    if isinstance(entry.value, str):
        return entry.one_of("statistic", STATISTICS)
    if isinstance(entry.value, bool) or not isinstance(entry.value, int | float):
        raise entry.expected("mean, sd, or a probability above 0 and below 1")
    if not 0 < entry.value < 1:
        raise entry.expected("a probability above 0 and below 1")
    return float(entry.value)


def _check_trials(
    root: Entry, summaries: tuple[Summary, ...], context: SpecContext
) -> None:
    """Raise SpecError unless a simulation has enough trials for each summary."""
    assert context.replication
    replicates = context.replication.replicates
    if replicates is None or root.get("replicates") is None:
        raise root.child(KEY.name).error(
            'needs "replicates": the number of trials of a simulation'
        )
    single = [each for each in summaries if each.statistic != MEAN]
    if single and replicates == 1:
        raise root.child("replicates").error(
            f"the {single[0].words} needs at least 2 trials of a simulation, as many as"
            " the data have"
        )


def _axis(root: Entry, context: SpecContext) -> Axis:
    """Return the only axis of the spec, whose distributions are the prior."""
    axes = context.axes or ()
    entry = root.child(KEY.name)
    designs = root.get("sweep")
    if designs and isinstance(designs.value, list):
        raise entry.error('"sweep" must be one mapping, not a list of designs')
    if len(axes) != 1:
        raise entry.error(
            f'"sweep" needs exactly one axis, whose distributions are the prior; it has'
            f" {len(axes)}"
        )
    (axis,) = axes
    if designs is None or axis.name not in designs.value:
        raise entry.error(
            '"sweep" needs an axis, whose distributions are the prior; the only axis of'
            f' the spec is "{axis.name}", of another section'
        )
    written = designs.child(axis.name)
    if axis.when or axis.continued:
        key = "when" if axis.when else "continue"
        raise written.child(key).error(f'the axis of a prior takes no "{key}"')
    usable = [name for name, each in SAMPLERS.items() if each.blocks is None]
    if axis.sampler not in usable:
        raise written.error(
            f'"{axis.name}" is no prior: write {{sample: random, points: 2000, ...}}'
            f" with a distribution per parameter; samplers: {', '.join(usable)}"
        )
    return axis


def _check_draws(root: Entry, axis: Axis, population: int) -> None:
    """Raise SpecError for fewer draws from the prior than simulations to keep."""
    points = root.child("sweep").child(axis.name).child("points")
    draws = points.value
    if isinstance(draws, int) and draws < population:
        raise points.error(
            f"the prior needs at least as many points as the {population:,} simulations"
            f' of "population", not {draws:,}'
        )


def _check_streams(root: Entry) -> None:
    """Raise SpecError if simulations would share random numbers."""
    streams = root.get("streams")
    mistakes = Mistakes()
    for purpose, child in streams.mapping() if streams else ():
        with mistakes.noted():
            if purpose in PURPOSES and child.value != "independent":
                raise child.error(
                    f'"calibrate" needs independent random numbers, so "{purpose}" must'
                    " be independent, or left out"
                )
    mistakes.check()


def _priors(written: Entry, axis: Axis) -> dict[str, Prior]:
    """Return the distributions of an axis, by parameter."""
    if axis.name in axis.columns:
        return {axis.name: _prior(written)}
    return {name: _prior(written.child(name)) for name in axis.columns}


def _prior(entry: Entry) -> Prior:
    form = next(key for key in entry.value if key in DISTRIBUTIONS)
    return Prior(form, tuple(entry.value[form]))


def _strategy(study: Study, rule: Calibration, results: Location | None) -> Any:
    """Return the strategy of a study. The call imports `sweep.campaigns`."""
    from sweep.methods.calibration.strategy import CalibrationStrategy

    return CalibrationStrategy(study, rule, results)


SECTION = SpecSection(
    KEY,
    read=read_calibrate,
    not_beside={"seeds": "", "order": ""},
    needs={
        "required": ["sweep", "replicates"],
        "properties": {
            "replicates": {"type": "integer"},
            "sweep": {"type": "object", "maxProperties": 1},
        },
    },
    strategy=_strategy,
    # Simulations are independent draws: equal random numbers would tie them together.
    streams=dict.fromkeys(PURPOSES, "independent"),
)
