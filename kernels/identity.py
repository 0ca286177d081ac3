"""Which code the numbers of a trial come from: the flight, a model, metrics, a map and
a start, each with a stamp of its own.

So a new model or metric changes no other, a rule changes the models that use it, and a
metric what records it.
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
"""What runs a trial, whatever its model."""


class Code(NamedTuple):
    """The stamps of what trials are computed by: that of the flight, and the others by
    name. A model goes with a preset, whose values points leave out.
    """

    flight: str
    models: dict[str, str]
    metrics: dict[str, str]
    maps: dict[str, str]
    starts: dict[str, str]

    def changes(self, later: "Code") -> list[str]:
        """What has another stamp in `later`, of what both have; in words."""
        found = ["the flight"] if self.flight != later.flight else []
        for kind in self._fields[1:]:
            mine, theirs = getattr(self, kind), getattr(later, kind)
            common = sorted(mine.keys() & theirs.keys())
            found += [
                f"{kind[:-1]} {name}" for name in common if mine[name] != theirs[name]
            ]
        return found


def as_now(then: Code, known: Catalogue) -> Code:
    """The stamps that the names in `then` have now; "" where one is not known."""
    models = [name.split(" ") for name in then.models]
    return code_of(known, models, then.metrics, then.maps, then.starts)


def code_of(
    known: Catalogue,
    models: Iterable[Sequence[str]],
    metrics: Iterable[str],
    maps: Iterable[str],
    starts: Iterable[str],
) -> Code:
    """The code by which trials of these models, each with a preset, record these
    metrics, on maps and from starts of these names; "" where one is not known.
    """
    return Code(
        _flight_stamp(),
        {
            f"{name} {preset}": _model_stamp(known.models.get(name), preset)
            for name, preset in models
        },
        {name: _metric_stamp(known.metrics.get(name)) for name in sorted(metrics)},
        {name: _map_stamp(known.maps.get(name)) for name in sorted(maps)},
        {name: _start_stamp(known.starts.get(name)) for name in sorted(starts)},
    )


def without_stamp(entry: Any) -> list[str]:
    """The fields of an entry, as a Model, whose functions can have no stamp: they do
    not stand at the top of a module.
    """
    return [
        field
        for field, value in entry._asdict().items()
        for one in (value if isinstance(value, tuple) else (value,))
        if callable(one) and not isinstance(one, type) and not at_the_top(one)
    ]


def is_compiled(function: Callable[..., Any]) -> bool:
    """Whether a function is decorated by `kernels.jit`, also where numba is off."""
    return getattr(function, "py_func", function) in OURS


@cache
def kernels_sha() -> str:
    """The sha256 of all kernels together, by which people tell versions apart. It is
    noted, as stamps are.
    """
    return noted("all kernels", lambda: stamp_of_texts(texts_of(OUR_PACKAGE)))


def package_sha(*places: Path) -> str:
    """The sha256 of the code of another package: of its folders, or of its file."""
    return stamp_of_all(*places)


def stamp(function: Callable[..., Any]) -> str:
    """`kernels.stamps.stamp`, whose part that is of our sources is noted."""
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
    return _hash([[stamp(one) for one in FLIGHT], [_shape(group) for group in groups]])


def _model_stamp(model: Model | None, preset: str) -> str:
    """Of the functions of a model, the shape of its settings, the preset's values,
    which points leave out, the names of its rows of state and its kinds.
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


def _metric_stamp(metric: Metric | None) -> str:
    if metric is None:
        return ""
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
    """The names, kinds and choices of settings in their order, as kernels take them."""
    hints = get_type_hints(group, include_extras=True)
    abouts: dict[str, tuple[type[Any], About]] = {
        name: get_args(hint)[:2] for name, hint in hints.items()
    }
    return [
        [name, kind.__name__, about.choices] for name, (kind, about) in abouts.items()
    ]


def _hash(content: Any) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()
