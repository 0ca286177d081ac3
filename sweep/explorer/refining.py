"""The change of a spec that adds points to a region of a study, or trials per point.

A further design under `sweep` adds the points. The points of the further design are
united with the present points of the spec. So no point is lost, and the text of the
present designs stays unchanged.
"""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from io import StringIO
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from sweep.design import Design, expand
from sweep.errors import ChoiceError
from sweep.spec import (
    DIGITS,
    DISTRIBUTIONS,
    TABLE,
    Axis,
    Place,
    Setting,
    Study,
    Values,
    by_design,
    parse_document,
)
from sweep.text import unknown

Range = tuple[float, float]
WIDTH = 2**16
MOST_PARTS = 100
ROUNDED = 1e-5
"""Relative error of the ends of a region: pages show 6 digits."""
EDGE = 1e-3
"""Fraction of a segment between two values that counts as an end of the segment.

The fraction is needed because the ends of a region are rounded.
"""
NARROWED = {
    name: distribution
    for name, distribution in DISTRIBUTIONS.items()
    if distribution.bounded and distribution.kind != "listed"
}
"""Distributions that draw between two numbers, which a spec states."""


@dataclass(frozen=True)
class Extension:
    """The additions to a spec.

    `between` has the least and the largest value of the region, by parameter. Each
    segment between two values in the region is divided into `parts`, by equal ratios
    for the parameters in `logarithmic`. `replicates` is the new number of trials per
    point; 0 keeps the number.
    """

    between: Mapping[str, Range]
    parts: int = 2
    replicates: int = 0
    logarithmic: Collection[str] = ()


def refined(study: Study, extension: Extension) -> str:
    """Return the text of the spec of a study with more points or replicates.

    Comments stay. Raises ChoiceError in the following cases:

    - the extension is empty
    - a parameter of the region does not vary, or is not a number
    - no value is between two values of a parameter
    - the design of the study counts only as a whole
    """
    if not extension.between and not extension.replicates:
        raise ChoiceError(
            "the refinement is empty; choose a region, a point or more replicates",
            study.name,
        )
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = WIDTH
    root = yaml.load(study.text)
    if extension.between:
        added = _Refined(study, extension).added()
        if not isinstance(root["sweep"], list):
            root["sweep"] = CommentedSeq([root["sweep"]])
        root["sweep"].append(
            CommentedMap((name, _in_a_line(axis)) for name, axis in added.items())
        )
    if extension.replicates:
        root["replicates"] = _more_replicates(study, extension.replicates)
    stream = StringIO()
    yaml.dump(root, stream)
    return stream.getvalue()


def _more_replicates(study: Study, replicates: int) -> int:
    """Return the new number of replicates.

    Raises ChoiceError if the spec already has this number, or a number that cannot be
    changed.
    """
    obstacle = ""
    if study.rule:
        under = study.rule.place[0]
        obstacle = (
            f'a rule decides the number of replicates; change max under "{under}"'
        )
    elif study.replicates is None:
        obstacle = "the spec lists seeds; add seeds to the list"
    elif replicates <= study.replicates:
        obstacle = (
            f"the spec has {study.replicates:,} replicates; give more,"
            f" not {replicates:,}"
        )
    if obstacle:
        raise ChoiceError(f"replicates: {obstacle}", study.name)
    return replicates


class _Refined:
    """A study and the region in which it is refined."""

    def __init__(self, study: Study, extension: Extension) -> None:
        self.study = study
        self.extension = extension
        rule = study.rule
        if study.strategy_section and (rule is None or rule.adds_points):
            section, _ = study.strategy_section
            message = f'"{section.key.name}" in the spec chooses the points'
            raise ChoiceError(message, study.name)
        if not 2 <= extension.parts <= MOST_PARTS:
            raise ChoiceError(
                f"parts: {extension.parts} is not allowed;"
                f" use 2 to {MOST_PARTS} parts per segment",
                study.name,
            )
        self.design: Design = expand(study)
        for name in extension.between:
            self._check(name)

    def _check(self, name: str) -> None:
        """Raise ChoiceError if a region has no numbers of a parameter to divide."""
        columns = self.design.columns
        low, high = self.extension.between[name]
        if name not in columns:
            raise ChoiceError(
                unknown("varying parameter", name, columns), self.study.name
            )
        if self.setting(name).kind not in ("float", "int"):
            raise ChoiceError(f"{name}: only numbers can be refined", self.study.name)
        if not low <= high:
            raise ChoiceError(
                f"{name}: {low:g} to {high:g} is not a region", self.study.name
            )

    def setting(self, name: str) -> Setting:
        return self.study.settings[name]

    def added(self) -> dict[str, Any]:
        """Return the further design in the form of a spec.

        The further design is the first design of the spec whose axes have all
        parameters of the region, with more points in the region.
        """
        for axis in self.study.axes:
            if axis.blocks or axis.ablated:
                raise ChoiceError(
                    f'"{axis.name}" counts only as a whole; no point can be added',
                    self.study.name,
                )
        document = parse_document(self.study.text, self.study.path)
        designs = by_design(self.study.axes)
        for axes in designs:
            names = {name for axis in axes for name in axis.columns}
            if self.extension.between.keys() <= names:
                return {
                    self._name(axis, len(designs) + 1): self._axis(
                        axis, _at(document.value, axis.place)
                    )
                    for axis in axes
                }
        raise ChoiceError(
            f"no design sweeps all of {', '.join(self.extension.between)}, because a"
            " parameter is derived or comes with a map",
            self.study.name,
        )

    def _name(self, axis: Axis, number: int) -> str:
        """Return the name of an axis in the design of this number.

        An axis of several parameters has a distinct name in each design.
        """
        if axis.name in axis.columns:
            return axis.name
        taken = {*self.study.settings, *(other.name for other in self.study.axes)}
        while f"{axis.name}_{number}" in taken:
            number += 1
        return f"{axis.name}_{number}"

    def _axis(self, axis: Axis, written: Any) -> Any:
        """Return an axis of the further design in the form of a spec."""
        inside = self.extension.between.keys() & axis.columns.keys()
        drawn = axis.sampler not in (None, TABLE) and axis.name not in axis.columns
        if drawn and not inside:
            raise ChoiceError(
                f'"{axis.name}" would draw new points in a further design; choose a'
                " region of its parameters too",
                self.study.name,
            )
        if not inside:
            return written
        form = _narrowed_form(written)
        if axis.name in axis.columns and form is None and _listed(written):
            values = self._finer(axis.name)
            condition = {"when": written["when"]} if "when" in written else {}
            return {"values": values, **condition} if condition else values
        points = _text_of(written).get("points")
        if points is None:
            raise ChoiceError(
                f'"{axis.name}" varies several parameters together; add rows to the'
                " axis in the spec",
                self.study.name,
            )
        changed = {**written, "points": self._drawn_points(axis)}
        for name in inside:
            if name == axis.name:
                changed |= self._narrowed(name, written)
            else:
                changed[name] = self._narrowed(name, written[name])
        return changed

    def _narrowed(self, name: str, written: Any) -> dict[str, Any]:
        """Return the distribution of a parameter, within the region."""
        form = _narrowed_form(written)
        if form is None:
            raise ChoiceError(
                f"{name}: cannot draw from a region of this distribution; allowed:"
                f" {', '.join(NARROWED)}",
                self.study.name,
            )
        first, last = written[form]
        low, high = self.extension.between[name]
        ends = [max(low, first), min(high, last)]
        if NARROWED[form].kind == "whole":
            ends = [math.ceil(ends[0]), math.floor(ends[1])]
        if not ends[0] < ends[1]:
            raise ChoiceError(
                f"{name}: {low:g} to {high:g} is outside the distribution;"
                f" the spec draws from {first:g} to {last:g}",
                self.study.name,
            )
        return {form: [_tidy(end) for end in ends]}

    def _drawn_points(self, axis: Axis) -> int:
        """Return the number of points that make the region `parts` times as dense."""
        is_inside = np.ones(len(axis), np.bool_)
        for name, (low, high) in self.extension.between.items():
            if name in axis.columns:
                is_inside &= _inside(axis.columns[name], low, high)
        return max(1, int(is_inside.sum()) * (self.extension.parts - 1))

    def _finer(self, name: str) -> list[float]:
        """Return the values of a parameter in the region, each segment divided."""
        low, high = self.extension.between[name]
        values = self._values(name)
        pairs = [pair for pair in pairwise(values) if _within(pair, low, high)]
        if not pairs:
            raise ChoiceError(
                f"{name}: no segment is between {low:g} and {high:g}; the values go"
                f" from {values[0]:g} to {values[-1]:g}",
                self.study.name,
            )
        ends = {end for pair in pairs for end in pair}
        divided = {value for pair in pairs for value in self._between(name, *pair)}
        if not divided - ends:
            raise ChoiceError(
                f"{name}: no integer is between the values in the region",
                self.study.name,
            )
        return sorted(ends | divided)

    def _values(self, name: str) -> list[float]:
        """Return the values of a parameter, ascending.

        If there are points within the region of all other parameters, only these
        points count.
        """
        columns = self.design.columns
        is_inside = np.ones(self.design.n_points, np.bool_)
        for other, (low, high) in self.extension.between.items():
            if other != name:
                is_inside &= _inside(columns[other], low, high)
        column: Values = columns[name][is_inside] if is_inside.any() else columns[name]
        return sorted(set(column.tolist()))

    def _between(self, name: str, low: float, high: float) -> list[float]:
        """Return the values that divide a segment, without the ends."""
        steps = np.arange(1, self.extension.parts) / self.extension.parts
        if name in self.extension.logarithmic and low > 0:
            values = low * (high / low) ** steps
        else:
            values = low + (high - low) * steps
        if self.setting(name).kind == "int":
            return [int(value) for value in np.rint(values)]
        return [_tidy(value) for value in values]


def _inside(column: Values, low: float, high: float) -> NDArray[np.bool_]:
    """Return which values are in a region, shape (P,).

    The ends of the region may have been rounded.
    """
    far = ROUNDED * max(abs(low), abs(high))
    return (column >= low - far) & (column <= high + far)


def _within(pair: Range, low: float, high: float) -> bool:
    """Return whether a segment has a part in a region.

    A region of a single value contains the segments that end at the value.
    """
    start, end = pair
    near = EDGE * (end - start)
    if high - low < near:
        return start - near <= low and high <= end + near
    return start + near < high and end - near > low


def _at(content: Any, place: Place) -> Any:
    """Return the content at a path in plain values."""
    for part in place:
        content = content[part]
    return content


def _in_a_line(value: Any) -> Any:
    """Return a list or a mapping that YAML writes in a single line."""
    if isinstance(value, dict):
        node: Any = CommentedMap(
            (key, _in_a_line(content)) for key, content in value.items()
        )
    elif isinstance(value, list):
        node = CommentedSeq(map(_in_a_line, value))
    else:
        return value
    node.fa.set_flow_style()
    return node


def _listed(written: Any) -> bool:
    """Return whether an axis of a single parameter is written as values."""
    forms = ("values", "linspace", "logspace")
    return isinstance(written, list) or any(form in written for form in forms)


def _narrowed_form(written: Any) -> str | None:
    """Return the key of a distribution with two bounds; None without this key."""
    return next((form for form in NARROWED if form in written), None)


def _text_of(written: Any) -> dict[str, Any]:
    return written if isinstance(written, dict) else {}


def _tidy(value: float) -> float:
    """Return a number with the digits of a grid of a spec.

    An integer stays an integer.
    """
    return value if isinstance(value, int) else float(f"{value:.{DIGITS}g}")
