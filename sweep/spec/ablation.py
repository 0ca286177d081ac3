"""Axes of ablation studies: points with no, one, all but one or all components.

The components come from a second preset, `detail: {ablate: as_written}`, or from the
spec, `{ablate: {noise: {position_noise: 2, noise_time: 1}, ...}}`.

The first row of the axis has no component. Then one row per component has only this
component. With `leave_out: true` the next rows have all components except one. The last
row has all components.

With a preset, each parameter that differs is a component. `n`, `steps` and parameters
with a value elsewhere in the spec do not change. The map, width and height form a
single component, which is absent if the spec gives a value for any of the three. The
borders and `minimum_image` also form a single component.

With named components, the parameters of a component change together. Each parameter
is in one component only, and has no value elsewhere. Borders in a component also set
`minimum_image`, unless the spec gives a value for `minimum_image`.
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
"""Parameters that form a single component of a preset."""
SCALE = ("n", "steps")

FEWEST_LEFT_OUT = 3
"""Least number of components with `leave_out`.

With two components, leaving out the first equals adding the second alone.
"""
ALL = "all"
BUT = "all but "
AND = " + "
"""Parts of the labels of points with several components, with ALL and BUT."""
NAME = re.compile(r"[A-Za-z0-9]([A-Za-z0-9 _.-]{0,38}[A-Za-z0-9])?")
"""Name of a component, without characters with a meaning in `--where` or labels."""

Detail = tuple[str, ...]


def is_ablation(entry: Entry) -> bool:
    """Return whether `entry` is an axis of an ablation study."""
    return isinstance(entry.value, dict) and "ablate" in entry.value


def read_ablation(
    name: str, entry: Entry, reader: AxisReader, taken: Collection[str]
) -> Axis:
    """Return the axis of an ablation study.

    Parameters
    ----------
    name : str
        Name of the axis, which is not a parameter.
    entry : Entry
        The mapping with the key `ablate`.
    reader : AxisReader
        The reader of the study, with the model and the preset.
    taken : collection of str
        Parameters with a value elsewhere in the spec.

    Returns
    -------
    Axis
        `ablated` is the second preset, or the name of the axis for named components.

    Raises
    ------
    SpecError
        If the axis is not valid, or would change nothing.
    """
    if name in reader.settings:
        raise entry.error(
            f'"{name}" is a parameter: an axis with ablate needs a different name'
        )
    entry.keys([ABLATE.name, LEAVE_OUT.name, "when"])
    chosen = entry.child(ABLATE.name)
    if isinstance(chosen.value, dict):
        return _named(name, entry, reader, taken)
    presets = reader.catalogue.models[reader.model].presets
    other = chosen.one_of(f"preset of {reader.model}", presets)
    if other == reader.preset:
        allowed = ", ".join(preset for preset in presets if preset != other)
        raise chosen.error(
            f"{other} is the preset of the study: ablate needs another preset."
            f" Allowed: {allowed}"
        )
    before, after = (
        fitted_preset(reader.model, preset, reader.catalogue)
        for preset in (reader.preset, other)
    )
    details = differing(before, after, taken)
    if not details:
        raise chosen.error(
            f"ablate changes no parameter: {other} equals {reader.preset} in all"
            " parameters without a value in the spec"
        )
    rows = _rows(entry, details)
    columns = _columns(reader, before, after, details=details, rows=rows)
    when = reader.when(entry)
    return Axis(name, columns, when, entry.place, ablated=other, details=details)


def label(changed: Iterable[bool], names: Sequence[str]) -> str:
    """Return the label of a point of an ablation study.

    `changed` has a truth value for each of the components `names`. The label is ""
    without any component. With components it is a name, several names, "all", or "all
    but noise".
    """
    pairs = list(zip(names, changed, strict=True))
    changed_names = [name for name, is_changed in pairs if is_changed]
    unchanged_names = [name for name, is_changed in pairs if not is_changed]
    if not unchanged_names and len(changed_names) > 1:
        return ALL
    if len(unchanged_names) == 1 and len(names) >= FEWEST_LEFT_OUT:
        return BUT + unchanged_names[0]
    return AND.join(changed_names)


def why_no_detail(name: object) -> str:
    """Return why a component cannot have a name; "" for an allowed name."""
    if not isinstance(name, str) or not NAME.fullmatch(name):
        return (
            "a name of a component has up to 40 letters, digits, spaces and _ . -, and"
            " begins and ends with a letter or digit"
        )
    if name == ALL or name.startswith(BUT):
        return f'"{ALL}" and "{BUT}..." are labels of several components'
    return ""


def _named(name: str, entry: Entry, reader: AxisReader, taken: Collection[str]) -> Axis:
    """Return the axis of the components that the spec names.

    Raises one SpecError with all mistakes.
    """
    chosen = entry.child(ABLATE.name)
    before = fitted_preset(reader.model, reader.preset, reader.catalogue)
    after = dict(before)
    details = dict[str, Detail]()
    detail_of = dict[str, str]()
    mistakes = Mistakes()
    if name in reader.catalogue.models[reader.model].presets:
        raise entry.error(
            f'"{name}" is a preset of {reader.model}: an axis with components needs a'
            " different name"
        )
    for detail, child in chosen.mapping():
        with mistakes.noted():
            if why := why_no_detail(detail):
                raise child.error(f'component "{detail}" is not allowed: {why}')
        changes = dict[str, Value]()
        for setting, value in _settings_of(detail, child, mistakes):
            with mistakes.noted():
                changes[setting] = _changed(setting, value, reader, taken)
                if setting in detail_of:
                    raise value.error(
                        f'"{setting}" is already in the component'
                        f' "{detail_of[setting]}"; the last point has all components'
                    )
            detail_of.setdefault(setting, detail)
        if changes and all(before[key] == value for key, value in changes.items()):
            with mistakes.noted():
                raise child.error(
                    f'"{detail}" changes no value of the preset {reader.preset}'
                )
        details[detail] = tuple(changes)
        after |= changes
    mistakes.check()
    if "borders" in detail_of and "minimum_image" not in {*detail_of, *taken}:
        details[detail_of["borders"]] += ("minimum_image",)
        after["minimum_image"] = after["borders"] == TORUS
    groups = tuple(details.values())
    rows = _rows(entry, groups)
    columns = _columns(reader, before, after, details=groups, rows=rows)
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
    """Return the parameters of a component with the entries of the spec."""
    with mistakes.noted():
        if not isinstance(entry.value, dict) or not entry.value:
            raise entry.error(
                f'"{detail}" must be parameters with values, such as'
                " {packet_loss: 0.2}"
            )
        return list(entry.mapping())
    return []


def _changed(
    name: str, entry: Entry, reader: AxisReader, taken: Collection[str]
) -> Value:
    """Return the value of a parameter of a component, or raise SpecError."""
    if name not in reader.settings:
        raise entry.error(no_setting(name, reader.settings, ()))
    if name in (*WORLD, *SCALE):
        raise entry.error(
            f'"{name}" cannot be in a component: paired trials have equal map, n and'
            " steps; write a separate axis"
        )
    if name in taken:
        raise entry.error(f'"{name}" also has a value elsewhere in the spec')
    try:
        return reader.settings[name].coerce(entry.value)
    except NotAllowedError as error:
        raise entry.error(str(error)) from None


def _rows(entry: Entry, details: tuple[Detail, ...]) -> list[set[Detail]]:
    """Return the components that are changed at each point of the axis, in order."""
    every = set(details)
    rows = [set[Detail](), *({detail} for detail in details)]
    if LEAVE_OUT.name in entry.value and entry.child(LEAVE_OUT.name).truth():
        if len(details) < FEWEST_LEFT_OUT:
            raise entry.child(LEAVE_OUT.name).error(
                f"leave_out needs {FEWEST_LEFT_OUT} components, and there are"
                f" {len(details)}; with two, leave_out adds no new point"
            )
        rows += [every - {detail} for detail in details]
    return [*rows, every] if len(details) > 1 else rows


def differing(
    before: Mapping[str, Value], after: Mapping[str, Value], taken: Collection[str]
) -> tuple[Detail, ...]:
    """Return the components in which two presets differ.

    Parameters
    ----------
    before, after : mapping
        Values of the parameters, from `fitted_preset`.
    taken : collection of str
        Parameters with a value elsewhere in the spec, which do not change.

    Returns
    -------
    tuple of tuple of str
        The parameters of each component, which change together.
    """
    fixed = {*SCALE, *taken}
    fixed |= {name for name, source in BROUGHT.items() if source in taken}
    fixed |= {*WORLD} if fixed & {*WORLD} else set()
    names = [
        name for name in before if before[name] != after[name] and name not in fixed
    ]
    details: dict[str, Detail] = {name: (name,) for name in names}
    for group in TOGETHER:
        changed = tuple(name for name in names if name in group)
        details |= dict.fromkeys(changed, changed)
    return tuple(dict.fromkeys(details.values()))


def fitted_preset(model: str, preset: str, catalogue: Catalogue) -> dict[str, Value]:
    """Return the parameters of a preset, with the width and height of its map.

    Parameters
    ----------
    model, preset : str
    catalogue : Catalogue
        Models and maps by name.

    Returns
    -------
    dict
        Values by parameter, with the values of spreads.
    """
    settings = usual_settings(model, preset, catalogue)
    size = catalogue.maps[str(settings["map"])].size
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
    """Return the values of each parameter of the components, (rows,) each.

    A row that changes the component has the value of `after`. Each other row has the
    value of `before`.
    """
    rows = list(rows)
    return {
        name: np.array(
            [(after if detail in row else before)[name] for row in rows],
            DTYPES[reader.settings[name].kind],
        )
        for detail in details
        for name in detail
    }
