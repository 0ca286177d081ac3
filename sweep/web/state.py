"""The state on the screen. It is a spec: a launch of the copied text gives the very
same frames.

So sweep.spec.study makes every check, every "did you mean" and every seed.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from kernels.catalogue import BUILT_IN, Catalogue
from kernels.metrics import METRICS
from sweep.design.design import expand
from sweep.design.jobs import Job, Jobs
from sweep.design.points import SIDES
from sweep.errors import SpecError
from sweep.spec.derived_metrics import DerivedMetric
from sweep.spec.document import Document, Entry
from sweep.spec.keys import written
from sweep.spec.maps import OwnMap, map_as_written, read_maps, shape_as_written
from sweep.spec.settings import (
    TORUS,
    NotAllowedError,
    Setting,
    Value,
    settings_of,
    usual_preset,
    usual_settings,
)
from sweep.spec.strict_yaml import MOST_BYTES, dump
from sweep.spec.study import RecordSpec, Streams, Study, parse_spec, spec_parts
from sweep.text import unknown
from sweep.web.opened import Edits, OpenedSpec, opened

COMMON = Streams(noise="common")
ANY_METRIC = next(name for name, metric in METRICS.items() if metric.looks)
"""A copied spec records this metric if none is plotted: a spec must record one. Every
trial can measure a metric of the bodies alone.
"""
"""The preset that is shown if the user names none, and the model has it."""
EDITED = "edited"
"""The name of a map whose shapes were changed."""
MOST_BOIDS = 100_000
MOST_STORED = 10**7
"""A copied spec stores trajectories up to so many boids times frames: 320 MB."""
MOST_PLOTS = 4
MOST_POINTS = 1000
REPLICATES = 10
"""Replicates of a copied spec that sweeps something."""

Shape = Mapping[str, Mapping[str, Any]]
"""A shape as a spec writes it: {disc: {x, y, radius}}, {rectangle: {x, y, width,
height}} or {polygon: {vertices, solid}}.
"""


class Range(NamedTuple):
    """The values of a setting that a copied spec sweeps: `points` of them, from `low`
    to `high`.
    """

    low: float
    high: float
    points: int


@dataclass(frozen=True)
class ViewState:
    """A model, a preset, the settings that differ from it in `fixed`, a seed and, where
    there is one, a map of its own.

    `literal` says that the seed is one of a list in the spec. Otherwise `replicate` is
    the number of the trial: a copied spec runs the replicates before it too. Random
    numbers are common to all points. So another value of a setting meets the same
    noise, and a run can be made longer. A spec that was not made here keeps its own
    streams. `plots` are the metrics that are plotted, `derive` those that the spec
    computes from others, `sweeps` the settings that a copied spec varies. `opened` is
    the spec that was opened at this trial, of which all else stays. All methods raise
    SpecError for what a spec would not accept.
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
    known: Catalogue = BUILT_IN
    opened: OpenedSpec | None = None

    @cached_property
    def job(self) -> Job:
        """The trial on the screen: the one of `replicate` in the copied spec, without
        its sweep.
        """
        plain = replace(self, sweeps={}) if self.sweeps else self
        study = _study(plain)
        job = Jobs(study, expand(study))[self.replicate]
        if int(job.settings["n"]) > MOST_BOIDS:
            raise SpecError(
                f"n: {job.settings['n']:,} boids are more than can be shown;"
                f" at most {MOST_BOIDS:,} can"
            )
        return job

    @cached_property
    def _known_settings(self) -> dict[str, Setting]:
        return settings_of(self.model, self.known).of_study(())

    @cached_property
    def _preset(self) -> dict[str, Value]:
        return usual_settings(self.model, self.preset, self.known)

    @property
    def settings(self) -> dict[str, Value]:
        """The value of every setting, and of spreads those that differ from 0."""
        return self.job.settings

    def _differing(self, before: "ViewState") -> dict[str, Value]:
        """The settings that are others than `before`, with their values."""
        every, there = self._preset | self.settings, before._preset | before.settings
        return {name: value for name, value in every.items() if value != there[name]}

    @property
    def shapes(self) -> list[Shape] | None:
        """The obstacles as a spec writes them; None for a built-in map."""
        return (
            None
            if self.own is None
            else [shape_as_written(obstacle) for obstacle in self.own.obstacles]
        )

    def with_settings(self, changes: Mapping[str, object]) -> "ViewState":
        """The state with other values of settings or `seed`. Another map brings its own
        size, and other borders `minimum_image`.
        """
        changed = dict(changes)
        seed = changed.pop("seed", self.seed)
        if not isinstance(seed, int) or isinstance(seed, bool):
            raise SpecError(
                f"seed: {seed!r} is not allowed; it is a whole number from 0"
            )
        state = replace(self, seed=seed)
        if "map" in changed and not (
            self.own and changed["map"] == self.settings["map"]
        ):
            kept = {
                name: value for name, value in self.fixed.items() if name not in SIDES
            }
            state = replace(state, own=None, fixed=kept)
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
        """The state with these obstacles instead of all others."""
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
        """The state in which the copied spec sweeps a setting over a range; None ends
        that.
        """
        if range_ is not None and not 2 <= range_.points <= MOST_POINTS:
            raise SpecError(
                f"{name}: {range_.points} points are not allowed;"
                f" a sweep has 2 to {MOST_POINTS:,}"
            )
        if name not in self._known_settings:
            raise SpecError(unknown("setting", name, self._known_settings))
        if self.opened and self.opened.study.search:
            raise SpecError(
                f"{name}: the spec is that of a search, which sweeps nothing"
            )
        if self._known_settings[name].kind not in ("float", "int"):
            raise SpecError(f"{name}: only numbers are swept over a range")
        others = {other: swept for other, swept in self.sweeps.items() if other != name}
        return replace(
            self, sweeps=others | ({name: range_} if range_ else {})
        ).checked()

    def follow(self, metrics: tuple[str, ...]) -> "ViewState":
        """The state with these metrics plotted."""
        return replace(self, plots=metrics).checked()

    def checked(self) -> "ViewState":
        """This state. Raises SpecError if it could not be launched."""
        _ = self.job
        if self.sweeps:
            expand(_study(self))
        return self

    def on_preset(self, other: "ViewState") -> "ViewState":
        """`other`, the state of another preset, with what differs here from its own
        preset: values of settings, the map and the plots.
        """
        kept = {
            name: value
            for name, value in self.fixed.items()
            if not (self.own and name in (*SIDES, "map"))
        }
        state = replace(other, plots=self.plots, derive=self.derive)
        state = state.place(self.shapes or []) if self.own else state
        return state.with_settings(kept)

    def moved(self, spec: OpenedSpec) -> "ViewState":
        """The state at another trial of the opened spec. What was changed stays."""
        before, there = from_opened(self.opened or spec), from_opened(spec)
        redrawn = self.own != before.own
        changes = {
            name: value
            for name, value in self._differing(before).items()
            if not (redrawn and name in (*SIDES, "map"))
        }
        seed = there.seed if self.seed == before.seed else self.seed
        state = replace(there, seed=seed, plots=self.plots, sweeps=self.sweeps)
        state = state.place(self.shapes or []) if redrawn else state
        return state._fixing(changes).checked()

    def as_spec(self) -> dict[str, Any]:
        """The spec that launches what is on the screen, with the sweeps that the user
        has marked.
        """
        known = self._known_settings
        values: dict[str, Any] = {
            "model": self.model,
            "preset": self.preset,
            "seed": self.seed,
        }
        if self.own:
            values["maps"] = {str(self.fixed["map"]): map_as_written(self.own)}
        if fixed := {
            name: self.fixed[name]
            for name in known
            if name in self.fixed and name not in self.sweeps
        }:
            values["fixed"] = fixed
        if self.sweeps:
            values["sweep"] = {
                name: _axis(known[name].kind, range_)
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

    def as_text(self) -> str:
        """The spec as YAML: the text of the opened one with what was changed. Raises
        SpecError if it is too long for a spec file.
        """
        text = self._changed(self.opened) if self.opened else dump(self._portable())
        if len(text) > MOST_BYTES:
            raise SpecError(
                f"the spec would be larger than {MOST_BYTES:,} bytes:"
                " the map has too many shapes"
            )
        return text

    def _changed(self, opened: OpenedSpec) -> str:
        """The text of the opened spec; the very same one where nothing was changed."""
        before = from_opened(opened)
        if before == self:
            return opened.study.text
        known = self._known_settings
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
                name: _axis(known[name].kind, range_)
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
        """A file in the place of the name of its entry."""
        kinds = {"map": "maps", "start_draws": "starts", "metrics": "metrics"}
        return self.known.written(kinds[name], value) if name in kinds else value

    def _portable(self) -> dict[str, Any]:
        """The spec with files in the place of the names of their entries."""
        spec, written = self.as_spec(), self.known.written
        fixed, record = spec.get("fixed", {}), spec["record"]
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
            texts = {one.name: one.expression.text for one in self.derive}
            values["derive"] = texts
        known = self._preset | dict(self.fixed)
        frames = (self.replicate + 1) * int(known["steps"])
        if not self.sweeps and frames * int(known["n"]) <= MOST_STORED:
            values["trajectories"] = True
        return written(values, RecordSpec)

    def _fixing(self, changes: Mapping[str, object]) -> "ViewState":
        """The state with other values of settings. `fixed` has only those that differ
        from the preset, and from what its borders bring.
        """
        known = self._fields()
        fixed = dict(self.fixed)
        for name, value in changes.items():
            if name not in known:
                raise SpecError(unknown("setting", name, known))
            try:
                fixed[name] = known[name].coerce(value)
            except NotAllowedError as error:
                raise SpecError(str(error)) from None
        return replace(self, fixed=_differing(fixed, self._preset))

    def _fields(self) -> dict[str, Any]:
        known = self._known_settings
        own = (str(self.fixed["map"]),) if self.own else ()
        return known | {
            "map": replace(known["map"], choices=(*known["map"].choices, *own))
        }

    def _fixed_on(self, name: str) -> dict[str, Value]:
        """What is fixed, with the map of this name in the place of the other. A map
        brings its size, so no size is fixed.
        """
        kept = {
            key: value
            for key, value in self.fixed.items()
            if key not in (*SIDES, "map")
        }
        return kept if name == self._preset["map"] else kept | {"map": name}

    def _resized(self, size: Mapping[str, object]) -> "ViewState":
        """The state with an own map of another size and the same shapes."""
        return replace(
            self, own=_own_map(self.shapes or [], size), fixed=self._fixed_on(EDITED)
        )


def begin(
    model: str | None = None,
    preset: str | None = None,
    seed: int = 1,
    known: Catalogue = BUILT_IN,
) -> ViewState:
    """The state that shows a preset as it is, and plots the first metrics of the model.
    The default is the first of all models that are known.
    """
    model = model or next(iter(known.models))
    if model not in known.models:
        raise SpecError(unknown("model", model, known.models))
    about = known.models[model]
    preset = preset or usual_preset(about)
    if preset not in about.presets:
        raise SpecError(unknown(f"preset of {model}", preset, about.presets))
    plots = about.metrics[:MOST_PLOTS]
    return ViewState(model, preset, seed, plots=plots, known=known).checked()


def from_study(study: Study) -> ViewState:
    """The state that shows the first trial of a study."""
    return from_opened(opened(study))


def from_opened(spec: OpenedSpec) -> ViewState:
    """The state that shows a trial of an opened spec."""
    return replace(from_job(spec.job), opened=spec)


def from_job(job: Job) -> ViewState:
    """The state of a stored trial, with its random numbers and the first of its
    metrics.
    """
    preset = usual_settings(job.model, job.preset, job.known)
    name, width, height = (
        str(job.settings["map"]),
        float(job.settings["width"]),
        float(job.settings["height"]),
    )
    own = None if job.obstacles is None else OwnMap((width, height), job.obstacles)
    brought = SIDES if own or job.known.maps[name].size else ()
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
        known=job.known,
        streams=job.streams,
        plots=job.record.names[:MOST_PLOTS],
        derive=job.record.derive,
    ).checked()


def _differing(
    values: Mapping[str, Value], preset: Mapping[str, Value]
) -> dict[str, Value]:
    """The values that differ from those of a preset: a torus in the place of its
    borders is periodic there.
    """
    borders = values.get("borders", preset["borders"])
    if borders != preset["borders"]:
        preset = {**preset, "minimum_image": borders == TORUS}
    return {name: value for name, value in values.items() if value != preset[name]}


def _study(state: ViewState) -> Study:
    """The study of the copied spec. Its map may have very many shapes, so they are not
    written and read as YAML: the text has one shape in their place.
    """
    spec, own = state.as_spec(), state.own
    if own is None:
        return parse_spec(spec, known=state.known)
    (name,) = spec["maps"]
    x, y = own.size[0] / 2, own.size[1] / 2
    stand_in = {"disc": {"x": x, "y": y, "radius": min(x, y) / 2}}
    map_ = {"size": list(own.size), "shapes": [stand_in]}
    study = parse_spec(spec | {"maps": {name: map_}}, known=state.known)
    return replace(study, maps={name: own})


def _read(maps: Mapping[str, Any]) -> dict[str, OwnMap]:
    return read_maps(Entry(Document(Path("spec.yaml"), ""), (), maps), Path(), ())


def _own_map(shapes: list[Shape], size: Mapping[str, object]) -> OwnMap:
    """The map of these shapes. Raises SpecError for what is no shape."""
    return _read({EDITED: {"size": [size[side] for side in SIDES], "shapes": shapes}})[
        EDITED
    ]


def _axis(kind: str, range_: Range) -> dict[str, Any]:
    """The entry under `sweep`. Of a setting that is a whole number it lists rounded
    values, each once.
    """
    if kind == "float":
        return {"linspace": list(range_)}
    gap = (range_.high - range_.low) / (range_.points - 1)
    return {
        "values": list(
            dict.fromkeys(round(range_.low + gap * k) for k in range(range_.points))
        )
    }
