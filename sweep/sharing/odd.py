"""An ODD description of a model and a study: overview, design concepts, details.

Its elements are those of Grimm et al. 2020, Journal of Artificial Societies and Social
Simulation 23(2), 7. All of it comes from what a model, a metric, a map, a start and a
spec say of themselves, and from the docstrings of functions. What is said nowhere is
printed as a gap, "not stated", and listed at the end: it is for an author to fill in.
"""

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args, get_type_hints

from kernels.catalogue import Catalogue
from kernels.model import Model
from kernels.settings import UPDATE, About
from sweep.design.design import Design
from sweep.errors import ChoiceError, CodeError
from sweep.published.bibliography import bibliography_of
from sweep.sharing.citing import program
from sweep.spec.document import Document
from sweep.spec.keys import keys_of
from sweep.spec.settings import Setting, Value, settings_of, spelled
from sweep.spec.study import Streams, Study
from sweep.tables.stored_study import StoredStudy

MOST_VALUES = 8
"""Values of a setting that are listed; of more the range is."""
GROUPS = {
    "parameters": "Settings of the model",
    "schedule": "Extent",
    "world": "World",
    "sensing": "With whom boids interact, and what they know",
    "actuation": "How boids follow their model",
    "failures": "Which boids fail",
    "medium": "How the medium moves",
    "start": "Start",
    "observation": "Observation",
}
STREAMS = keys_of(Streams)
SEARCHED = "searched"
"""In the place of the value of a setting."""


@dataclass(frozen=True)
class StudyFacts:
    """What is described, of a spec or of a stored study.

    values      the values of each setting in the study
    record      unit and text of each recorded metric
    replicates  in words, how many trials a point has
    seeds       in words, where their random numbers come from
    streams     by purpose, whether points have random numbers in common
    searches    whether it is a search, which decides as it runs which points it has
    continued   the axis along which trials are links of chains, "" without one
    directions  those of its chains, one after the other
    code        whether the functions of the model are at hand
    """

    name: str
    known: Catalogue
    model: Model
    preset: str
    values: Mapping[str, Sequence[Value]]
    record: Mapping[str, tuple[str, str]]
    points: int
    trials: int
    replicates: str
    seeds: str
    streams: Mapping[str, str]
    spec: str
    searches: bool
    continued: str
    directions: Sequence[str]
    code: bool

    @property
    def document(self) -> Document:
        """The text of its spec."""
        return Document(Path("spec"), self.spec)

    @property
    def settings(self) -> dict[str, Setting]:
        """Every setting of the model."""
        return settings_of(self.model.name, self.known)


def of_spec(study: Study, design: Design) -> StudyFacts:
    """What a spec describes."""
    columns = {name: _distinct(one) for name, one in design.columns.items()}
    values: dict[str, list[Value]] = {
        name: [value] for name, value in design.base.items()
    }
    searched: dict[str, list[Value]] = {
        name: [SEARCHED] for name in values if _is_searched(study, name)
    }
    most = "at most " if study.rule else ""
    axis = study.continued
    return StudyFacts(
        name=study.name,
        known=study.known,
        model=study.known.models[study.model],
        preset=study.preset,
        values=values | columns | searched,
        record=_recorded(study),
        points=design.n_points,
        trials=study.most_trials(design.n_points),
        replicates=f"{most}{study.trials_per_point:,}",
        seeds=f"the seeds {', '.join(map(str, study.seeds))}"
        if study.seeds
        else f"made from the seed {study.seed}",
        streams={key.field: getattr(study.streams, key.field) for key in STREAMS},
        spec=study.text,
        searches=study.search is not None,
        continued=axis.name if axis else "",
        directions=axis.continued.directions if axis and axis.continued else (),
        code=True,
    )


def of_stored(study: StoredStudy) -> StudyFacts:
    """What a stored study describes. Its own code is used if it may run. Raises
    ChoiceError where no trial is stored.
    """
    if not len(study.trials):
        raise ChoiceError("no trials of it are stored", study.name)
    try:
        known, code = study.running(study.provenance), True
    except CodeError:
        known, code = study.known, False
    trials, first = study.trials, study.trials.iloc[0]
    counts = trials.groupby("point").size()
    listed = sorted(trials["seed"].unique().tolist())
    words = [word.partition("=")[::2] for word in str(first["streams"]).split()]
    chained = study.about.continued or {}
    return StudyFacts(
        name=study.name,
        known=known,
        model=known.models[str(first["model"])],
        preset=str(first["preset"]),
        values={
            name: _distinct(trials[name].to_numpy())
            for name in study.settings
            if name in trials
        },
        record=_stored_record(study),
        points=len(study.points),
        trials=study.plan.num_rows,
        replicates=_span([int(counts.min()), int(counts.max())]),
        seeds=f"the seeds {', '.join(map(str, listed))}"
        if first["seed_listed"]
        else f"made from the seed {', '.join(map(str, listed))}",
        streams=dict(words),
        spec=study.spec,
        searches=study.store.read_asked() is not None,
        continued=chained.get("axis", ""),
        directions=chained.get("directions", ()),
        code=code,
    )


def odd(about: StudyFacts) -> str:
    """The description in Markdown: seven elements, the experiment, and the gaps."""
    page = _Page(about)
    page.write()
    return page.text()


@dataclass
class _Page:
    about: StudyFacts
    lines: list[str] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)

    def text(self) -> str:
        return "\n".join(self.lines) + "\n"

    def write(self) -> None:
        about = self.about
        self.heading(1, f"ODD of the study {about.name}")
        self.say(
            f"The model {about.model.name}, described after Grimm et al. (2020) by"
            f" boidsweep {program().version} from what its code and the spec say of"
            " themselves."
        )
        for number, (title, write) in enumerate(ELEMENTS.items(), 1):
            self.heading(2, f"{number}. {title}")
            write(self)
        self.heading(2, "The experiment")
        _experiment(self)
        self.heading(2, "Gaps")
        self.list(self.gaps or ["none"])

    def heading(self, level: int, text: str) -> None:
        """A heading."""
        before = [""] if self.lines and self.lines[-1] else []
        self.lines += [*before, f"{'#' * level} {text}", ""]

    def say(self, text: str) -> None:
        """A paragraph."""
        self.lines += [*([""] if self.lines and self.lines[-1] else []), text]

    def gap(self, what: str) -> None:
        """Something that is said nowhere."""
        self.say(f"*not stated: {what}*")
        self.gaps.append(what)

    def either(self, text: str | None, what: str) -> None:
        """A paragraph, or a gap where there is none."""
        if text:
            self.say(text)
        else:
            self.gap(what)

    def list(self, items: Iterable[str]) -> None:
        """A list."""
        self.lines += [
            *([""] if self.lines[-1] else []),
            *(f"- {one}" for one in items),
        ]

    def table(self, heads: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
        """A table."""
        cells = [heads, ["---"] * len(heads), *rows]
        lines = ["| " + " | ".join(map(_cell, row)) + " |" for row in cells]
        self.lines += [*([""] if self.lines[-1] else []), *lines]


def _purpose(page: _Page) -> None:
    model = page.about.model
    document = bibliography_of(model.name)
    if document:
        page.say(f"The model of: {document.title}. {document.source}.")
    else:
        source = f"Source of the model: {model.source}." if model.source else None
        page.either(source, f"who described the model {model.name}, and where")
    page.either(_module_text(page.about), f"what the model {model.name} is for")
    said = page.about.document.comment
    page.either(
        f"The spec of the study begins: {said}" if said else None,
        "the purpose of this study, and the question that it answers: the spec begins"
        " with no comment that says it",
    )
    page.gap(
        "patterns by which the model is judged fit for that purpose; what is recorded"
        " stands under Observation"
    )


def _entities(page: _Page) -> None:
    about, model = page.about, page.about.model
    kinds = f", of the kinds {', '.join(model.kinds)}" if model.kinds else ""
    obstacles = "Obstacles are discs, rectangles and polygons."
    page.say(
        f"The entities are boids{kinds}, in a world of two dimensions. {obstacles}"
    )
    length, speed = spelled("length", model), spelled("length/time", model)
    rows = [("x, y", length, "position"), ("vx, vy", speed, "velocity")]
    rows += [
        (name, spelled(one.unit, model), one.text) for name, one in model.state.items()
    ]
    page.table(("state of a boid", "unit", "what it is"), rows)
    page.say(
        f"Lengths are in {model.length}, times in {model.time}. A step is one update of"
        " all boids."
    )
    for group, title in GROUPS.items():
        page.heading(3, title)
        inside = [one for one in about.settings.values() if one.group == group]
        page.table(
            ("setting", "value", "unit", "allowed", "what it is"),
            [
                (one.name, _values(about, one.name), one.unit, _allowed(one), one.text)
                for one in inside
            ],
        )


def _process(page: _Page) -> None:
    about, model = page.about, page.about.model
    found = [name for name, one in _own_settings(model).items() if one == UPDATE]
    for name in found:
        page.say(f"Order of updates ({name}): {_values(about, name)}. {UPDATE.text}.")
    if model.update_order:
        page.say(f"Order of updates: {model.update_order}.")
    elif not found:
        page.gap(
            "whether boids are updated one after the other or all at once: the model"
            " has neither a setting nor an update_order that says it; its step, below,"
            " may"
        )
    if not about.code:
        page.gap("what happens in a step: the model's own code was not loaded")
        return
    page.either(_text(model.advance), "what a step does, in words")
    called = _called(model.advance)
    if called:
        page.say("A step calls these functions, in the order in which it names them:")
        page.list(f"`{name}`: {_first(_text(one))}" for name, one in called.items())


def _concepts(page: _Page) -> None:
    for title, write in CONCEPTS.items():
        page.heading(3, title)
        write(page)


def _basic_principles(page: _Page) -> None:
    rules = page.about.model.rules
    if rules:
        page.say("Boids steer by rules, each with a weight; 0 switches it off.")
        page.table(
            ("rule", "weight", "value", "to the goal"),
            [
                (
                    one.name,
                    one.weight,
                    _values(page.about, one.weight),
                    _yes(one.to_goal),
                )
                for one in rules
            ],
        )
    else:
        page.gap("the rules by which boids steer: no setting is the weight of one")


def _objectives(page: _Page) -> None:
    goal = [one.name for one in page.about.model.rules if one.to_goal]
    if goal:
        place = [_values(page.about, name) for name in ("goal_x", "goal_y")]
        page.say(f"Boids go to the goal at ({', '.join(place)}) by {', '.join(goal)}.")
        if later := _values(page.about, "next_goals"):
            page.say(f"From there they go on to {later}, one after the other.")
    else:
        page.say("No rule leads boids to a goal.")
    page.gap("objectives of boids besides those of the rules")


def _sensing(page: _Page) -> None:
    about, model = page.about, page.about.model
    if about.code:
        page.either(_text(model.sight), "whom boids see, in words")
    else:
        page.gap("whom boids see: the model's own code was not loaded")
    looks = "where it last flew" if model.faces_heading else "all round"
    page.say(f"A boid at rest looks {looks}.")


def _interaction(page: _Page) -> None:
    if not page.about.code:
        page.gap("how boids act on each other: the model's own code was not loaded")
        return
    page.say("Boids act on each other, and obstacles on them, by the submodels below.")


def _stochasticity(page: _Page) -> None:
    about = page.about
    page.say(
        f"Random numbers are {about.seeds}. `common` means the same numbers at every"
        " point, `independent` others at each."
    )
    page.table(
        ("stream", "numbers", "what is drawn"),
        [(key.name, about.streams.get(key.field, ""), key.text) for key in STREAMS],
    )


def _collectives(page: _Page) -> None:
    page.say(
        "Flocks are found for metrics alone: boids nearer than flock_range"
        f" ({_values(page.about, 'flock_range')}) are of one flock."
    )
    page.gap("whether flocks act on boids in another way than by the submodels")


def _observation(page: _Page) -> None:
    about = page.about
    rows = []
    for name, (unit, text) in about.record.items():
        metric = about.known.metrics.get(name)
        source = metric.source if metric else "computed from others, by the spec"
        rows.append((name, unit, text, source))
    page.table(("metric", "unit", "what it is", "source"), rows)


def _stated_nowhere(what: str) -> Callable[[_Page], None]:
    return lambda page: page.gap(what)


def _initialization(page: _Page) -> None:
    about = page.about
    for name in _texts(about, "start_draws"):
        start = about.known.starts[name]
        page.say(f"Start `{name}`: {start.text} ({start.source}).")
    for name in _texts(about, "map"):
        known = about.known.maps.get(name)
        if known:
            drawn = " Every trial draws it anew." if known.random else ""
            page.say(f"Map `{name}`: {known.text} ({known.source}).{drawn}")
        else:
            page.say(f"Map `{name}`: brought by the spec.")
    if about.model.begin_state:
        text = _text(about.model.begin_state) if about.code else None
        page.either(text, "how the state of boids begins")
    page.say("The values of the settings of the start stand above.")


def _input_data(page: _Page) -> None:
    page.say("No data is read while boids fly: all stands in the settings and the map.")


def _submodels(page: _Page) -> None:
    about = page.about
    if not about.code:
        page.gap("the submodels: the model's own code was not loaded")
        return
    called = _called(about.model.advance)
    for name, one in called.items():
        page.heading(3, f"`{name}` ({one.__module__})")
        page.either(_text(one), f"what `{name}` does")
    if not called:
        page.gap("the submodels: the step of the model calls no function of a name")


def _experiment(page: _Page) -> None:
    about = page.about
    varied = [name for name, values in about.values.items() if len(values) > 1]
    if about.searches:
        page.say(
            "It is a search, which decides as it runs which points it has. The spec"
            f" says its parameters, objectives and budget. Preset {about.preset}."
        )
    else:
        page.say(
            f"{about.points:,} points, {about.replicates} trials a point,"
            f" {about.trials:,} trials in all. Preset {about.preset}."
        )
    if varied:
        page.table(
            ("setting that varies", "values"),
            [(name, _values(about, name)) for name in varied],
        )
    if about.continued:
        page.say(
            f"Trials along {about.continued} are links of chains, a chain a replicate,"
            f" {' and then '.join(about.directions)}: the first link begins as stated"
            " under Initialization, each other one with the last positions, velocities"
            " and states of the link before it."
        )
    page.say("The spec:")
    spec = "\n".join(about.document.for_readers).strip()
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
"""Of ODD, in their order."""
CONCEPTS: Mapping[str, Callable[[_Page], None]] = {
    "Basic principles": _basic_principles,
    "Emergence": _stated_nowhere("what emerges, and what the rules impose"),
    "Adaptation": _stated_nowhere("how boids adapt, besides steering by the rules"),
    "Objectives": _objectives,
    "Learning": _stated_nowhere("whether boids learn"),
    "Prediction": _stated_nowhere("whether boids predict"),
    "Sensing": _sensing,
    "Interaction": _interaction,
    "Stochasticity": _stochasticity,
    "Collectives": _collectives,
    "Observation": _observation,
}


def _recorded(study: Study) -> dict[str, tuple[str, str]]:
    model, known = study.known.models[study.model], study.known.metrics
    measured = {
        name: (spelled(known[name].unit, model), known[name].text)
        for name in study.record.metrics
    }
    derived = study.record.derive
    return measured | {one.name: (one.unit, one.expression.text) for one in derived}


def _stored_record(study: StoredStudy) -> dict[str, tuple[str, str]]:
    columns = study.columns.query("table == 'trials'").set_index("column")
    said = {name: columns.loc[name] for name in study.metrics if name in columns.index}
    return {
        name: (str(row["unit"]), str(row["text"]).removesuffix(", at the last frame"))
        for name, row in said.items()
    }


def _is_searched(study: Study, setting: str) -> bool:
    return bool(study.search and study.search.place_of(setting))


def _own_settings(model: Model) -> dict[str, About]:
    hints = get_type_hints(model.params, include_extras=True)
    return {name: get_args(hint)[1] for name, hint in hints.items()}


def _called(function: Any) -> dict[str, Any]:
    """The functions that a function calls by a name of its module, by that name, in the
    order in which its code names them; and those that these call, if they are of the
    same module.
    """
    found = dict[str, Any]()
    _add_called(_plain(function), found)
    return found


def _add_called(plain: Any, found: dict[str, Any]) -> None:
    for name in plain.__code__.co_names:
        one = plain.__globals__.get(name)
        if name not in found and inspect.isfunction(_plain(one)):
            found[name] = one
            if one.__module__ == plain.__module__:
                _add_called(_plain(one), found)


def _plain(one: Any) -> Any:
    """The Python function that numba has compiled, or what is none of numba's."""
    return getattr(one, "py_func", one)


def _text(one: Any) -> str | None:
    """The docstring of a function."""
    return inspect.getdoc(_plain(one)) or None


def _first(text: str | None) -> str:
    """The first paragraph of a docstring, in one line."""
    return " ".join((text or "not stated").split("\n\n")[0].split())


def _module_text(about: StudyFacts) -> str | None:
    """What the module of the model says of itself first."""
    module = inspect.getmodule(_plain(about.model.advance)) if about.code else None
    found = inspect.getdoc(module) if module else None
    return _first(found) if found else None


def _distinct(values: Any) -> list[Value]:
    found: list[Value] = list(dict.fromkeys(values.tolist()))
    return found


def _texts(about: StudyFacts, setting: str) -> Iterator[str]:
    yield from (str(value) for value in about.values.get(setting, ()))


def _values(about: StudyFacts, setting: str) -> str:
    values = about.values.get(setting, [])
    if len(values) > MOST_VALUES and all(
        isinstance(one, float | int) for one in values
    ):
        numbers = [float(one) for one in values]
        return f"{len(values):,} values from {min(numbers):g} to {max(numbers):g}"
    return ", ".join(
        f"{one:g}" if isinstance(one, float) else str(one) for one in values
    )


def _span(counts: Sequence[int]) -> str:
    low, high = min(counts), max(counts)
    return f"{low:,}" if low == high else f"{low:,} to {high:,}"


def _allowed(setting: Setting) -> str:
    return setting.allowed().removesuffix(f" ({setting.unit})")


def _yes(value: bool) -> str:
    return "yes" if value else "no"


def _cell(text: str) -> str:
    return " ".join(text.replace("|", r"\|").split())
