"""The state on the screen, which is a spec.

A launch of the copied text gives bitwise identical frames. So sweep.spec.study provides
every check, every "did you mean" and every seed.
"""

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import parse_qs, urlsplit

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.metrics import METRICS
from sweep.design import SIDES, Job, Jobs, expand
from sweep.errors import SpecError
from sweep.spec import (
    MOST_BYTES,
    TORUS,
    DerivedMetric,
    Document,
    Entry,
    NotAllowedError,
    OwnMap,
    RecordSpec,
    Setting,
    Streams,
    Study,
    Value,
    dump,
    map_as_written,
    parse_spec,
    read_maps,
    settings_of,
    shape_as_written,
    spec_parts,
    usual_preset,
    usual_settings,
    written,
)
from sweep.text import closest, unknown
from sweep.web.opened import Edits, OpenedSpec, opened, opened_again

COMMON = Streams(noise="common")
ANY_METRIC = next(name for name, metric in METRICS.items() if metric.looks)
"""The metric that a copied spec records if no metric is plotted.

A spec must record a metric. Every trial can measure a metric of the bodies alone.
"""
EDITED = "edited"
"""The name of a map whose shapes were changed."""
REPLICATE = re.compile(r"\d{1,9}")
"""Number of a replicate in an address."""
MOST_BOIDS = 100_000
MOST_STORED = 10**7
"""Largest product of boids and frames of stored trajectories: 320 MB."""
MOST_PLOTS = 4
MOST_POINTS = 1000
REPLICATES = 10
"""Replicates of a copied spec with a sweep."""

Shape = Mapping[str, Mapping[str, Any]]
"""A shape in the form of a spec.

The forms are {disc: {x, y, radius}}, {rectangle: {x, y, width, height}} and
{polygon: {vertices, solid}}.
"""


class Range(NamedTuple):
    """The values of a parameter that a copied spec sweeps.

    Attributes
    ----------
    low : float
        The smallest value.
    high : float
        The largest value.
    points : int
        Number of values.
    """

    low: float
    high: float
    points: int


@dataclass(frozen=True)
class ViewState:
    """A model, a preset, changed parameters, a seed and perhaps a custom map.

    Random numbers are common to all points. So a run with another value of a parameter
    has equal noise, and a run can be extended. A spec that was not made here keeps the
    streams of the spec. All methods raise SpecError for a state that a spec would not
    accept.

    Attributes
    ----------
    model : str
        Name of the model.
    preset : str
        Name of the preset.
    seed : int, default 1
        Seed of the trial.
    fixed : mapping
        Parameters that differ from the preset, with the new values.
    own : OwnMap or None
        The custom map.
    literal : bool, default False
        Whether the seed comes from a list in the spec.
    replicate : int, default 0
        Number of the trial, unless `literal`. A copied spec also runs all earlier
        replicates.
    streams : Streams
        Random numbers that points have in common.
    plots : tuple of str
        Metrics that are plotted.
    sweeps : mapping of str to Range
        Parameters that a copied spec varies.
    derive : tuple of DerivedMetric
        Metrics that the spec computes from other metrics.
    catalogue : Catalogue
        Models, metrics and maps by name.
    opened : OpenedSpec or None
        The spec that was opened at this trial; unrelated entries stay unchanged.
    """

    model: str
    preset: str
    seed: int = 1
    fixed: Mapping[str, Value] = field(default_factory=dict)
    own: OwnMap | None = None
    literal: bool = False
    replicate: int = 0
    streams: Streams = COMMON
    plots: tuple[str, ...] = ()
    sweeps: Mapping[str, Range] = field(default_factory=dict)
    derive: tuple[DerivedMetric, ...] = ()
    catalogue: Catalogue = BUILT_IN
    opened: OpenedSpec | None = None

    @cached_property
    def job(self) -> Job:
        """The trial on the screen: `replicate` of the copied spec without a sweep."""
        plain = replace(self, sweeps={}) if self.sweeps else self
        study = _study(plain)
        job = Jobs(study, expand(study))[self.replicate]
        if int(job.settings["n"]) > MOST_BOIDS:
            raise SpecError(
                f"n: {job.settings['n']:,} boids are too many for the simulator;"
                f" use at most {MOST_BOIDS:,}"
            )
        return job

    @cached_property
    def _known_settings(self) -> dict[str, Setting]:
        return settings_of(self.model, self.catalogue).of_study(())

    @cached_property
    def _preset(self) -> dict[str, Value]:
        return usual_settings(self.model, self.preset, self.catalogue)

    @property
    def settings(self) -> dict[str, Value]:
        """The value of every parameter, and of each spread that differs from 0."""
        return self.job.settings

    @cached_property
    def follows(self) -> dict[str, list[str]]:
        """The parameters that follow from others, with the names of the others.

        A map with a size gives width and height. A spec computes the parameters under
        `derive`, unless one of these or of the others was changed.
        """
        sources: dict[str, list[str]] = {}
        if not self.own and self.catalogue.maps[str(self.settings["map"])].size:
            sources |= {side: ["map"] for side in SIDES}
        if self.opened and self.opened.study.derive:
            changed = self._differing(from_opened(self.opened)).keys()
            sources |= {
                name: sorted(expression.names)
                for name, expression in self.opened.study.derive.items()
                if changed.isdisjoint({name, *expression.names})
            }
        return sources

    def _differing(self, before: "ViewState") -> dict[str, Value]:
        """Return the parameters that differ from another state, with the new values."""
        values = self._preset | self.settings
        earlier = before._preset | before.settings
        return {name: value for name, value in values.items() if value != earlier[name]}

    @property
    def shapes(self) -> list[Shape] | None:
        """The obstacles in the form of a spec; None for a built-in map."""
        return (
            None
            if self.own is None
            else [shape_as_written(obstacle) for obstacle in self.own.obstacles]
        )

    def with_settings(self, changes: Mapping[str, object]) -> "ViewState":
        """Return the state with new values of parameters or `seed`.

        A new map brings a size, and new borders bring `minimum_image`.
        """
        changed = dict(changes)
        seed = changed.pop("seed", self.seed)
        if not isinstance(seed, int) or isinstance(seed, bool):
            raise SpecError(f"seed: {seed!r} is not allowed; use an integer from 0")
        state = replace(self, seed=seed)
        if "map" in changed and not (
            self.own and changed["map"] == self.settings["map"]
        ):
            fixed = {
                name: value for name, value in self.fixed.items() if name not in SIDES
            }
            state = replace(state, own=None, fixed=fixed)
        elif self.own and changed.keys() & set(SIDES):
            state = state._resized(
                {side: changed.pop(side, self.settings[side]) for side in SIDES}
            )
        if "borders" in changed:
            fixed = {**state.fixed}
            fixed.pop("minimum_image", None)
            state = replace(state, fixed=fixed)
        return state._fixing(changed).checked()

    def place(self, shapes: list[Shape]) -> "ViewState":
        """Return the state with these obstacles in place of all present obstacles."""
        size = {side: self.settings[side] for side in SIDES}
        if shapes:
            return replace(
                self, own=_own_map(shapes, size), fixed=self._fixed_on(EDITED)
            ).checked()
        return (
            replace(self, own=None, fixed=self._fixed_on("empty"))
            ._fixing(size)
            .checked()
        )

    def sweep(self, name: str, range_: Range | None) -> "ViewState":
        """Return the state in which the copied spec sweeps a parameter over a range.

        Parameters
        ----------
        name : str
            Name of the parameter.
        range_ : Range or None
            Values of the parameter; None ends the sweep.
        """
        if range_ is not None and not 2 <= range_.points <= MOST_POINTS:
            raise SpecError(
                f"{name}: {range_.points} points are not allowed;"
                f" use 2 to {MOST_POINTS:,}"
            )
        if name not in self._known_settings:
            raise SpecError(unknown("parameter", name, self._known_settings))
        if self.opened and not self.opened.study.has_design:
            raise SpecError(
                f"{name}: this spec takes no sweep, because it chooses trials during"
                " the run"
            )
        if self._known_settings[name].kind not in ("float", "int"):
            raise SpecError(f"{name}: a range needs a parameter with numbers")
        sweeps = {**self.sweeps}
        sweeps.pop(name, None)
        if range_:
            sweeps[name] = range_
        return replace(self, sweeps=sweeps).checked()

    def follow(self, metrics: tuple[str, ...]) -> "ViewState":
        """Return the state with these metrics plotted."""
        return replace(self, plots=metrics).checked()

    def checked(self) -> "ViewState":
        """Return this state. Raises SpecError for a state that cannot be launched."""
        _ = self.job
        if self.sweeps:
            expand(_study(self))
        return self

    def chosen(self, model: str, preset: str) -> "ViewState":
        """Return the state of another model or preset, with the present seed.

        Another preset of the present model keeps the changes and the plots.

        Parameters
        ----------
        model : str
            Name of the model.
        preset : str
            Name of a preset of the model.
        """
        other = begin(model, preset, self.seed, self.catalogue)
        changed = model == self.model and preset != self.preset
        return self.on_preset(other) if changed else other

    def at(self, point: int, replicate: int) -> "ViewState":
        """Return the state at another trial of the opened spec. Changes stay.

        Parameters
        ----------
        point : int
            Index of the point.
        replicate : int
            Number of the replicate, from 0.
        """
        return self.moved(self._known_spec.at(point, replicate))

    def having(self, name: str, value: Value) -> "ViewState":
        """Return the state at the point of the opened spec with this value.

        Parameters
        ----------
        name : str
            Parameter that varies.
        value : int, float, str or bool
            Value of the parameter.
        """
        return self.moved(self._known_spec.having(name, value))

    @property
    def _known_spec(self) -> OpenedSpec:
        if self.opened is None:
            raise SpecError("no spec is open; the page shows a single trial")
        return self.opened

    def on_preset(self, other: "ViewState") -> "ViewState":
        """Return the state of another preset with the changes of this state.

        The changes are values of parameters, the map and the plots.
        """
        changes = {
            name: value
            for name, value in self.fixed.items()
            if not (self.own and name in (*SIDES, "map"))
        }
        state = replace(other, plots=self.plots, derive=self.derive)
        state = state.place(self.shapes or []) if self.own else state
        return state.with_settings(changes)

    def moved(self, spec: OpenedSpec) -> "ViewState":
        """Return the state at another trial of the opened spec. Changes stay."""
        before = from_opened(self.opened or spec)
        target = from_opened(spec)
        redrawn = self.own != before.own
        changes = {
            name: value
            for name, value in self._differing(before).items()
            if not (redrawn and name in (*SIDES, "map"))
        }
        seed = target.seed if self.seed == before.seed else self.seed
        state = replace(target, seed=seed, plots=self.plots, sweeps=self.sweeps)
        state = state.place(self.shapes or []) if redrawn else state
        return state._fixing(changes).checked()

    def as_spec(self) -> dict[str, Any]:
        """Return the spec that launches the state, with the sweeps of the user."""
        described = self._known_settings
        values: dict[str, Any] = {
            "model": self.model,
            "preset": self.preset,
            "seed": self.seed,
        }
        if self.own:
            values["maps"] = {str(self.fixed["map"]): map_as_written(self.own)}
        if fixed := {
            name: described[name].as_entered(self.fixed[name])
            for name in described
            if name in self.fixed and name not in self.sweeps
        }:
            values["fixed"] = fixed
        if self.sweeps:
            values["sweep"] = {
                name: _axis(described[name].kind, range_)
                for name, range_ in self.sweeps.items()
            }
        if self.literal:
            values["seeds"] = (self.seed,)
        else:
            least = REPLICATES if self.sweeps else 1
            values["replicates"] = max(self.replicate + 1, least)
        if self.streams != Streams():
            values["streams"] = self.streams
        spec = written(values, *spec_parts()) | {"record": self._record()}
        digest = hashlib.sha256(json.dumps(spec, sort_keys=True).encode()).hexdigest()
        return {"study": f"view/{self.model}-{digest[:8]}"} | spec

    @property
    def study(self) -> str:
        """The name of the study: of the opened spec while its trial is shown."""
        if self.opened:
            unchanged = replace(
                from_opened(self.opened),
                plots=self.plots,
                derive=self.derive,
                sweeps=self.sweeps,
            )
            if unchanged == self:
                return self.opened.study.name
        return str(self.as_spec()["study"])

    def as_trial(self) -> dict[str, Any]:
        """Return the `yaml` of the spec, and the `point` and `replicate` that it shows.

        With a sweep of the user the point is "", because the spec has other points.

        Raises SpecError if the YAML is too long for a spec file.
        """
        return {
            "yaml": self.as_text(),
            "point": "" if self.sweeps else self.job.point,
            "replicate": self.opened.replicate if self.opened else self.replicate,
        }

    def as_text(self) -> str:
        """Return the spec as YAML: the text of the opened spec with the changes.

        Raises SpecError if the YAML is too long for a spec file.
        """
        text = self._changed(self.opened) if self.opened else dump(self._portable())
        if len(text) > MOST_BYTES:
            raise SpecError(
                f"the spec would be larger than {MOST_BYTES:,} bytes, because"
                " the map has too many shapes"
            )
        return text

    def _changed(self, opened: OpenedSpec) -> str:
        """Return the text of the opened spec, unchanged for an unchanged state."""
        before = from_opened(opened)
        if before == self:
            return opened.study.text
        described = self._known_settings
        own = self.own != before.own and self.own
        settings = {
            name: value
            for name, value in self._differing(before).items()
            if not (own and name in SIDES)
        }
        edits = Edits(
            settings=settings,
            shown=self._preset | self.settings,
            maps={str(self.fixed["map"]): map_as_written(own)} if own else {},
            sweeps={
                name: _axis(described[name].kind, range_)
                for name, range_ in self.sweeps.items()
            },
            seed=None if self.seed == before.seed else self.seed,
            record=tuple(
                name
                for name in self.plots
                if self.plots != before.plots and name not in opened.study.record.series
            ),
            written=self._as_written,
        )
        return opened.text(edits)

    def _as_written(self, name: str, value: Any) -> Any:
        """Return a value as in a spec: a file in place of the name of an entry."""
        kinds = {"map": "maps", "start_draws": "starts", "metrics": "metrics"}
        if name in kinds:
            return self.catalogue.written(kinds[name], value)
        described = self._known_settings
        return described[name].as_entered(value) if name in described else value

    def _portable(self) -> dict[str, Any]:
        """Return the spec with files in place of the names of entries."""
        spec = self.as_spec()
        fixed = spec.get("fixed", {})
        record = spec["record"]
        written = self.catalogue.written
        for kind, name in (("maps", "map"), ("starts", "start_draws")):
            if name in fixed:
                fixed = fixed | {name: written(kind, fixed[name])}
        lists = {
            name: [written("metrics", metric) for metric in record[name]]
            for name in ("metrics", "series")
            if name in record
        }
        changed = {"model": written("models", self.model), "record": record | lists}
        return spec | changed | ({"fixed": fixed} if fixed else {})

    def _record(self) -> dict[str, Any]:
        values: dict[str, Any] = {"metrics": self.plots or (ANY_METRIC,), "every": 1}
        if self.plots:
            values["series"] = self.plots
        if self.derive:
            texts = {metric.name: metric.expression.text for metric in self.derive}
            values["derive"] = texts
        settings = self._preset | dict(self.fixed)
        frames = (self.replicate + 1) * int(settings["steps"])
        if not self.sweeps and frames * int(settings["n"]) <= MOST_STORED:
            values["trajectories"] = True
        return written(values, RecordSpec)

    def _fixing(self, changes: Mapping[str, object]) -> "ViewState":
        """Return the state with new values of parameters.

        `fixed` has only values that differ from the preset, and from the effect of the
        borders.
        """
        fields = self._fields()
        fixed = dict(self.fixed)
        for name, value in changes.items():
            if name not in fields:
                listed = f'; "sweep models {self.model}" lists the parameters'
                more = "" if closest(name, fields) else listed
                raise SpecError(unknown("parameter", name, fields) + more)
            try:
                fixed[name] = fields[name].coerce(value)
            except NotAllowedError as error:
                raise SpecError(str(error)) from None
        return replace(self, fixed=_differing(fixed, self._preset))

    def _fields(self) -> dict[str, Any]:
        described = self._known_settings
        own = (str(self.fixed["map"]),) if self.own else ()
        return described | {
            "map": replace(described["map"], choices=(*described["map"].choices, *own))
        }

    def _fixed_on(self, name: str) -> dict[str, Value]:
        """Return `fixed` with the map of this name.

        A map brings a size, so no size is fixed.
        """
        fixed = {
            key: value
            for key, value in self.fixed.items()
            if key not in (*SIDES, "map")
        }
        return fixed if name == self._preset["map"] else fixed | {"map": name}

    def _resized(self, size: Mapping[str, object]) -> "ViewState":
        """Return the state with a custom map of another size and equal shapes."""
        return replace(
            self, own=_own_map(self.shapes or [], size), fixed=self._fixed_on(EDITED)
        )


def begin(
    model: str | None = None,
    preset: str | None = None,
    seed: int = 1,
    catalogue: Catalogue = BUILT_IN,
) -> ViewState:
    """Return the state that shows a preset, and plots the first metrics of the model.

    Parameters
    ----------
    model : str, optional
        Name of the model; by default the first of `catalogue`.
    preset : str, optional
        Name of the preset; by default the usual preset of the model.
    seed : int, default 1
        Seed of the trial.
    catalogue : Catalogue, optional
        Models, metrics and maps by name; by default the built-in ones.

    Raises
    ------
    SpecError
        If the model or the preset is unknown.
    """
    model = model or next(iter(catalogue.models))
    if model not in catalogue.models:
        raise SpecError(unknown("model", model, catalogue.models))
    chosen = catalogue.models[model]
    preset = preset or usual_preset(chosen)
    if preset not in chosen.presets:
        raise SpecError(unknown(f"preset of {model}", preset, chosen.presets))
    plots = chosen.metrics[:MOST_PLOTS]
    return ViewState(model, preset, seed, plots=plots, catalogue=catalogue).checked()


def from_study(study: Study) -> ViewState:
    """Return the state that shows the first trial of a study."""
    return from_opened(opened(study))


def from_opened(spec: OpenedSpec) -> ViewState:
    """Return the state that shows a trial of an opened spec."""
    return replace(from_job(spec.job), opened=spec)


def from_link(link: str) -> ViewState:
    """Return the state in the address of "Copy as link" of a simulator.

    A link never names code: its spec has built-in models, metrics and maps.

    Parameters
    ----------
    link : str
        The address of any server; the part that follows # has the state.

    Raises
    ------
    SpecError
        If the address has no spec, or the spec is not valid.
    """
    try:
        state = parse_qs(urlsplit(link).fragment)
    except ValueError as error:
        raise SpecError(f"the address cannot be read: {error}") from error
    yaml = state.get("spec", [""])[0]
    point = state.get("point", [""])[0]
    replicate = state.get("replicate", ["0"])[0]
    if not yaml or not REPLICATE.fullmatch(replicate):
        raise SpecError(
            "the address has no spec, or no number of a replicate; allowed: an address"
            " of Copy as link, http://...#spec=...&point=...&replicate=..."
        )
    place = Path("link.yaml")
    return from_opened(
        opened_again(yaml, point, int(replicate), catalogue=BUILT_IN, path=place)
    )


def from_job(job: Job) -> ViewState:
    """Return the state of a stored trial, with its random numbers and first metrics."""
    preset = usual_settings(job.model, job.preset, job.catalogue)
    size = (float(job.settings["width"]), float(job.settings["height"]))
    own = None if job.obstacles is None else OwnMap(size, job.obstacles)
    brought = SIDES if own or job.catalogue.maps[str(job.settings["map"])].size else ()
    return ViewState(
        model=job.model,
        preset=job.preset,
        seed=job.seed,
        fixed={
            key: value
            for key, value in _differing(job.settings, preset).items()
            if key not in brought
        },
        own=own,
        literal=job.literal,
        replicate=0 if job.literal else job.replicate,
        catalogue=job.catalogue,
        streams=job.streams,
        plots=job.record.names[:MOST_PLOTS],
        derive=job.record.derive,
    ).checked()


def _differing(
    values: Mapping[str, Value], preset: Mapping[str, Value]
) -> dict[str, Value]:
    """Return the values that differ from the values of a preset.

    With the torus in place of the preset's borders, the preset has `minimum_image`.
    """
    borders = values.get("borders", preset["borders"])
    if borders != preset["borders"]:
        preset = {**preset, "minimum_image": borders == TORUS}
    return {name: value for name, value in values.items() if value != preset[name]}


def _study(state: ViewState) -> Study:
    """Return the study of the copied spec.

    The map may have very many shapes. So the shapes are not written and read as YAML:
    the text has a single shape in place of all shapes.
    """
    spec = state.as_spec()
    own = state.own
    if own is None:
        return parse_spec(spec, catalogue=state.catalogue)
    (name,) = spec["maps"]
    x, y = own.size[0] / 2, own.size[1] / 2
    stand_in = {"disc": {"x": x, "y": y, "radius": min(x, y) / 2}}
    map_ = {"size": list(own.size), "shapes": [stand_in]}
    study = parse_spec(spec | {"maps": {name: map_}}, catalogue=state.catalogue)
    return replace(study, maps={name: own})


def _read(maps: Mapping[str, Any]) -> dict[str, OwnMap]:
    return read_maps(Entry(Document(Path("spec.yaml"), ""), (), maps), Path(), ())


def _own_map(shapes: list[Shape], size: Mapping[str, object]) -> OwnMap:
    """Return the map of these shapes. Raises SpecError for an invalid shape."""
    return _read({EDITED: {"size": [size[side] for side in SIDES], "shapes": shapes}})[
        EDITED
    ]


def _axis(kind: str, range_: Range) -> dict[str, Any]:
    """Return the entry under `sweep`.

    For an integer parameter the entry lists rounded values, each once.
    """
    if kind == "float":
        return {"linspace": list(range_)}
    gap = (range_.high - range_.low) / (range_.points - 1)
    return {
        "values": list(
            dict.fromkeys(round(range_.low + gap * k) for k in range(range_.points))
        )
    }
