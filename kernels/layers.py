"""Layers of a run, and models compiled for these layers."""

from collections.abc import Collection, Iterable, Iterator
from functools import cache
from typing import Any, get_args, get_type_hints

from kernels.caching import is_kept
from kernels.goals import Goals
from kernels.model import Model
from kernels.moving import Motion
from kernels.playback import Played
from kernels.recording import Record
from kernels.robots.motors import Motors
from kernels.robots.senses import Senses
from kernels.robots.wind import Wind
from kernels.state import Corners, Flock, World
from kernels.workspace import Workspace

LAYERS: dict[type, str] = {
    Senses: "sensing",
    Motors: "actuation",
    Wind: "wind",
    Goals: "waypoints",
    Motion: "moving obstacles",
    Corners: "polygons",
}
"""Optional parts of a run, and their names for users.

Each combination compiles `advance` to a separate kernel.
"""


def is_compiled(model: Model, layers: Collection[type]) -> bool:
    """Return whether `advance` of a model is compiled for runs with some LAYERS."""
    params = Played if model.events else model.params
    kinds = Flock, World, params, Workspace, Record
    absent = LAYERS.keys() - set(layers)
    return is_kept(model.advance, set(_named_tuples(kinds, absent)))


def _named_tuples(kinds: Iterable[Any], absent: Collection[type]) -> Iterator[type]:
    """Yield the named tuples among types, and in the fields of named tuples."""
    for kind in kinds:
        if hasattr(kind, "_fields") and kind not in absent:
            yield kind
            yield from _named_tuples(_in_fields(kind), absent)
        yield from _named_tuples(get_args(kind), absent)


@cache
def _in_fields(kind: type) -> tuple[Any, ...]:
    """Return the types of the fields of a named tuple."""
    return tuple(get_type_hints(kind).values())
