"""An ODD description of a model and a study: overview, design concepts, details.

The elements follow Grimm et al. 2020, Journal of Artificial Societies and Social
Simulation 23(2), 7. All texts come from the declarations of a model, metrics, maps,
initial conditions and a spec, and from the docstrings of functions. A missing text is
printed as a gap, "not stated", and listed at the end for the author to fill in.

A study of a recording has no model: the page describes the data instead.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice, product
from pathlib import Path
from typing import Any, get_args, get_type_hints

import numpy as np

from kernels.catalogue import Catalogue
from kernels.model import Model
from kernels.settings import COMMON, UPDATE, About
from sweep.design import Design
from sweep.errors import ChoiceError, CodeError, StoreError
from sweep.published import bibliography_of
from sweep.sharing.citing import behind, program
from sweep.spec import (
    RECORDING,
    Document,
    RecordingSpec,
    Setting,
    Streams,
    Study,
    Value,
    averaged_frames,
    keys_of,
    parse,
    parse_document,
    read_section,
    settings_of,
    spelled,
)
from sweep.store import AT
from sweep.tables import StoredStudy, keep_apart
from sweep.text import description_of, so_many

MOST_VALUES = 8
"""Most values of a parameter that are listed; more numbers are written as a range."""
PROTOCOL = (
    "Grimm et al. (2020): The ODD protocol for describing agent-based and other"
    " simulation models: a second update to improve clarity, replication, and"
    " structural realism. Journal of Artificial Societies and Social Simulation"
    " 23(2), 7."
)
EXPLAINED_UNITS = {"m", "cm", "mm", "s", "min", "h"}
"""Units that need no explanation."""
GROUPS = {
    "parameters": "Parameters of the model",
    "schedule": "Extent",
    "world": "World",
    "sensing": "Interaction neighbourhood, sensing and communication",
    "actuation": "Actuation",
    "failures": "Failures",
    "medium": "Wind",
    "start": "Initial condition",
    "observation": "Observation",
}
"""Headings of the groups of parameters, in the order of the page."""
MAY_BE_OFF = ("sensing", "actuation", "failures", "medium")
"""Groups whose parameters are off with the value of an ideal boid."""
MOST_COMBINED = 10_000
"""Most combinations of values for which a condition is evaluated."""
STREAMS = keys_of(Streams)
MOST_EVENTS = 50
"""Most events of a recording that are listed."""
SHA_DIGITS = 12
SEARCHED = "searched"
"""Text that replaces the value of a parameter that a search varies."""


@dataclass(frozen=True)
class StudyFacts:
    """The described facts of a spec or of a stored study.

    Attributes
    ----------
    name : str
    catalogue : Catalogue
        The models, metrics, maps and starts that the study can use.
    model : Model
    preset : str
    values : mapping
        Values in the study by parameter.
    record : mapping
        Unit and text by recorded metric.
    profiles : tuple of str
        Names of the recorded profiles.
    points, trials : int
        Numbers of points and of trials.
    replicates : str
        Number of trials per point, in words.
    growth : str
        Condition on which trials or points are added, in words; "" for a stored study,
        or if none are added.
    seeds : str
        Origin of the random numbers, in words.
    streams : mapping
        "common" or "independent" by purpose of the random numbers.
    spec : str
        Text of the spec.
    searches : bool
        True for a search, which chooses points during the run.
    continued : str
        Axis along which trials are links of chains, "" without chains.
    directions : sequence of str
        Directions of the chains, one after the other.
    code : bool
        True if the functions of the model are loaded.
    every : int
        Number of steps between frames.
    """

    name: str
    catalogue: Catalogue
    model: Model
    preset: str
    values: Mapping[str, Sequence[Value]]
    record: Mapping[str, tuple[str, str]]
    profiles: tuple[str, ...]
    points: int
    trials: int
    replicates: str
    growth: str
    seeds: str
    streams: Mapping[str, str]
    spec: str
    searches: bool
    continued: str
    directions: Sequence[str]
    code: bool
    every: int

    @property
    def document(self) -> Document:
        """The spec as a document."""
        return Document(Path("spec"), self.spec)

    @property
    def settings(self) -> dict[str, Setting]:
        """All parameters of the model, by name."""
        return settings_of(self.model.name, self.catalogue)


def of_spec(study: Study, design: Design) -> StudyFacts:
    """Return the facts of a spec."""
    columns = {name: _distinct(column) for name, column in design.columns.items()}
    values: dict[str, list[Value]] = {
        name: [value] for name, value in design.base.items()
    }
    searched: dict[str, list[Value]] = {
        name: [SEARCHED] for name in values if name in study.section_values
    }
    most = "at most " if study.rule else ""
    axis = study.continued
    return StudyFacts(
        name=study.name,
        catalogue=study.catalogue,
        model=study.catalogue.models[study.model],
        preset=study.preset,
        values=values | columns | searched,
        record=_recorded(study),
        profiles=study.record.profile_names,
        points=design.n_points,
        trials=study.most_trials(design.n_points),
        replicates=f"{most}{study.trials_per_point:,}",
        growth=study.rule.in_words if study.rule else "",
        seeds=f"the seeds {', '.join(map(str, study.seeds))}"
        if study.seeds
        else f"made from the seed {study.seed}",
        streams={key.field: getattr(study.streams, key.field) for key in STREAMS},
        spec=study.text,
        searches=not study.has_design,
        continued=axis.name if axis else "",
        directions=axis.continued.directions if axis and axis.continued else (),
        code=True,
        every=study.record.every,
    )


def of_stored(study: StoredStudy) -> StudyFacts:
    """Return the facts of a stored study.

    Custom code of the study is used if it may run. Raises ChoiceError if no trial is
    stored.
    """
    trials = study.trials
    if not len(trials):
        raise ChoiceError("no trials are stored", study.name)
    try:
        catalogue = study.running(study.provenance)
        code = True
    except (CodeError, StoreError):  # frames of a recording may be elsewhere
        catalogue = study.known
        code = False
    first = trials.iloc[0]
    counts = trials.groupby("point").size()
    listed = sorted(trials["seed"].unique().tolist())
    streams = [word.partition("=")[::2] for word in str(first["streams"]).split()]
    chained = study.about.continued or {}
    return StudyFacts(
        name=study.name,
        catalogue=catalogue,
        model=catalogue.models[str(first["model"])],
        preset=str(first["preset"]),
        values={
            name: _distinct(trials[name].to_numpy())
            for name in study.settings
            if name in trials
        },
        record=_stored_record(study),
        profiles=_stored_profiles(study),
        points=len(study.points),
        trials=study.plan.num_rows,
        replicates=_span([int(counts.min()), int(counts.max())]),
        growth="",
        seeds=f"the seeds {', '.join(map(str, listed))}"
        if first["seed_listed"]
        else f"made from the seed {', '.join(map(str, listed))}",
        streams=dict(streams),
        spec=study.spec,
        searches=keep_apart(study).split is not None,
        continued=chained.get("axis", ""),
        directions=chained.get("directions", ()),
        code=code,
        every=int(first["every"]),
    )


def odd(facts: StudyFacts) -> str:
    """Return the description in Markdown: seven elements, the experiment, and the gaps.

    Examples
    --------
    >>> import sweep
    >>> print(odd(of_stored(sweep.load("my/first"))))
    # ODD of the study my/first
    ...
    """
    page = _Page(facts)
    page.write()
    return page.text()


@dataclass
class _Page:
    facts: StudyFacts
    lines: list[str] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)

    def text(self) -> str:
        """Return the page in Markdown."""
        return "\n".join(self.lines) + "\n"

    def write(self) -> None:
        """Write all sections of the page."""
        facts = self.facts
        is_recording = bool(facts.model.events)
        version = program().version
        if is_recording:
            self.heading(1, f"Data of the study {facts.name}")
            self.say(
                f"The recording of the study, described by boidsweep {version} from the"
                " spec and the files. A recording has no model, so the page has no"
                " elements of ODD."
            )
        else:
            self.heading(1, f"ODD of the study {facts.name}")
            self.say(
                f"The model {facts.model.name}, described after Grimm et al. (2020) by"
                f" boidsweep {version} from the declarations of the code and the spec."
            )
        elements = OF_RECORDING if is_recording else ELEMENTS
        for number, (title, write) in enumerate(elements.items(), 1):
            self.heading(2, f"{number}. {title}")
            write(self)
        self.heading(2, "The experiment")
        _experiment(self)
        self.heading(2, "References")
        source = behind(facts.model.name, facts.catalogue).as_text()
        self.list([source] if is_recording else [PROTOCOL, source])
        self.heading(2, "Gaps")
        self.list(self.gaps or ["none"])

    def heading(self, level: int, text: str) -> None:
        """Add a heading.

        Parameters
        ----------
        level : int
            1 for the title of the page.
        text : str
        """
        before = [""] if self.lines and self.lines[-1] else []
        self.lines += [*before, f"{'#' * level} {text}", ""]

    def say(self, text: str) -> None:
        """Add a paragraph."""
        self.lines += [*([""] if self.lines and self.lines[-1] else []), text]

    def gap(self, missing: str) -> None:
        """Add a gap: a text that is missing."""
        self.say(f"*not stated: {missing}*")
        self.gaps.append(missing)

    def either(self, text: str | None, missing: str) -> None:
        """Add a paragraph, or a gap without a text.

        Parameters
        ----------
        text : str or None
        missing : str
            Text of the gap.
        """
        if text:
            self.say(text)
        else:
            self.gap(missing)

    def list(self, items: Iterable[str]) -> None:
        """Add a list."""
        self.lines += [
            *([""] if self.lines[-1] else []),
            *(f"- {item}" for item in items),
        ]

    def numbered(self, items: Iterable[str]) -> None:
        """Add a numbered list."""
        self.lines += [
            *([""] if self.lines[-1] else []),
            *(f"{number}. {item}" for number, item in enumerate(items, 1)),
        ]

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        """Add a table.

        Parameters
        ----------
        heads : sequence of str
            Titles of the columns.
        rows : iterable of sequence of str
            Cells of each row.
        """
        cells = [heads, ["---"] * len(heads), *rows]
        lines = ["| " + " | ".join(map(_cell, row)) + " |" for row in cells]
        self.lines += [*([""] if self.lines[-1] else []), *lines]


def _purpose(page: _Page) -> None:
    model = page.facts.model
    document = bibliography_of(model.name)
    if document:
        page.say(f"The model of: {document.title}. {document.source}.")
    else:
        source = f"Source of the model: {model.source}." if model.source else None
        page.either(source, f"who described the model {model.name}, and where")
    page.either(_module_text(page.facts), f"what the model {model.name} is for")
    comment = page.facts.document.comment
    page.either(
        f"The spec of the study begins: {comment}" if comment else None,
        "the purpose of this study, and the research question: write both in a comment"
        " at the beginning of the spec",
    )
    page.gap(
        "patterns by which the model is judged fit for the purpose; Observation lists"
        " the recorded metrics"
    )


def _entities(page: _Page) -> None:
    facts = page.facts
    model = facts.model
    kinds = f", of the kinds {', '.join(model.kinds)}" if model.kinds else ""
    obstacles = "Obstacles are discs, rectangles and polygons."
    page.say(
        f"The entities are boids{kinds}, in a world of two dimensions. {obstacles}"
    )
    rows = [
        ("x, y", spelled("length", model), "position"),
        ("vx, vy", spelled("length/time", model), "velocity"),
    ]
    rows += [
        (name, spelled(column.unit, model), column.text)
        for name, column in model.state.items()
    ]
    page.table(("state of a boid", "unit", "meaning"), rows)
    page.say(
        f"Lengths are in {model.length}, times in {model.time}. A step is one update of"
        " all boids."
    )
    if not {model.length, model.time} <= EXPLAINED_UNITS:
        page.gap(
            f"the length of 1 {model.length} and the duration of 1 {model.time} in the"
            " described system"
        )
    for group, title in GROUPS.items():
        shown = [
            setting
            for setting in facts.settings.values()
            if setting.group == group and not _is_off(facts, setting)
        ]
        if not shown:
            continue
        page.heading(3, title)
        page.table(
            ("parameter", "symbol", "value", "unit", "allowed", "meaning"),
            [
                (
                    setting.name,
                    f"${setting.symbol}$" if setting.symbol else "",
                    _values(facts, setting.name),
                    setting.unit,
                    _allowed(setting),
                    setting.text,
                )
                for setting in shown
            ],
        )
    every = facts.settings.values()
    off = [setting.name for setting in every if _is_off(facts, setting)]
    if off:
        page.say(
            "These parameters are off, or have no effect on any trial:"
            f" {', '.join(off)}."
        )


def _is_off(facts: StudyFacts, setting: Setting) -> bool:
    """Return whether a parameter has no effect in any trial."""
    values = list(facts.values.get(setting.name, ()))
    if setting.spread_of:
        return values == [0.0]
    if setting.group == "observation":
        metrics = filter(None, map(facts.catalogue.metrics.get, facts.record))
        return not any(setting.name in metric.parameters for metric in metrics)
    if setting.only_where:
        return not _can_hold(facts, setting.only_where.condition)
    neutral = COMMON.get(setting.name)
    is_amount = setting.low == 0.0 or setting.kind == "places"
    may_be_off = setting.group in MAY_BE_OFF or (is_amount and not neutral)
    return may_be_off and values == [neutral]


def _can_hold(facts: StudyFacts, condition: str) -> bool:
    """Return whether a condition can hold for values of the parameters in the study.

    Values are combined freely, so a condition of several varied parameters may hold in
    none of the trials.
    """
    expression = parse(condition, facts.settings)
    names = sorted(expression.names)
    values = [facts.values[name] for name in names]
    if any(SEARCHED in some for some in values):
        return True
    combined = list(islice(product(*values), MOST_COMBINED))
    if len(combined) == MOST_COMBINED:
        return True
    columns = {
        name: np.array(column)
        for name, column in zip(names, zip(*combined, strict=True), strict=True)
    }
    return bool(expression.evaluate(columns, len(combined)).any())


def _process(page: _Page) -> None:
    facts = page.facts
    model = facts.model
    page.say(
        "A trial draws the world and the initial condition, and then runs `steps` steps"
        " of the duration `dt`. The parts of a step are, in this order:"
    )
    page.numbered(_schedule(facts))
    declared = _own_settings(model).items()
    updates = [name for name, declaration in declared if declaration == UPDATE]
    for name in updates:
        page.say(f"The parameter {name} sets the order: {_values(facts, name)}.")
    if model.update_order:
        page.say(f"Order of updates: {model.update_order}.")
    elif not updates:
        page.gap(
            "whether boids are updated one after the other or all at once: the model"
            " has neither such a parameter nor an update_order; see the step below"
        )
    if facts.model.equations:
        page.say("A step is defined by the equations of the submodels below.")
        return
    if not facts.code:
        page.gap("the course of a step: the custom code of the model was not loaded")
        return
    page.either(_text(model.advance), "a description of the step, in words")
    called = _called(model.advance)
    if called:
        page.say("A step calls the following functions, in the order of the code:")
        page.list(
            f"`{name}`: {_first(_text(function))}" for name, function in called.items()
        )


def _schedule(facts: StudyFacts) -> Iterator[str]:
    """Return the parts of a step that have an effect, in the order of `advance`."""
    on = {
        setting.group
        for setting in facts.settings.values()
        if not _is_off(facts, setting)
    }
    if "medium" in on:
        yield "The wind carries all boids. The boundary condition `borders` applies."
    if "sensing" in on:
        yield (
            "Each boid perceives other boids, as the parameters of"
            f' "{GROUPS["sensing"]}" state.'
        )
    if not _is_off(facts, facts.settings["obstacle_speed"]):
        yield "All obstacles move."
    yield "Each boid gets a commanded velocity by the submodels below."
    limits = [group for group in ("actuation", "failures") if group in on]
    if limits:
        yield f"The {' and '.join(limits)} of the boid change the commanded velocity."
    yield "Each boid moves, and the boundary condition `borders` applies."
    yield f"A frame is recorded {_frames(facts)}."


def _concepts(page: _Page) -> None:
    for title, write in CONCEPTS.items():
        page.heading(3, title)
        write(page)


def _basic_principles(page: _Page) -> None:
    rules = page.facts.model.rules
    if rules:
        page.say("Boids steer by rules with weights; a weight of 0 disables a rule.")
        page.table(
            ("rule", "weight", "value", "to the goal"),
            [
                (
                    rule.name,
                    rule.weight,
                    _values(page.facts, rule.weight),
                    _yes(rule.to_goal),
                )
                for rule in rules
            ],
        )
    else:
        page.gap("the rules by which boids steer: no parameter is the weight of a rule")


def _objectives(page: _Page) -> None:
    rules = [rule.name for rule in page.facts.model.rules if rule.to_goal]
    if rules:
        goal = [_values(page.facts, name) for name in ("goal_x", "goal_y")]
        page.say(f"Boids go to the goal at ({', '.join(goal)}) by {', '.join(rules)}.")
        if later := _values(page.facts, "next_goals"):
            page.say(f"Further goals follow, one after the other: {later}.")
    else:
        page.say("No rule leads boids to a goal.")
    page.gap("objectives of boids in addition to the rules")


def _sensing(page: _Page) -> None:
    facts = page.facts
    model = facts.model
    if model.equations:
        page.say("The submodels below define the perceived neighbours of a boid.")
    elif facts.code:
        page.either(_text(model.sight), "the perceived neighbours of a boid, in words")
    else:
        page.gap(
            "the perceived neighbours of a boid: the custom code of the model was not"
            " loaded"
        )
    looks = "in its last direction of motion" if model.faces_heading else "all round"
    page.say(f"A boid at rest looks {looks}.")


def _interaction(page: _Page) -> None:
    if not page.facts.code:
        page.gap(
            "how boids act on each other: the custom code of the model was not loaded"
        )
        return
    page.say("The submodels below define how boids and obstacles act on boids.")


def _stochasticity(page: _Page) -> None:
    facts = page.facts
    page.say(
        f"Random numbers are {facts.seeds}. `common` means equal random numbers at all"
        " points, `independent` different random numbers at each point."
    )
    page.table(
        ("stream", "numbers", "drawn quantities"),
        [(key.name, facts.streams.get(key.field, ""), key.text) for key in STREAMS],
    )


def _collectives(page: _Page) -> None:
    page.say(
        "Flocks are detected for metrics only: boids closer than flock_range"
        f" ({_values(page.facts, 'flock_range')}) belong to one flock."
    )
    page.gap("whether flocks act on boids in a way that is not in the submodels")


def _observation(page: _Page) -> None:
    facts = page.facts
    rows = []
    for name, (unit, text) in facts.record.items():
        metric = facts.catalogue.metrics.get(name)
        source = metric.source if metric else "computed by the spec from metrics"
        rows.append((name, unit, text, source))
    page.table(("metric", "unit", "meaning", "source"), rows)
    page.say(
        f"Metrics are computed at step 0 and {_frames(facts)}. Each trial gives the"
        f" value at the last step, and the mean over {averaged_frames(facts.model)}."
    )
    if not facts.profiles:
        return
    page.table(
        ("profile", "axis", "unit", "meaning", "source"),
        [
            (
                name,
                profile.axis,
                spelled(profile.unit, facts.model),
                profile.text,
                profile.source,
            )
            for name in facts.profiles
            if (profile := facts.catalogue.profiles.get(name))
        ],
    )
    page.say(
        "A profile has values along its axis, from the frames of"
        f" {averaged_frames(facts.model)}."
    )


def _frames(facts: StudyFacts) -> str:
    """Return the steps of the frames in words."""
    if facts.every == 1:
        return "at each step"
    return f"every {facts.every} steps, and at the last step"


def _stated_nowhere(missing: str) -> Callable[[_Page], None]:
    return lambda page: page.gap(missing)


def _initialization(page: _Page) -> None:
    facts = page.facts
    for name in _texts(facts, "start_draws"):
        start = facts.catalogue.starts[name]
        page.say(f"Initial condition `{name}`: {start.text} ({start.source}).")
    for name in _texts(facts, "map"):
        declared = facts.catalogue.maps.get(name)
        if declared:
            drawn = " Every trial draws a new map." if declared.random else ""
            page.say(f"Map `{name}`: {declared.text} ({declared.source}).{drawn}")
        else:
            page.say(f"Map `{name}`: defined in the spec.")
    if facts.model.begin_state:
        text = _text(facts.model.begin_state) if facts.code else None
        page.either(text, "the initial state of boids")
    page.say("The values of the parameters of the initial condition are listed above.")


def _input_data(page: _Page) -> None:
    page.say("A trial reads no input data: parameters and map define the trial.")


def _submodels(page: _Page) -> None:
    facts = page.facts
    if facts.model.equations:
        page.say(facts.model.equations.strip())
        return
    if not facts.code:
        page.gap("the submodels: the custom code of the model was not loaded")
        return
    called = _called(facts.model.advance)
    for name, function in called.items():
        page.heading(3, f"`{name}` ({function.__module__})")
        page.either(_text(function), f"a description of `{name}`")
    if not called:
        page.gap("the submodels: the step of the model calls no named function")


def _data(page: _Page) -> None:
    model = page.facts.model
    source = f"Source of the data: {model.source}." if model.source else None
    page.either(source, "the source of the data: write it under `source`")
    comment = page.facts.document.comment
    page.either(
        f"The spec of the study begins: {comment}" if comment else None,
        "the purpose of this study: write it in a comment at the beginning of the spec",
    )
    page.gap("how individuals were tracked, and the error of a position")
    rows = [
        (
            event.name,
            f"{event.boids}",
            *(f"{count}" for count in event.kinds),
            f"{event.steps + 1:,}",
            f"{100 * event.interpolated:.2g} %",
            f"{100 * event.absent:.2g} %",
            event.sha[:SHA_DIGITS],
        )
        for event in model.events[:MOST_EVENTS]
    ]
    heads = ("event", "individuals", *model.kinds, "frames", "interpolated", "absent")
    page.table((*heads, "sha256"), rows)
    if (more := len(model.events) - MOST_EVENTS) > 0:
        page.say(f"{so_many(more, 'further event')} not listed.")


def _from_rows(page: _Page) -> None:
    root = parse_document(page.facts.spec, Path("spec"))
    spec = read_section(RecordingSpec, root.child(RECORDING))
    length = page.facts.model.length
    gaps = (
        "Positions are interpolated linearly between two rows at most"
        f" {spec.gaps:g} {spec.time} apart."
        if spec.gaps
        else "No positions are interpolated."
    )
    velocities = {
        "given": "Velocities are those of the files.",
        "central": "Velocities are central differences, one-sided at the ends.",
        "backward": "Velocities are backward differences.",
    }
    lengths = (
        "distances in an azimuthal equidistant projection around the first position, in"
        " m,"
        if spec.coordinates == "degrees"
        else "lengths in the files"
    )
    smoothing = (
        "Positions are smoothed by moving parabolas (Savitzky-Golay) over"
        f" {spec.smoothing:g} {spec.time}."
        if spec.smoothing
        else "Nothing is smoothed."
    )
    kinds = [
        f"Individuals of the kinds {', '.join(spec.kinds)} are read, and no others."
        for _ in spec.kinds[:1]
    ]
    page.list(
        [
            f"A frame follows the previous frame after {spec.time_step:g} {spec.time}.",
            f"Lengths are in {length}: {lengths} times {spec.scale:g}.",
            f"{gaps} Beyond a gap an individual is absent, and metrics leave it out.",
            f"{smoothing} {velocities[spec.velocities]}",
            *kinds,
        ]
    )


def _recorded_world(page: _Page) -> None:
    facts = page.facts
    names = ("map", "width", "height", "borders")
    page.table(
        ("parameter", "value", "unit"),
        [(name, _values(facts, name), facts.settings[name].unit) for name in names],
    )


def _experiment(page: _Page) -> None:
    facts = page.facts
    varied = [name for name, values in facts.values.items() if len(values) > 1]
    if facts.searches:
        page.say(
            "The study is a search, which chooses points during the run. The spec lists"
            f" the parameters, objectives and budget. Preset {facts.preset}."
        )
    else:
        page.say(
            f"{facts.points:,} points, {facts.replicates} trials per point"
            f"{facts.growth}, {facts.trials:,} trials in total. Preset {facts.preset}."
        )
    if varied:
        page.table(
            ("varied parameter", "values"),
            [(name, _values(facts, name)) for name in varied],
        )
    if facts.continued:
        page.say(
            f"Trials along {facts.continued} are links of chains, one chain per"
            f" replicate, {' and then '.join(facts.directions)}. The first link begins"
            " as stated under Initialization. Each further link begins with the last"
            " positions, velocities and states of the previous link."
        )
    page.say("The spec:")
    spec = "\n".join(facts.document.for_readers).strip()
    page.lines += ["", *(f"    {line}" for line in spec.splitlines())]


ELEMENTS: Mapping[str, Callable[[_Page], None]] = {
    "Purpose and patterns": _purpose,
    "Entities, state variables and scales": _entities,
    "Process overview and scheduling": _process,
    "Design concepts": _concepts,
    "Initialization": _initialization,
    "Input data": _input_data,
    "Submodels": _submodels,
}
"""Functions that write the elements of ODD, in the order of ODD."""
OF_RECORDING: Mapping[str, Callable[[_Page], None]] = {
    "Data": _data,
    "From rows to frames": _from_rows,
    "World": _recorded_world,
    "Observation": _observation,
}
"""Functions that describe a recording."""
CONCEPTS: Mapping[str, Callable[[_Page], None]] = {
    "Basic principles": _basic_principles,
    "Emergence": _stated_nowhere("results that emerge, and results that rules impose"),
    "Adaptation": _stated_nowhere("how boids adapt, in addition to the rules"),
    "Objectives": _objectives,
    "Learning": _stated_nowhere("whether boids learn"),
    "Prediction": _stated_nowhere("whether boids predict"),
    "Sensing": _sensing,
    "Interaction": _interaction,
    "Stochasticity": _stochasticity,
    "Collectives": _collectives,
    "Observation": _observation,
}
"""Functions that write the design concepts of ODD, in the order of ODD."""


def _recorded(study: Study) -> dict[str, tuple[str, str]]:
    model = study.catalogue.models[study.model]
    metrics = study.catalogue.metrics
    measured = {
        name: (spelled(metrics[name].unit, model), metrics[name].text)
        for name in study.record.metrics
    }
    return measured | {
        derived.name: (derived.unit, derived.expression.text)
        for derived in study.record.derive
    }


def _stored_record(study: StoredStudy) -> dict[str, tuple[str, str]]:
    columns = study.columns.query("table == 'trials'").set_index("column")
    rows = {name: columns.loc[name] for name in study.metrics if name in columns.index}
    return {
        name: (str(row["unit"]), str(row["text"]).removesuffix(", at the last frame"))
        for name, row in rows.items()
    }


def _stored_profiles(study: StoredStudy) -> tuple[str, ...]:
    columns = study.columns.query("table == 'profiles'")["column"].tolist()
    return tuple(name for name in columns if f"{name}{AT}" in columns)


def _own_settings(model: Model) -> dict[str, About]:
    hints = get_type_hints(model.params, include_extras=True)
    return {name: get_args(hint)[1] for name, hint in hints.items()}


def _called(function: Any) -> dict[str, Any]:
    """Return the functions that a function calls, by name in the module.

    The functions are in the order of the code. A function of the module of `function`
    is followed by the functions that it calls.
    """
    functions = dict[str, Any]()
    _add_called(_plain(function), functions)
    return functions


def _add_called(plain: Any, functions: dict[str, Any]) -> None:
    for name in plain.__code__.co_names:
        function = plain.__globals__.get(name)
        if name not in functions and inspect.isfunction(_plain(function)):
            functions[name] = function
            if function.__module__ == plain.__module__:
                _add_called(_plain(function), functions)


def _plain(function: Any) -> Any:
    """Return the Python function that numba has compiled; other objects unchanged."""
    return getattr(function, "py_func", function)


def _text(function: Any) -> str | None:
    """Return the description of a function, None without one."""
    return description_of(_plain(function)) or None


def _first(text: str | None) -> str:
    """Return the first paragraph of a docstring, in one line."""
    return " ".join((text or "not stated").split("\n\n")[0].split())


def _module_text(facts: StudyFacts) -> str | None:
    """Return the first paragraph of the docstring of the module of the model."""
    module = inspect.getmodule(_plain(facts.model.advance)) if facts.code else None
    text = inspect.getdoc(module) if module else None
    return _first(text) if text else None


def _distinct(values: Any) -> list[Value]:
    return list(dict.fromkeys(values.tolist()))


def _texts(facts: StudyFacts, setting: str) -> Iterator[str]:
    yield from (str(value) for value in facts.values.get(setting, ()))


def _values(facts: StudyFacts, setting: str) -> str:
    values = facts.values.get(setting, [])
    if len(values) > MOST_VALUES and all(
        isinstance(value, float | int) for value in values
    ):
        numbers = [float(value) for value in values]
        return f"{len(values):,} values from {min(numbers):g} to {max(numbers):g}"
    return ", ".join(
        f"{value:g}" if isinstance(value, float) else str(value) for value in values
    )


def _span(counts: Sequence[int]) -> str:
    low = min(counts)
    high = max(counts)
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def _allowed(setting: Setting) -> str:
    return setting.allowed().removesuffix(f" ({setting.unit})")


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _cell(text: str) -> str:
    return " ".join(text.replace("|", r"\|").split())
