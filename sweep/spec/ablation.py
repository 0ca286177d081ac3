"""The axis that changes one preset of a model into another, one detail at a time:
`detail: {ablate: as_written}`.

Its rows are: no change; for each setting in which the presets differ, that setting
alone at the other preset's value; and, last, all of them at once. Settings that the
study gives elsewhere stay as given, and so do `n` and `steps`. The map with its width
and height is one detail, and stays where the study gives any of the three.
"""

from collections.abc import Collection, Mapping

import numpy as np

from kernels.catalogue import Catalogue
from sweep.spec.axes import Axis, AxisReader
from sweep.spec.document import Entry
from sweep.spec.settings import DTYPES, Value, Values, preset_settings

WORLD = ("map", "width", "height")
SCALE = ("n", "steps")

Detail = tuple[str, ...]


def is_ablation(entry: Entry) -> bool:
    """Whether `entry` writes an axis of this kind."""
    return isinstance(entry.value, dict) and "ablate" in entry.value


def read_ablation(
    name: str, entry: Entry, reader: AxisReader, given: Collection[str]
) -> Axis:
    """The axis that `entry` writes, without the settings that are `given` elsewhere.

    Raises SpecError where it is none.
    """
    if name in reader.settings:
        raise entry.error(
            f'"{name}" is a setting: an axis that ablates needs a name of its own'
        )
    entry.keys(["ablate", "when"])
    chosen = entry.child("ablate")
    presets = reader.known.models[reader.model].presets
    other = chosen.one_of(f"preset of {reader.model}", presets)
    if other == reader.preset:
        others = ", ".join(preset for preset in presets if preset != other)
        raise chosen.error(
            f"{other} is the preset of the study: ablate needs another one."
            f" Allowed: {others}"
        )
    before, after = (
        fitted_preset(reader.model, preset, reader.known)
        for preset in (reader.preset, other)
    )
    details = differing(before, after, given)
    if not details:
        raise chosen.error(
            f"nothing would change: {other} differs from {reader.preset} in no setting"
            " that the spec leaves open"
        )
    columns = _columns(reader, before, after, details)
    when = reader.when(entry)
    return Axis(name, columns, when, entry.place, ablated=other, details=details)


def differing(
    one: Mapping[str, Value], two: Mapping[str, Value], given: Collection[str]
) -> tuple[Detail, ...]:
    """The details in which two presets differ. A detail is the name of one setting, or
    those of the settings of the world, which change together.
    """
    names = [
        name for name in one if one[name] != two[name] and name not in (*SCALE, *given)
    ]
    world = tuple(name for name in names if name in WORLD)
    details = [world if name in WORLD else (name,) for name in names]
    if set(WORLD) & set(given):
        details = [detail for detail in details if detail != world]
    return tuple(dict.fromkeys(details))


def fitted_preset(model: str, preset: str, known: Catalogue) -> dict[str, Value]:
    """The settings of a preset, with the width and height that its map brings along."""
    settings = preset_settings(model, preset, known)
    size = known.maps[str(settings["map"])].size
    return settings | (
        dict(zip(("width", "height"), size, strict=True)) if size else {}
    )


def _columns(
    reader: AxisReader,
    before: Mapping[str, Value],
    after: Mapping[str, Value],
    details: tuple[Detail, ...],
) -> dict[str, Values]:
    """Rows: no change, each detail, and all of them where there are several."""
    rows = [set[str](), *map(set, details)]
    if len(details) > 1:
        rows.append({name for detail in details for name in detail})
    return {
        name: np.array(
            [(after if name in row else before)[name] for row in rows],
            DTYPES[reader.settings[name].kind],
        )
        for detail in details
        for name in detail
    }
