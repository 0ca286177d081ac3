"""The check that a model declares its parameters and has valid presets."""

import math
from typing import Any, get_args, get_type_hints

from kernels.settings import UNITS, About
from sweep.spec import GROUPS, NotAllowedError
from sweep.testing.flights import broken_demands
from sweep.testing.places import of_field, of_setting, of_value
from sweep.testing.subject import Subject
from sweep.text import similar, unknown

KINDS = (float, int, bool)


def settings(subject: Subject) -> None:
    """Check that every parameter has a text and a unit, and a number a range."""
    model = subject.model
    common = {name for _, group in GROUPS for name in group._fields}
    hints = get_type_hints(model.params, include_extras=True)
    for name, hint in hints.items():
        if wrong := _wrong_with(name, hint, common):
            raise AssertionError(f'{of_setting(model, name)}: "{name}" {wrong}')
    if "dt" not in hints:
        raise AssertionError(
            f'{of_field(model, "params")}: there is no parameter "dt", the time of one'
            " update; add dt to the parameters of the model"
        )


def _wrong_with(name: str, hint: Any, common: set[str]) -> str | None:
    """Return the error in one parameter, with a fix; None for a valid parameter."""
    kind, *notes = get_args(hint) or (hint,)
    if not notes or not isinstance(notes[0], About):
        return 'has no About; write Annotated[float, About("...", "length")]'
    declared: About = notes[0]
    if kind not in KINDS:
        return f"is of type {kind.__name__}; allowed: float, int, bool"
    if name in common:
        return "is a parameter that all models have; choose another name"
    if not declared.text.strip():
        return "has no text; write the meaning into About"
    if declared.unit not in UNITS:
        units = ", ".join(f'"{unit}"' for unit in UNITS)
        return f'has the unknown unit "{declared.unit}"; allowed: {units}'
    if kind is bool or declared.choices:
        return None
    if math.isinf(declared.low) and math.isinf(declared.high):
        return "has no range; give low or high in About"
    if declared.low > declared.high:
        limits = f"{declared.low:g} to {declared.high:g}"
        return f"has the empty range {limits}; change low or high"
    return None


def presets(subject: Subject) -> None:
    """Check that every preset has a valid value of every parameter, and no more.

    In addition, the conditions of the model must be true, the metrics of the model must
    be known, and studies must be able to name the model.
    """
    model = subject.model
    if not model.presets:
        raise AssertionError(f"{of_field(model, 'presets')}: there is no preset")
    for preset in model.presets:
        _check_preset(subject, preset, model.preset_values(preset))
    for name in model.metrics:
        if name not in subject.catalogue.metrics:
            message = unknown("metric", name, subject.catalogue.metrics)
            raise AssertionError(f"{of_field(model, 'metrics')}: {message}")
    if subject.refused:
        raise AssertionError(f"{of_field(model, 'name')}: {subject.refused}")


def _check_preset(subject: Subject, preset: str, values: dict[str, Any]) -> None:
    model = subject.model
    declared = subject.settings
    for name in declared:
        if name not in values:
            raise AssertionError(
                f'{of_field(model, "presets")}: preset "{preset}" has no value for'
                f' "{name}"; a preset needs a value for every parameter'
            )
    for name, value in values.items():  # of_value reads the file
        if name not in declared:
            raise AssertionError(
                f'{of_value(model, name)}: preset "{preset}" has "{name}", which is no'
                f" parameter{similar(name, list(declared))}"
            )
        try:
            declared[name].coerce(value)
        except NotAllowedError as error:
            place = of_value(model, name)
            raise AssertionError(f'{place}: preset "{preset}": {error}') from None
    if messages := broken_demands(subject, values):
        place = of_field(model, "presets")
        raise AssertionError(f'{place}: preset "{preset}": {messages[0]}')
