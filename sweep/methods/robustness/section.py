"""The section `validate` of a spec: the variants of the numerics that run again.

Variants have other time steps, another neighbour search or another order of updates.
All functions raise SpecError, with file and line, for values that are not allowed.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Annotated

from sweep.spec import (
    ALL_PAIRS,
    Content,
    Entry,
    Key,
    LaterSectionOf,
    ListOf,
    Mistakes,
    OneOf,
    Schema,
    Setting,
    SpecContext,
    read_section,
)

MOST_PARTS = 64
BOTH = "both"
UPDATE = "update"
PARTS = tuple(range(1, MOST_PARTS + 1))


@dataclass(frozen=True)
class StepParts(Content[int]):
    """A fraction of the time step, 1, 1/2, 1/3 ..., read as the number of parts."""

    @property
    def words(self) -> str:
        """The allowed values, in words."""
        return f"a fraction of the time step, 1, 1/2, 1/3 ... 1/{MOST_PARTS}"

    def read(self, entry: Entry) -> int:
        """Return the number of parts. SpecError if the value is not 1, 1/2, 1/3 ..."""
        value = entry.value
        if isinstance(value, str):
            numerator, _, parts = value.replace(" ", "").partition("/")
            if numerator == "1" and re.fullmatch("[1-9][0-9]{0,8}", parts):
                value = Fraction(1, int(parts))
        number = isinstance(value, int | float | Fraction) and value is not True
        cut = next((k for k in PARTS if number and abs(value * k - 1) < 1e-6), None)
        if cut is None:
            raise entry.expected(self.words)
        return cut

    def schema(self) -> Schema:
        """Return the allowed values as JSON Schema."""
        share = {"type": "number", "exclusiveMinimum": 0, "maximum": 1}
        return {"anyOf": [share, {"type": "string", "pattern": "^ *1 */ *[0-9]+ *$"}]}

    def write(self, value: int) -> str | int:
        """Return the number of parts in the form of a spec."""
        return 1 if value == 1 else f"1/{value}"


@dataclass(frozen=True, kw_only=True)
class Validate:
    """The keys of the section.

    `dt` has the number of parts into which each time step cuts the study's step.
    """

    dt: Annotated[
        tuple[int, ...],
        Key(
            ListOf(StepParts(), "fractions of the time step"),
            "shorter time steps, for a model with equations that are continuous in"
            " time. The study runs with each time step: with more steps for an equal"
            " simulated time. Parameters that act once per step are rescaled",
            otherwise="only the time step of the study",
            example="[1, 1/2, 1/4]",
        ),
    ] = ()
    search: Annotated[
        str | None,
        Key(
            OneOf("search", (ALL_PAIRS,)),
            "the study runs again with a neighbour search over all pairs of boids: the"
            " results must be bitwise identical",
            otherwise="only the search with the grid",
            example=ALL_PAIRS,
        ),
    ] = None
    update: Annotated[
        str | None,
        Key(
            OneOf("orders of updates", (BOTH,)),
            "the study runs again with the opposite order of updates",
            otherwise="only the order of the study",
            example=BOTH,
        ),
    ] = None


KEY = Key(
    LaterSectionOf(Validate),
    "different numerics for a repetition of the study: time steps, neighbour search and"
    " order of updates. `sweep validity` reports whether the conclusions hold",
    name="validate",
    otherwise="only the study itself",
)


def read_validate(root: Entry, _context: SpecContext) -> Validate:
    """Return the section, each key checked alone."""
    entry = root.child(KEY.name)
    section = read_section(Validate, entry)
    if {*section.dt} <= {1} and not section.search and not section.update:
        raise entry.error(
            '"validate" changes nothing: give a shorter time step, such as dt: [1/2],'
            " search: all_pairs or update: both"
        )
    return section


def check_validate(root: Entry, section: Validate, context: SpecContext) -> None:
    """Check that the model and the axes of a study suit the section.

    Parameters
    ----------
    root : Entry
        The root of the spec.
    section : Validate
        The value of the section.
    context : SpecContext
        Model, parameters and axes of the study.

    Raises
    ------
    SpecError
        The study cannot be run with other numerics, or has no conclusions: no axis has
        two values.
    """
    entry = root.child(KEY.name)
    mistakes = Mistakes()
    with mistakes.noted():
        if all(len(axis) < 2 for axis in context.axes or ()):
            raise entry.error(
                'there is nothing to conclude: "validate" compares the points along an'
                ' axis of "sweep" with at least two values'
            )
    with mistakes.noted():
        if section.dt and time_step(context.settings) is None:
            raise entry.child("dt").error(
                f"model {context.model} has no time step that could be shorter: no"
                " parameter declares that the equations are continuous in time"
                ' (InParts("time")); leave dt out'
            )
    with mistakes.noted():
        if section.update and UPDATE not in context.settings:
            raise entry.child("update").error(
                f'model {context.model} has no parameter "{UPDATE}", and so a single'
                " order of updates; leave update out"
            )
    mistakes.check()


def time_step(settings: Mapping[str, Setting]) -> str | None:
    """Return the parameter that is the time step.

    None for a model that is not continuous in time.
    """
    return next((name for name in settings if settings[name].each_step == "time"), None)
