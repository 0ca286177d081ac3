"""What an axis that is continued needs, and what cannot stand beside it.

All functions raise SpecError, with file and line.
"""

from collections.abc import Iterable, Mapping, Sequence

from sweep.spec.axes import Axis
from sweep.spec.axis_keys import HOLD
from sweep.spec.continuing import DIRECTION, PARENT
from sweep.spec.document import Entry
from sweep.spec.keys import check_beside
from sweep.spec.mistakes import Mistakes
from sweep.spec.settings import Setting

STEPS = "steps"
NUMBERS = ("float", "int")
LEAST = 2
"""Values without which there is no link after the first."""
OWN = "parameters"
"""The group of the settings that the model alone has."""
BARRED = {
    "order": "links run one after the other",
}
"""Keys that cannot stand beside a continued axis, and why."""
LONGER = (
    'a study with "continue" takes no "last_states": a link with more steps has another'
    " parent, and cannot go on from a shorter one"
)
KEPT = (
    'a study with "continue" keeps "last_flocks": each link begins where the one before'
    " it has ended; leave the key out"
)
COMMON = (
    "noise: common gives all links of a chain the same random numbers; with"
    ' "continue" it must be independent or lasting'
)


WITHIN = (
    ("record", "last_states", True, LONGER),
    ("record", "last_flocks", False, KEPT),
    ("streams", "noise", "common", COMMON),
)
"""Keys of sections that cannot stand there, with a value or, where that is None, with
any; and why.
"""


def continued_axis(axes: Iterable[Axis]) -> Axis | None:
    """The axis of a study that is continued, if any."""
    return next((axis for axis in axes if axis.continued), None)


def held(axes: Iterable[Axis]) -> dict[str, int]:
    """The steps of all links, as a setting with its value, where an axis says them."""
    axis = continued_axis(axes)
    hold = axis.continued.hold if axis and axis.continued else None
    return {} if hold is None else {STEPS: hold}


def check_beside_continued(root: Entry, axes: Iterable[Axis]) -> None:
    """Raise SpecError for what the spec says that cannot stand beside an axis that is
    continued. Other mistakes of these keys are for their readers.
    """
    if not continued_axis(axes):
        return
    mistakes = Mistakes()
    mistakes.read(check_beside, root, "continue", BARRED)
    for section, key, barred, why in WITHIN:
        with mistakes.noted():
            around = root.get(section)
            is_mapping = around is not None and isinstance(around.value, dict)
            found = around.get(key) if around and is_mapping else None
            if found and barred in (None, found.value):
                raise found.error(why)
    mistakes.check()


def check_continued(
    root: Entry,
    axes: Sequence[Axis],
    settings: Mapping[str, Setting],
    given: Iterable[str],
) -> None:
    """Raise SpecError for an axis that cannot be continued.

    root      the spec
    axes      its axes
    settings  those of its model
    given     the settings with a value under `fixed` or `derive`
    """
    found = [axis for axis in axes if axis.continued]
    if not found:
        return
    mistakes = Mistakes()
    with mistakes.noted():
        _check_alone(root, axes, found)
    for axis in found:
        with mistakes.noted():
            _check_axis(root, axis, settings[axis.name])
        with mistakes.noted():
            _check_columns(root, axis, settings)
        with mistakes.noted():
            _check_steps(root, axis, axes, given)
    mistakes.check()


def _entry(root: Entry, axis: Axis) -> Entry:
    entry = root
    for part in axis.place:
        entry = entry.child(part)
    return entry


def _check_alone(root: Entry, axes: Sequence[Axis], found: list[Axis]) -> None:
    if len({axis.design for axis in axes}) > 1:
        raise _entry(root, found[0]).error(
            f'"{found[0].name}" is continued, which one design alone can: write it as a'
            " study of its own"
        )
    if len(found) > 1:
        raise _entry(root, found[1]).error(
            f'"{found[0].name}" is continued already: a study has one such axis'
        )


def _check_axis(root: Entry, axis: Axis, setting: Setting) -> None:
    entry, name = _entry(root, axis), f'"{axis.name}" cannot be continued'
    if setting.kind not in NUMBERS:
        raise entry.error(f"{name}: its values are no numbers")
    if setting.group != OWN:
        raise entry.error(
            f"{name}: only a parameter of the model can change from link to link"
        )
    if axis.when:
        raise entry.error(f'{name}: it has a condition, "when"')
    if len(axis) < LEAST:
        raise entry.error(f"{name}: a chain needs at least {LEAST} values")


def _check_columns(root: Entry, axis: Axis, settings: Iterable[str]) -> None:
    """Raise SpecError for a model with a setting called as a column of links."""
    for name in {DIRECTION, PARENT} & {*settings}:
        raise _entry(root, axis).error(
            f'"{axis.name}" cannot be continued: the model has a setting "{name}", and'
            " tables of chains have such a column"
        )


def _check_steps(
    root: Entry, axis: Axis, axes: Sequence[Axis], given: Iterable[str]
) -> None:
    """Raise SpecError where `hold` is not the only one that says the steps."""
    if axis.continued is None or axis.continued.hold is None:
        return
    others = {*given, *(name for one in axes for name in one.columns)}
    if STEPS in others:
        raise (
            _entry(root, axis)
            .child(HOLD.name)
            .error(
                '"hold" says how many steps links take: leave "steps" out, or "hold"'
            )
        )
