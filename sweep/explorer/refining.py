"""The change of a spec that puts more points into a region of a study, or more trials
at each point.

Points are added by a further design under `sweep`, whose points are united with those
that the spec has. So no point is lost, and the text of the other designs stays.
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

from sweep.design.design import Design, expand
from sweep.errors import ChoiceError
from sweep.spec.axes import DIGITS, Axis, by_design
from sweep.spec.distributions import DISTRIBUTIONS
from sweep.spec.document import Place
from sweep.spec.point_tables import TABLE
from sweep.spec.settings import Setting, Values
from sweep.spec.strict_yaml import parse_document
from sweep.spec.study import Study
from sweep.text import unknown

Range = tuple[float, float]
WIDTH = 2**16
MOST_PARTS = 100
ROUNDED = 1e-5
"""How far the end of a region is from the value that was meant: pages say 6 digits."""
EDGE = 1e-3
"""The part of an interval between two values that counts as its end: the ends of a
region are rounded.
"""
NARROWED = {
    name: one
    for name, one in DISTRIBUTIONS.items()
    if one.bounded and one.kind != "listed"
}
"""The distributions that are written as two numbers, between which they draw."""


@dataclass(frozen=True)
class Extension:
    """What is wanted: `between` has settings with the least and the largest value of
    the region. Each interval between two values there is divided into so many `parts`,
    by equal ratios for those that are `logarithmic`. A point then has so many
    `replicates`; 0 leaves their number as it is.
    """

    between: Mapping[str, Range]
    parts: int = 2
    replicates: int = 0
    logarithmic: Collection[str] = ()


def refined(study: Study, wanted: Extension) -> str:
    """The text of the spec of `study` with more points or replicates; comments stay.

    Raises ChoiceError where nothing is wanted, where a setting of the region does not
    vary, or is no number, where no value lies between two others, and where the design
    of the study counts only whole.
    """
    if not wanted.between and not wanted.replicates:
        raise ChoiceError(
            "nothing is to be refined: choose a region, a point or more replicates",
            study.name,
        )
    yaml, stream = YAML(), StringIO()
    yaml.preserve_quotes, yaml.width = True, WIDTH
    root = yaml.load(study.text)
    if wanted.between:
        added = _Refined(study, wanted).added()
        if not isinstance(root["sweep"], list):
            root["sweep"] = CommentedSeq([root["sweep"]])
        root["sweep"].append(
            CommentedMap((name, _in_a_line(axis)) for name, axis in added.items())
        )
    if wanted.replicates:
        root["replicates"] = _more_replicates(study, wanted.replicates)
    yaml.dump(root, stream)
    return stream.getvalue()


def _more_replicates(study: Study, wanted: int) -> int:
    """So many replicates, which are more than the spec has."""
    said = ""
    if study.rule:
        under = study.rule.place[0]
        said = f'a rule says how many there are: change max under "{under}"'
    elif study.replicates is None:
        said = "the spec lists its seeds: add some to them"
    elif wanted <= study.replicates:
        said = f"it has {study.replicates:,} already, and {wanted:,} are not more"
    if said:
        raise ChoiceError(f"replicates: {said}", study.name)
    return wanted


class _Refined:
    """A study and the region in which it is refined."""

    def __init__(self, study: Study, wanted: Extension) -> None:
        self.study, self.wanted = study, wanted
        if study.search or (study.rule and study.rule.adds_points):
            chooses = "a search"
            if study.rule:
                chooses = f'"{study.rule.place[-1]}" in the spec'
            raise ChoiceError(f"{chooses} chooses the points itself", study.name)
        if not 2 <= wanted.parts <= MOST_PARTS:
            raise ChoiceError(
                f"parts: {wanted.parts} is not allowed;"
                f" each interval is divided into 2 to {MOST_PARTS}",
                study.name,
            )
        self.design: Design = expand(study)
        for name in wanted.between:
            self._check(name)

    def _check(self, name: str) -> None:
        """Raise ChoiceError where a region has no numbers of a setting to divide."""
        columns, (low, high) = self.design.columns, self.wanted.between[name]
        if name not in columns:
            raise ChoiceError(
                unknown("setting that varies", name, columns), self.study.name
            )
        if self.setting(name).kind not in ("float", "int"):
            raise ChoiceError(
                f"{name}: its values have none between them", self.study.name
            )
        if not low <= high:
            raise ChoiceError(
                f"{name}: from {low:g} to {high:g} is no region", self.study.name
            )

    def setting(self, name: str) -> Setting:
        return self.study.settings[name]

    def added(self) -> dict[str, Any]:
        """The further design: the first of the spec whose axes have all settings of the
        region, with more points there.
        """
        for axis in self.study.axes:
            if axis.blocks or axis.ablated:
                raise ChoiceError(
                    f'"{axis.name}" counts only whole: no point can be added to it',
                    self.study.name,
                )
        document = parse_document(self.study.text, self.study.path)
        designs = by_design(self.study.axes)
        for axes in designs:
            names = {name for axis in axes for name in axis.columns}
            if self.wanted.between.keys() <= names:
                return {
                    self._name(axis, len(designs) + 1): self._axis(
                        axis, _at(document.value, axis.place)
                    )
                    for axis in axes
                }
        raise ChoiceError(
            f"no design sweeps all of {', '.join(self.wanted.between)}: one of them is"
            " derived, or comes with a map",
            self.study.name,
        )

    def _name(self, axis: Axis, number: int) -> str:
        """The name of an axis in the design of this number: one of several settings has
        a name of its own in each.
        """
        if axis.name in axis.columns:
            return axis.name
        taken = {*self.study.settings, *(other.name for other in self.study.axes)}
        while f"{axis.name}_{number}" in taken:
            number += 1
        return f"{axis.name}_{number}"

    def _axis(self, axis: Axis, written: Any) -> Any:
        """An axis of the further design, as a spec writes it."""
        inside = self.wanted.between.keys() & axis.columns.keys()
        drawn = axis.sampler not in (None, TABLE) and axis.name not in axis.columns
        if drawn and not inside:
            raise ChoiceError(
                f'"{axis.name}" would draw other points in a further design: choose a'
                " region of its settings too",
                self.study.name,
            )
        if not inside:
            return written
        form = next((one for one in NARROWED if one in written), None)
        if axis.name in axis.columns and form is None and _listed(written):
            values = self._finer(axis.name)
            kept = {"when": written["when"]} if "when" in written else {}
            return {"values": values, **kept} if kept else values
        points = _text_of(written).get("points")
        if points is None:
            raise ChoiceError(
                f'"{axis.name}" varies several settings together: add rows to it in'
                " the spec",
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
        """The distribution of a setting, within the region."""
        form = next((one for one in NARROWED if one in written), None)
        if form is None:
            raise ChoiceError(
                f"{name}: only {', '.join(NARROWED)} have a part that can be drawn"
                " from alone",
                self.study.name,
            )
        first, last = written[form]
        low, high = self.wanted.between[name]
        ends = [max(low, first), min(high, last)]
        if NARROWED[form].kind == "whole":
            ends = [math.ceil(ends[0]), math.floor(ends[1])]
        if not ends[0] < ends[1]:
            raise ChoiceError(
                f"{name}: nothing is drawn from {low:g} to {high:g};"
                f" the spec draws from {first:g} to {last:g}",
                self.study.name,
            )
        return {form: [_tidy(end) for end in ends]}

    def _drawn_points(self, axis: Axis) -> int:
        """As many points as make the region `parts` times as dense."""
        there = np.ones(len(axis), np.bool_)
        for name, (low, high) in self.wanted.between.items():
            if name in axis.columns:
                there &= _inside(axis.columns[name], low, high)
        return max(1, int(there.sum()) * (self.wanted.parts - 1))

    def _finer(self, name: str) -> list[float]:
        """The values of a setting in the region, each interval divided."""
        low, high = self.wanted.between[name]
        values = self._values(name)
        pairs = [pair for pair in pairwise(values) if _within(pair, low, high)]
        if not pairs:
            raise ChoiceError(
                f"{name}: no interval lies between {low:g} and {high:g}; its values go"
                f" from {values[0]:g} to {values[-1]:g}",
                self.study.name,
            )
        ends = {end for pair in pairs for end in pair}
        found = {value for pair in pairs for value in self._between(name, *pair)}
        if not found - ends:
            raise ChoiceError(
                f"{name}: no whole number lies between its values there",
                self.study.name,
            )
        return sorted(ends | found)

    def _values(self, name: str) -> list[float]:
        """The values that a setting has, ascending: at points within the region of all
        others, if there are any.
        """
        columns, there = self.design.columns, np.ones(self.design.n_points, np.bool_)
        for other, (low, high) in self.wanted.between.items():
            if other != name:
                there &= _inside(columns[other], low, high)
        column: Values = columns[name][there] if there.any() else columns[name]
        return sorted(set(column.tolist()))

    def _between(self, name: str, low: float, high: float) -> list[float]:
        """The values that divide an interval, without its ends."""
        steps = np.arange(1, self.wanted.parts) / self.wanted.parts
        if name in self.wanted.logarithmic and low > 0:
            values = low * (high / low) ** steps
        else:
            values = low + (high - low) * steps
        if self.setting(name).kind == "int":
            return [int(value) for value in np.rint(values)]
        return [_tidy(value) for value in values]


def _inside(column: Values, low: float, high: float) -> NDArray[np.bool_]:
    """Which values lie in a region, whose ends may have been rounded."""
    far = ROUNDED * max(abs(low), abs(high))
    return (column >= low - far) & (column <= high + far)


def _within(pair: Range, low: float, high: float) -> bool:
    """Whether an interval has a part in a region, or an end at one that is a value."""
    one, other = pair
    near = EDGE * (other - one)
    if high - low < near:
        return one - near <= low and high <= other + near
    return one + near < high and other - near > low


def _at(content: Any, place: Place) -> Any:
    """What stands at a place of plain values."""
    for part in place:
        content = content[part]
    return content


def _in_a_line(value: Any) -> Any:
    """A list or a mapping that is written in one line."""
    if isinstance(value, dict):
        made: Any = CommentedMap((key, _in_a_line(one)) for key, one in value.items())
    elif isinstance(value, list):
        made = CommentedSeq(map(_in_a_line, value))
    else:
        return value
    made.fa.set_flow_style()
    return made


def _listed(written: Any) -> bool:
    """Whether an axis of one setting is written as values."""
    forms = ("values", "linspace", "logspace")
    return isinstance(written, list) or any(form in written for form in forms)


def _text_of(written: Any) -> dict[str, Any]:
    return written if isinstance(written, dict) else {}


def _tidy(value: float) -> float:
    """A number with as many digits as a grid of a spec has; a whole one stays so."""
    return value if isinstance(value, int) else float(f"{value:.{DIGITS}g}")
