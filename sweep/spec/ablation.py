"""The axis that changes the flock of a study into another one, one detail at a time:
into that of another preset, `detail: {ablate: as_written}`, or into one with details
that the spec names, `{ablate: {noise: {position_noise: 2, noise_time: 1}, ...}}`.

Its rows are: no change; each detail alone; with `leave_out: true` all details but one,
for each; and, last, all of them at once.

Of another preset each setting in which it differs is a detail. Settings that the study
gives elsewhere stay as given, and so do `n` and `steps`. The map with its width and
height is one detail, and stays where the study gives any of the three. The borders with
`minimum_image` are one detail, too. A named detail has one setting or several, which
change together; each setting is of one detail, and has no value elsewhere. Borders that
it names bring `minimum_image`, where the spec leaves that out.
"""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from kernels.catalogue import Catalogue
from sweep.spec.axes import Axis, AxisReader
from sweep.spec.axis_keys import ABLATE, LEAVE_OUT
from sweep.spec.document import Entry
from sweep.spec.mistakes import Mistakes
from sweep.spec.settings import (
    BROUGHT,
    DTYPES,
    TORUS,
    NotAllowedError,
    Value,
    Values,
    no_setting,
    usual_settings,
)

WORLD = ("map", "width", "height")
TOGETHER = (WORLD, ("borders", "minimum_image"))
"""Settings that are one detail of a preset."""
SCALE = ("n", "steps")

FEWEST_LEFT_OUT = 3
"""With two details, all but one of them is the other one alone."""
ALL, BUT, AND = "all", "all but ", " + "
"""Parts of the labels of points with several details."""
NAME = re.compile(r"[A-Za-z0-9]([A-Za-z0-9 _.-]{0,38}[A-Za-z0-9])?")
"""Of a detail: no sign that has a meaning in `--where` and in labels."""

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
    entry.keys([ABLATE.name, LEAVE_OUT.name, "when"])
    chosen = entry.child(ABLATE.name)
    if isinstance(chosen.value, dict):
        return _named(name, entry, reader, given)
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
    rows = _rows(entry, details)
    columns = _columns(reader, before, after, details, rows)
    when = reader.when(entry)
    return Axis(name, columns, when, entry.place, ablated=other, details=details)


def label(changed: Iterable[bool], names: Sequence[str]) -> str:
    """What a point with these of the details called `names` is called: "" without any,
    the name of one, "all", "all but noise", or else several names.
    """
    pairs = list(zip(names, changed, strict=True))
    there = [name for name, is_changed in pairs if is_changed]
    missing = [name for name, is_changed in pairs if not is_changed]
    if not missing and len(there) > 1:
        return ALL
    if len(missing) == 1 and len(names) >= FEWEST_LEFT_OUT:
        return BUT + missing[0]
    return AND.join(there)


def why_no_detail(name: object) -> str:
    """Why no detail can have this name; "" where one can."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        return (
            "a name of a detail has up to 40 letters, digits, spaces and any of _ . -"
            " between letters or digits"
        )
    if name == ALL or name.startswith(BUT):
        return f'"{ALL}" and "{BUT}..." name several details together'
    return ""


def _named(name: str, entry: Entry, reader: AxisReader, given: Collection[str]) -> Axis:
    """The axis whose details the spec names. Raises SpecError for all mistakes."""
    chosen = entry.child(ABLATE.name)
    before = fitted_preset(reader.model, reader.preset, reader.known)
    details, after, mistakes = dict[str, Detail](), dict(before), Mistakes()
    of = dict[str, str]()
    if name in reader.known.models[reader.model].presets:
        raise entry.error(
            f'"{name}" is a preset of {reader.model}: an axis with details needs a'
            " name of its own"
        )
    for detail, child in chosen.mapping():
        with mistakes.noted():
            if why := why_no_detail(detail):
                raise child.error(f'no detail can be called "{detail}": {why}')
        found = dict[str, Value]()
        for setting, value in _settings_of(detail, child, mistakes):
            with mistakes.noted():
                found[setting] = _changed(setting, value, reader, given)
                if setting in of:
                    raise value.error(
                        f'"{setting}" is of the detail "{of[setting]}" already, and'
                        " both are there where all are"
                    )
            of.setdefault(setting, detail)
        if found and all(before[one] == value for one, value in found.items()):
            with mistakes.noted():
                raise child.error(
                    f'"{detail}" would change nothing: {reader.preset} has these values'
                )
        details[detail] = tuple(found)
        after |= found
    mistakes.check()
    if "borders" in of and "minimum_image" not in {*of, *given}:
        details[of["borders"]] += ("minimum_image",)
        after["minimum_image"] = after["borders"] == TORUS
    groups = tuple(details.values())
    columns = _columns(reader, before, after, groups, _rows(entry, groups))
    return Axis(
        name,
        columns,
        reader.when(entry),
        entry.place,
        ablated=name,
        details=groups,
        named=tuple(details),
    )


def _settings_of(
    detail: str, entry: Entry, mistakes: Mistakes
) -> list[tuple[str, Entry]]:
    """The settings that are written below a detail."""
    with mistakes.noted():
        if not isinstance(entry.value, dict) or not entry.value:
            raise entry.error(
                f'"{detail}" must be settings with their values, as'
                " {packet_loss: 0.2}"
            )
        return list(entry.mapping())
    return []


def _changed(
    name: str, entry: Entry, reader: AxisReader, given: Collection[str]
) -> Value:
    """The value of a setting of a detail."""
    if name not in reader.settings:
        raise entry.error(no_setting(name, reader.settings, ()))
    if name in (*WORLD, *SCALE):
        raise entry.error(
            f'"{name}" cannot be a detail: the trials of a pair have the same map, n'
            " and steps; write it as an axis of its own"
        )
    if name in given:
        raise entry.error(f'"{name}" has a value elsewhere in the spec, too')
    try:
        return reader.settings[name].coerce(entry.value)
    except NotAllowedError as error:
        raise entry.error(str(error)) from None


def _rows(entry: Entry, details: tuple[Detail, ...]) -> list[set[Detail]]:
    """The details that are changed at each point of the axis, in their order."""
    every = set(details)
    rows = [set[Detail](), *({detail} for detail in details)]
    if LEAVE_OUT.name in entry.value and entry.child(LEAVE_OUT.name).truth():
        if len(details) < FEWEST_LEFT_OUT:
            raise entry.child(LEAVE_OUT.name).error(
                f"leave_out needs {FEWEST_LEFT_OUT} details, and there are"
                f" {len(details)}: all but one are no others than alone"
            )
        rows += [every - {detail} for detail in details]
    return [*rows, every] if len(details) > 1 else rows


def differing(
    one: Mapping[str, Value], two: Mapping[str, Value], given: Collection[str]
) -> tuple[Detail, ...]:
    """The details in which two presets differ. A detail is the name of one setting, or
    those of the settings of the world, or of its borders, which change together.
    """
    kept = {*SCALE, *given}
    kept |= {name for name, source in BROUGHT.items() if source in given}
    kept |= {*WORLD} if kept & {*WORLD} else set()
    names = [name for name in one if one[name] != two[name] and name not in kept]
    details: dict[str, Detail] = {name: (name,) for name in names}
    for group in TOGETHER:
        changed = tuple(name for name in names if name in group)
        details |= dict.fromkeys(changed, changed)
    return tuple(dict.fromkeys(details.values()))


def fitted_preset(model: str, preset: str, known: Catalogue) -> dict[str, Value]:
    """The settings of a preset, and the spreads, with the width and height that its map
    brings along.
    """
    settings = usual_settings(model, preset, known)
    size = known.maps[str(settings["map"])].size
    return settings | (
        dict(zip(("width", "height"), size, strict=True)) if size else {}
    )


def _columns(
    reader: AxisReader,
    before: Mapping[str, Value],
    after: Mapping[str, Value],
    details: tuple[Detail, ...],
    rows: Iterable[set[Detail]],
) -> dict[str, Values]:
    """The values of each setting: those of `after` in the rows that have its detail."""
    rows = list(rows)
    return {
        name: np.array(
            [(after if detail in row else before)[name] for row in rows],
            DTYPES[reader.settings[name].kind],
        )
        for detail in details
        for name in detail
    }
