"""Identity of the code that computes the results of a trial.

The run of a flock, each model, each metric, each map and each start have separate
stamps. So a new model or metric changes no existing stamp. A change of a rule changes
the models with this rule. A change of a metric changes the trials that record this
metric.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, get_args, get_type_hints

from kernels import coverage, flight, stamps
from kernels.caching import OUR_PACKAGE, OURS, noted, noted_stamp
from kernels.catalogue import Catalogue
from kernels.metrics import Metric
from kernels.model import Model
from kernels.settings import (
    About,
    Actuation,
    Breakdowns,
    Observation,
    Schedule,
    Sensing,
    StartSettings,
    WorldSettings,
)
from kernels.stamps import at_the_top, stamp_of_all, stamp_of_texts, texts_of
from kernels.starts import Start
from kernels.worlds import Map

FLIGHT: tuple[Callable[..., Any], ...] = (
    flight.build_scenery,
    flight.begin,
    flight.advance,
    flight.rebuild_grid,
    flight.go_on_from,
    flight.measure,
    flight.forget_frames,
    coverage.build_coverage,
    coverage.no_coverage,
    coverage.unvisited,
    coverage.heatmap,
)
"""Functions that run a trial of any model."""


class Code(NamedTuple):
    """Stamps of the code that computes trials.

    `flight` is the stamp of the run. The remaining stamps are by name. The name of a
    model includes a preset, since points leave out the values of the preset.
    """

    flight: str
    models: dict[str, str]
    metrics: dict[str, str]
    maps: dict[str, str]
    starts: dict[str, str]

    def changes(self, later: "Code") -> list[str]:
        """Return descriptions of the common entries with a changed stamp in `later`."""
        changed = ["the flight"] if self.flight != later.flight else []
        for kind in self._fields[1:]:
            mine = getattr(self, kind)
            theirs = getattr(later, kind)
            common = sorted(mine.keys() & theirs.keys())
            changed += [
                f"{kind[:-1]} {name}" for name in common if mine[name] != theirs[name]
            ]
        return changed


def as_now(then: Code, known: Catalogue) -> Code:
    """Return the present stamps of the names in `then`; "" for an unknown name."""
    models = [name.split(" ") for name in then.models]
    return code_of(known, models, then.metrics, maps=then.maps, starts=then.starts)


def code_of(
    known: Catalogue,
    models: Iterable[Sequence[str]],
    metrics: Iterable[str],
    maps: Iterable[str],
    starts: Iterable[str],
) -> Code:
    """Return the stamps of the code that computes some trials.

    Parameters
    ----------
    known : Catalogue
    models : iterable of sequence of str
        Names of models, each with a preset.
    metrics : iterable of str
        Names of recorded metrics and profiles.
    maps : iterable of str
        Names of maps.
    starts : iterable of str
        Names of starts.

    Returns
    -------
    Code
        Stamps, "" for an unknown name.
    """
    return Code(
        flight=_flight_stamp(),
        models={
            f"{name} {preset}": _model_stamp(known.models.get(name), preset)
            for name, preset in models
        },
        metrics={name: _recorded_stamp(known, name) for name in sorted(metrics)},
        maps={name: _map_stamp(known.maps.get(name)) for name in sorted(maps)},
        starts={name: _start_stamp(known.starts.get(name)) for name in sorted(starts)},
    )


def without_stamp(entry: Any) -> list[str]:
    """Return the fields of an entry with functions that cannot have a stamp.

    The entry is, for example, a Model. A function without a stamp is not at the top
    level of a module.
    """
    return [
        field
        for field, value in entry._asdict().items()
        for function in (value if isinstance(value, tuple) else (value,))
        if callable(function)
        and not isinstance(function, type)
        and not at_the_top(function)
    ]


def is_compiled(function: Callable[..., Any]) -> bool:
    """Return whether `kernels.jit` decorates a function, also with numba off."""
    return getattr(function, "py_func", function) in OURS


@cache
def kernels_sha() -> str:
    """Return the sha256 of all kernels together, which identifies a version.

    A note keeps the hash, as for stamps.
    """
    return noted("all kernels", lambda: stamp_of_texts(texts_of(OUR_PACKAGE)))


def package_sha(*places: Path) -> str:
    """Return the sha256 of the code of a custom package, from its folders or file."""
    return stamp_of_all(*places)


def stamp(function: Callable[..., Any]) -> str:
    """Return `kernels.stamps.stamp`; a note keeps the part from the package."""
    return stamps.stamp(function, noted_stamp)


@cache
def _flight_stamp() -> str:
    return noted("the flight", _found_flight_stamp)


def _found_flight_stamp() -> str:
    groups = (
        Schedule,
        WorldSettings,
        *(Sensing, Actuation, Breakdowns),
        StartSettings,
        Observation,
    )
    return _hash(
        [[stamp(function) for function in FLIGHT], [_shape(group) for group in groups]]
    )


def _model_stamp(model: Model | None, preset: str) -> str:
    """Return the stamp of a model with a preset; "" for an unknown model or preset.

    The stamp covers the functions of the model, the shape of the parameters, the names
    of the state rows, and the kinds. The stamp also covers the values of the preset,
    since points leave out these values.
    """
    if model is None or preset not in model.presets:
        return ""
    functions = {
        field: stamp(value)
        for field, value in model._asdict().items()
        if callable(value) and value is not model.params
    }
    boids = [list(model.state), model.kinds]
    values = model.preset_values(preset)
    return _hash([functions, _shape(model.params), values, boids])


def _recorded_stamp(known: Catalogue, name: str) -> str:
    """Return the stamp of a metric or of a profile; "" for an unknown name."""
    if metric := known.metrics.get(name):
        return _metric_stamp(metric)
    profile = known.profiles.get(name)
    return _hash([stamp(profile.measure), profile.part]) if profile else ""


def _metric_stamp(metric: Metric) -> str:
    needs = metric.covers, metric.counts, metric.pairs
    more = metric.integrates, metric.follows, metric.part
    return _hash([stamp(metric.measure), needs, more])


def _map_stamp(drawn: Map | None) -> str:
    if drawn is None:
        return ""
    return _hash([stamp(drawn.draw), drawn.size, drawn.random])


def _start_stamp(start: Start | None) -> str:
    if start is None:
        return ""
    if start.by_replicate:
        return _hash([stamp(draw) for draw in start.by_replicate])
    return stamp(start.draw)


def _shape(group: type[Any]) -> list[Any]:
    """Return names, types and choices of parameters in the order of kernels."""
    hints = get_type_hints(group, include_extras=True)
    declarations: dict[str, tuple[type[Any], About]] = {
        name: get_args(hint)[:2] for name, hint in hints.items()
    }
    return [
        [name, kind.__name__, declaration.choices]
        for name, (kind, declaration) in declarations.items()
    ]


def _hash(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
