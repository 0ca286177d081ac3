"""Values of the parameters of a study: `fixed`, `sweep`, `derive`; and `require`.

All functions raise SpecError for values that are not allowed.
"""

from collections import Counter
from collections.abc import Container, Iterable, Mapping
from dataclasses import replace

from sweep.spec.ablation import is_ablation, read_ablation
from sweep.spec.axes import Axis, AxisReader, by_design, read_expression
from sweep.spec.document import Entry, Place
from sweep.spec.expressions import CONDITION, KINDS, Expression
from sweep.spec.limits import MOST_CELLS, beyond
from sweep.spec.mistakes import Mistakes
from sweep.spec.samplers import in_blocks
from sweep.spec.settings import BROUGHT, NotAllowedError, Setting, Value, no_setting
from sweep.text import unknown


def read_fixed(
    entry: Entry | None, settings: dict[str, Setting], keys: Container[str] = ()
) -> dict[str, Value]:
    """Return the values under `fixed`, each in the type of the parameter.

    Parameters
    ----------
    entry : Entry or None
    settings : dict
        Parameters by name.
    keys : container of str, optional
        Keys of a spec, for a message about a key that is not a parameter.
    """
    fixed: dict[str, Value] = {}
    mistakes = Mistakes()
    for name, child in entry.mapping() if entry else ():
        with mistakes.noted():
            fixed[name] = _fixed(name, child, settings, keys)
    mistakes.check()
    return fixed


def _fixed(
    name: str, entry: Entry, settings: dict[str, Setting], keys: Container[str]
) -> Value:
    if name not in settings:
        raise entry.error(no_setting(name, settings, keys))
    try:
        return settings[name].coerce(entry.value)
    except NotAllowedError as error:
        raise entry.error(str(error)) from None


def read_designs(
    entry: Entry | None, reader: AxisReader, taken: Iterable[str]
) -> tuple[Axis, ...]:
    """Return the axes under `sweep`, of a design or of a list of designs.

    The points of several designs are united.

    Parameters
    ----------
    entry : Entry or None
    reader : AxisReader
    taken : iterable of str
        Parameters with a value under another key.
    """
    if entry is None or not isinstance(entry.value, list):
        return read_axes(entry, reader, taken)
    axes: list[Axis] = []
    mistakes = Mistakes()
    cells = 0
    for number, child in enumerate(entry.entries()):
        with mistakes.noted():
            read = read_axes(child, reader, taken)
            _check_uniting(child, read, axes)
            axes += [replace(axis, design=number) for axis in read]
            cells += sum(len(axis) * len(axis.columns) for axis in read)
        if cells > MOST_CELLS:
            size = f"the designs up to this design have {cells:,} cells"
            raise child.error(beyond(size, MOST_CELLS))
    mistakes.check()
    return tuple(axes)


def _check_uniting(entry: Entry, axes: Iterable[Axis], earlier: Iterable[Axis]) -> None:
    """Raise SpecError for an axis that cannot be united with other designs.

    The axis is an ablation axis, a sample of blocks, or has the name of an earlier axis
    and different parameters.
    """
    names = {axis.name for axis in earlier}
    for axis in axes:
        child = entry.child(axis.name)
        if axis.ablated:
            raise child.error(
                f'"{axis.name}" has ablate, which excludes several designs: write a'
                " separate study"
            )
        if axis.blocks:
            raise child.error(
                f'"{axis.name}" is a {axis.sampler} sample, which excludes several'
                " designs: write a separate study"
            )
        if axis.name in names and {axis.name} != axis.columns.keys():
            raise child.error(
                f'"{axis.name}" is also an axis of another design: an axis of several'
                " parameters needs a unique name"
            )


def read_axes(
    entry: Entry | None, reader: AxisReader, taken: Iterable[str]
) -> tuple[Axis, ...]:
    """Return the axes of a design, in the order of the file.

    Parameters
    ----------
    entry : Entry or None
    reader : AxisReader
    taken : iterable of str
        Parameters with a value under another key.
    """
    entries = dict(entry.mapping()) if entry else {}
    axes = {}
    cells = 0
    mistakes = Mistakes()
    for name, child in entries.items():
        if is_ablation(child):
            continue
        with mistakes.noted():
            axes[name] = reader.read(name, child)
            cells += len(axes[name]) * len(axes[name].columns)
        if cells > MOST_CELLS:
            size = f"the axes up to this axis have {cells:,} cells"
            raise child.error(beyond(size, MOST_CELLS))
    mistakes.check()
    swept = (setting for axis in axes.values() for setting in axis.columns)
    valued = {*taken, *swept}
    ablations = [name for name in entries if name not in axes]
    if len(ablations) > 1:
        raise entries[ablations[1]].error(
            f'"{ablations[0]}" already has ablate: a study has at most one such axis'
        )
    axes |= {
        name: read_ablation(name, entries[name], reader, valued) for name in ablations
    }
    return tuple(axes[name] for name in entries)


def read_derive(
    entry: Entry | None, settings: dict[str, Setting]
) -> dict[str, Expression]:
    """Return the expressions under `derive` by parameter.

    Each expression follows the expressions that it needs.
    """
    unsorted: dict[str, Expression] = {}
    mistakes = Mistakes()
    for name, child in entry.mapping() if entry else ():
        with mistakes.noted():
            unsorted[name] = _derived(name, child, settings)
    mistakes.check()
    return in_order(entry, unsorted) if entry else {}


def _derived(name: str, entry: Entry, settings: dict[str, Setting]) -> Expression:
    if name not in settings:
        raise entry.error(unknown("parameter", name, settings))
    if name == "map":
        raise entry.error(
            "map cannot be derived, because further parameters depend on the map:"
            " sweep the map with zip or a table"
        )
    return read_expression(entry, settings, KINDS[settings[name].kind])


def in_order(entry: Entry, unsorted: Mapping[str, Expression]) -> dict[str, Expression]:
    """Return the expressions under `derive`, sorted.

    Each expression follows the expressions that it needs.
    """
    ordered: dict[str, Expression] = {}
    while len(ordered) < len(unsorted):
        pending = {name: unsorted[name] for name in unsorted if name not in ordered}
        ready = {
            name: expression
            for name, expression in pending.items()
            if not _read_by(expression, unsorted) & pending.keys()
        }
        if not ready:
            raise entry.child(next(iter(pending))).error(
                f"derive is circular: {', '.join(pending)}"
            )
        ordered |= ready
    return ordered


def _read_by(expression: Expression, derived: Container[str]) -> frozenset[str]:
    """Return the parameters whose values an expression reads.

    Parameters that determine one of the values are included.
    """
    left_out = {name for name in expression.names if name not in derived}
    return expression.names | {BROUGHT[name] for name in left_out & BROUGHT.keys()}


def check_once(
    root: Entry, fixed: Iterable[str], axes: tuple[Axis, ...], derive: Iterable[str]
) -> None:
    """Raise SpecError for a parameter with a value at two places.

    Parameters
    ----------
    root : Entry
        The whole spec.
    fixed : iterable of str
    axes : tuple of Axis
    derive : iterable of str
        Derived parameters.
    """
    for design in by_design(axes):
        places: list[tuple[str, Place]] = [(name, ("fixed", name)) for name in fixed]
        places += [
            (name, axis.place)
            for axis in design
            for name in axis.columns
            if not (axis.has_base and name in fixed)
        ]
        places += [(name, ("derive", name)) for name in derive]
        for name, count in Counter(name for name, _ in places).items():
            if count > 1:
                first, second = [place for other, place in places if other == name][:2]
                where = ".".join(map(str, first))
                raise root.document.error(
                    second, f'"{name}" already has a value, under {where}'
                )


def check_conditions(
    root: Entry, axes: tuple[Axis, ...], derive: Iterable[str]
) -> None:
    """Raise SpecError if `when` needs a parameter whose value is only known later.

    Parameters
    ----------
    root : Entry
        The whole spec.
    axes : tuple of Axis
    derive : iterable of str
        Derived parameters.
    """
    for design in by_design(axes):
        _check_conditions(root, design, derive)


def _check_conditions(
    root: Entry, axes: tuple[Axis, ...], derive: Iterable[str]
) -> None:
    later = dict.fromkeys(derive, "derived")
    later |= {
        name: f"swept by {axis.name}, which must come before"
        for axis in axes
        for name in axis.columns
    }
    for axis in axes:
        needed = axis.when.names if axis.when else frozenset()
        needed |= {BROUGHT[name] for name in needed & BROUGHT.keys()}
        for name in sorted(needed):
            if name in later:
                raise root.document.error(
                    (*axis.place, "when"),
                    f'when cannot use "{name}" here: "{name}" is {later[name]}',
                )
        for name in axis.columns:
            del later[name]


def check_complete(root: Entry, axes: tuple[Axis, ...]) -> None:
    """Raise SpecError if a condition could reject a part of a sample of blocks.

    The analysis needs all points of a sample of blocks.
    """
    sampled = [axis for axis in axes if axis.blocks]
    for other in sampled[1:]:
        message = (
            f'"{sampled[0].name}" is already a sample of blocks:'
            f" a study has at most one of {' or '.join(in_blocks())}"
        )
        raise root.document.error(other.place, message)
    for sample in sampled:
        if "require" in root.value:
            message = (
                f'require could reject points of "{sample.name}": a {sample.sampler}'
                " sample needs all points"
            )
            raise root.document.error(("require",), message)
        for axis in axes:
            if axis.when and axis.when.names & sample.columns.keys():
                message = (
                    f'when cannot use parameters of "{sample.name}":'
                    f" a {sample.sampler} sample needs all points"
                )
                raise root.document.error((*axis.place, "when"), message)


def read_require(
    entry: Entry | None, settings: dict[str, Setting]
) -> tuple[Expression, ...]:
    """Return the conditions under `require`."""
    conditions: list[Expression] = []
    mistakes = Mistakes()
    for child in entry.entries() if entry else ():
        with mistakes.noted():
            conditions.append(read_expression(child, settings, CONDITION))
    mistakes.check()
    return tuple(conditions)
