"""Checks of continued axes and of the keys that exclude a continued axis.

The checks raise SpecError, with file and line.
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
"""Least number of values of a continued axis, so that a chain has several links."""
OWN = "parameters"
"""Group of the parameters that only the model has."""
BARRED = {
    "order": "links run in the order of the chain",
}
"""Keys that a study with a continued axis cannot have, each with the reason."""
LONGER = (
    'a study with "continue" takes no "last_states": a link with more steps has a'
    " different parent, and cannot resume from a shorter link"
)
KEPT = (
    'a study with "continue" keeps "last_flocks", because each link starts from the'
    " final flock of the previous link; remove the key"
)
COMMON = (
    "noise: common gives all links of a chain equal random numbers; with"
    ' "continue" it must be independent or lasting'
)
WITHIN = (
    ("record", "last_states", True, LONGER),
    ("record", "last_flocks", False, KEPT),
    ("streams", "noise", "common", COMMON),
)
"""Keys that a study with a continued axis cannot have.

Each row is (section, key, value, reason). The value None means any value.
"""


def continued_axis(axes: Iterable[Axis]) -> Axis | None:
    """Return the continued axis of a study; None without a continued axis."""
    return next((axis for axis in axes if axis.continued), None)


def held(axes: Iterable[Axis]) -> dict[str, int]:
    """Return {"steps": number of steps of a link}; {} without `hold`."""
    axis = continued_axis(axes)
    hold = axis.continued.hold if axis and axis.continued else None
    return {} if hold is None else {STEPS: hold}


def check_beside_continued(root: Entry, axes: Iterable[Axis]) -> None:
    """Raise SpecError for all keys that a study with a continued axis cannot have.

    Further mistakes in the values of the keys are reported by the readers of the keys.
    """
    if not continued_axis(axes):
        return
    mistakes = Mistakes()
    mistakes.read(check_beside, root, "continue", BARRED)
    for section, key, barred, why in WITHIN:
        with mistakes.noted():
            around = root.get(section)
            is_mapping = around is not None and isinstance(around.value, dict)
            entry = around.get(key) if around and is_mapping else None
            if entry and barred in (None, entry.value):
                raise entry.error(why)
    mistakes.check()


def check_continued(
    root: Entry,
    axes: Sequence[Axis],
    settings: Mapping[str, Setting],
    taken: Iterable[str],
) -> None:
    """Check that the continued axes of a study are allowed.

    Parameters
    ----------
    root : Entry
        The whole spec.
    axes : sequence of Axis
        All axes of the study.
    settings : mapping
        The parameters of the model by name.
    taken : iterable of str
        Parameters with a value under `fixed` or `derive`.

    Raises
    ------
    SpecError
        With all mistakes, if an axis cannot be continued.
    """
    continued = [axis for axis in axes if axis.continued]
    if not continued:
        return
    mistakes = Mistakes()
    with mistakes.noted():
        _check_alone(root, axes, continued)
    for axis in continued:
        with mistakes.noted():
            _check_axis(root, axis, settings[axis.name])
        with mistakes.noted():
            _check_columns(root, axis, settings)
        with mistakes.noted():
            _check_steps(root, axis, axes, taken)
    mistakes.check()


def _entry(root: Entry, axis: Axis) -> Entry:
    entry = root
    for part in axis.place:
        entry = entry.child(part)
    return entry


def _check_alone(root: Entry, axes: Sequence[Axis], continued: list[Axis]) -> None:
    name = continued[0].name
    if len({axis.design for axis in axes}) > 1:
        raise _entry(root, continued[0]).error(
            f'"{name}" has "continue", which excludes several designs: write a'
            " separate study"
        )
    if len(continued) > 1:
        raise _entry(root, continued[1]).error(
            f'"{name}" already has "continue": a study has at most one continued axis'
        )


def _check_axis(root: Entry, axis: Axis, setting: Setting) -> None:
    entry = _entry(root, axis)
    problem = f'"{axis.name}" cannot be continued'
    if setting.kind not in NUMBERS:
        raise entry.error(f"{problem}: the values are not numbers")
    if setting.group != OWN:
        raise entry.error(
            f"{problem}: only parameters of the model can change from link to link"
        )
    if axis.when:
        raise entry.error(f'{problem}: the axis has a condition, "when"')
    if len(axis) < LEAST:
        raise entry.error(f"{problem}: a chain needs at least {LEAST} values")


def _check_columns(root: Entry, axis: Axis, settings: Iterable[str]) -> None:
    """Raise SpecError if a parameter of the model has the name of a column of links."""
    for name in {DIRECTION, PARENT} & {*settings}:
        raise _entry(root, axis).error(
            f'"{axis.name}" cannot be continued: "{name}" is a parameter of the model,'
            " and also a column of tables of chains"
        )


def _check_steps(
    root: Entry, axis: Axis, axes: Sequence[Axis], taken: Iterable[str]
) -> None:
    """Raise SpecError if the spec has `hold` and also a value of `steps`."""
    if axis.continued is None or axis.continued.hold is None:
        return
    varied = {name for any_axis in axes for name in any_axis.columns}
    if STEPS in {*taken, *varied}:
        raise (
            _entry(root, axis)
            .child(HOLD.name)
            .error(
                '"hold" and "steps" both give the number of steps of a link: remove'
                ' "steps" or "hold"'
            )
        )
