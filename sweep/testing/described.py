"""That a model says all of its settings, and gives them values that can be."""

import math
from typing import Any, get_args, get_type_hints

from kernels.settings import UNITS, About
from sweep.spec.settings import GROUPS, NotAllowedError
from sweep.testing.flights import broken_demands
from sweep.testing.places import of_field, of_setting, of_value
from sweep.testing.subject import Subject
from sweep.text import similar, unknown

KINDS = (float, int, bool)


def settings(subject: Subject) -> None:
    """Every setting has a text and a unit, every number a range."""
    model = subject.model
    common = {name for _, group in GROUPS for name in group._fields}
    hints = get_type_hints(model.params, include_extras=True)
    for name, hint in hints.items():
        if wrong := _wrong_with(name, hint, common):
            raise AssertionError(f'{of_setting(model, name)}: "{name}" {wrong}')
    if "dt" not in hints:
        raise AssertionError(
            f'{of_field(model, "params")}: there is no setting "dt", the time of one'
            " update; add it to the settings of the model"
        )


def _wrong_with(name: str, hint: Any, common: set[str]) -> str | None:
    """What is wrong with one setting, and the way out."""
    kind, *about = get_args(hint) or (hint,)
    if not about or not isinstance(about[0], About):
        return 'says nothing of itself; write Annotated[float, About("...", "length")]'
    said: About = about[0]
    if kind not in KINDS:
        return f"is of type {kind.__name__}; allowed: float, int, bool"
    if name in common:
        return "is a setting that all models have; choose another name"
    if not said.text.strip():
        return "has no text; say in About what it means"
    if said.unit not in UNITS:
        units = ", ".join(f'"{unit}"' for unit in UNITS)
        return f'has the unknown unit "{said.unit}"; allowed: {units}'
    if kind is bool or said.choices:
        return None
    if math.isinf(said.low) and math.isinf(said.high):
        return "has no range; give About its low, its high, or both"
    if said.low > said.high:
        return f"has the empty range {said.low:g} to {said.high:g}; change low or high"
    return None


def presets(subject: Subject) -> None:
    """Every preset has an allowed value for each setting and for nothing else, its
    conditions hold, and the metrics exist.
    """
    model = subject.model
    if not model.presets:
        raise AssertionError(f"{of_field(model, 'presets')}: there is no preset")
    for preset in model.presets:
        _check_preset(subject, preset, model.preset_values(preset))
    for name in model.metrics:
        if name not in subject.known.metrics:
            said = unknown("metric", name, subject.known.metrics)
            raise AssertionError(f"{of_field(model, 'metrics')}: {said}")
    if subject.refused:
        raise AssertionError(f"{of_field(model, 'name')}: {subject.refused}")


def _check_preset(subject: Subject, preset: str, values: dict[str, Any]) -> None:
    model, about = subject.model, subject.settings
    for name in about:
        if name not in values:
            raise AssertionError(
                f'{of_field(model, "presets")}: preset "{preset}" gives "{name}" no'
                " value; every preset gives one to every setting"
            )
    for name, value in values.items():  # looking for the place of one reads the file
        if name not in about:
            raise AssertionError(
                f'{of_value(model, name)}: preset "{preset}" has "{name}", which is no'
                f" setting{similar(name, list(about))}"
            )
        try:
            about[name].coerce(value)
        except NotAllowedError as error:
            place = of_value(model, name)
            raise AssertionError(f'{place}: preset "{preset}": {error}') from None
    if said := broken_demands(subject, values):
        place = of_field(model, "presets")
        raise AssertionError(f'{place}: preset "{preset}": {said[0]}')
