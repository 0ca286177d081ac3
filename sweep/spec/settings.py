"""The settings of a model as users meet them: by name, with unit, range and preset
values.
"""

import math
import re
import sys
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from kernels.catalogue import Catalogue
from kernels.model import Model
from kernels.robots.abilities import abilities
from kernels.robots.readers import LINE
from kernels.settings import (
    About,
    Actuation,
    Breakdowns,
    EachStep,
    InParts,
    Medium,
    Observation,
    OnlyWhere,
    Places,
    Schedule,
    Sensing,
    StartSettings,
    WorldSettings,
)
from sweep.text import shortened, unknown

Value = float | int | bool | str
Values = NDArray[Any]
"""The values of one setting at many points: float64, int64, bool, or object holding
texts.
"""

DTYPES: dict[str, type[Any]] = {
    "float": np.float64,
    "int": np.int64,
    "bool": np.bool_,
    "choice": np.object_,
    "places": np.object_,
}
MOST_PLACES, MOST_PLACE = 100, 1e15
"""Of a setting of places: how many there may be, and how far from the origin."""


USUAL_PRESET = "as_run"
TORUS = "torus"
WRAPS_ONLY = "wraps positions only: boids do not see each other across its borders"
"""Of the torus of a preset that does not have `minimum_image`."""
BROUGHT = {"width": "map", "height": "map", "minimum_image": "borders"}
"""Settings that follow from another one where they are left out."""


class NotAllowedError(ValueError):
    """A value that a setting cannot have; `index` says which one, where there were
    several.
    """

    def __init__(self, message: str, index: int = 0) -> None:
        super().__init__(message)
        self.index = index


@dataclass(frozen=True)
class Setting:
    """One setting: `kind` is float, int, bool, choice or places; `low` and `high` bound
    the numbers. `rule` names the rule whose weight it is. `in_steps` says that it is
    counted in steps, `each_step` what a shorter step makes of it: see
    `kernels.settings.InParts`. Where `only_where` is given, it changes something only
    there. `whole_steps` says that it is a time of a whole number of steps. A spread
    names in `spread_of` the parameter that differs from robot to robot.
    """

    name: str
    kind: str
    group: str
    text: str
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    exclusive: bool = False
    choices: tuple[str, ...] = ()
    rule: str = ""
    in_steps: bool = False
    each_step: EachStep = ""
    only_where: OnlyWhere | None = None
    whole_steps: bool = False
    spread_of: str = ""

    def in_parts(self, value: float, parts: float) -> float:
        """What a value becomes where each step is cut into so many; with 1 / k, what it
        was before a step was cut into k.
        """
        if self.in_steps:
            return value * parts
        if self.each_step == "time":
            return value / parts
        if self.each_step == "share":
            return float(-math.expm1(math.log1p(-value) / parts)) if value < 1 else 1.0
        return value * math.sqrt(parts) if self.each_step == "noise" else value

    def coerce(self, value: Any) -> Value:
        """`value` in the type of this setting. So 1 and 1.0 are the same point, as are
        -0 and 0.

        Raises NotAllowedError, which says what is allowed, for another type, a value
        out of range or an unknown choice.
        """
        if self.kind == "choice" and isinstance(value, str):
            if value not in self.choices:
                raise NotAllowedError(unknown(self.name, value, self.choices))
            return value
        if self.kind == "bool" and isinstance(value, bool):
            return value
        if self.kind == "places" and (places := places_of(value)) is not None:
            return in_a_line(places)
        is_number = isinstance(value, float) or (
            isinstance(value, int)
            and not isinstance(value, bool)
            and abs(value) <= sys.float_info.max
        )
        if self.kind in ("float", "int") and is_number and self._in_range(value):
            return int(value) if self.kind == "int" else float(value) + 0.0
        raise NotAllowedError(
            f"{shortened(repr(value))} is not allowed for {self.name}: it is"
            f" {self.allowed()}"
        )

    def column(self, values: Sequence[Any] | Values) -> Values:
        """`coerce` for many values at once. Raises NotAllowedError for the first that
        is not.
        """
        if (
            isinstance(values, np.ndarray)
            and values.dtype.kind in "if"
            and self.kind in ("float", "int")
        ):
            with np.errstate(invalid="ignore"):
                wrong = np.flatnonzero(~self._in_range(values))
            if len(wrong) == 0:
                return (values + 0).astype(DTYPES[self.kind])
        coerced = []
        for index, value in enumerate(
            values.tolist() if isinstance(values, np.ndarray) else values
        ):
            try:
                coerced.append(self.coerce(value))
            except NotAllowedError as error:
                raise NotAllowedError(str(error), index) from None
        return np.array(coerced, dtype=DTYPES[self.kind])

    def _in_range(self, value: Any) -> Any:
        """Whether a number, or each number of an array, is in range; NaN never is."""
        above = value > self.low if self.exclusive else value >= self.low
        within = above & (value <= self.high)
        return within & (value % 1 == 0) if self.kind == "int" else within

    def allowed(self) -> str:
        """The allowed values in words, as `a number from 0 to 360 (degrees)`."""
        if self.kind == "choice":
            return "one of " + ", ".join(self.choices)
        if self.kind == "bool":
            return "true or false"
        if self.kind == "places":
            unit = f" ({self.unit})" if self.unit else ""
            return (
                f"a list of up to {MOST_PLACES} places [x, y]{unit}, or a text like"
                f' "{in_a_line(((1, 2.5), (3, 4)))}"'
            )
        words = "a whole number" if self.kind == "int" else "a number"
        if self.low > -math.inf:
            words += (
                f" above {_in_full(self.low)}"
                if self.exclusive
                else f" from {_in_full(self.low)}"
            )
        if self.high < math.inf:
            words += f" to {_in_full(self.high)}"
        return words + (f" ({self.unit})" if self.unit else "")


def _in_full(bound: float) -> str:
    return (
        f"{bound:,.0f}"
        if bound % 1 == 0 and 1e6 <= abs(bound) <= 1e15
        else f"{bound:g}"
    )


MOST_SPREAD = 10.0
"""Factors stay far from what numbers can be."""


class Settings(dict[str, Setting]):
    """Settings of a model by name.

    `spreads` are further ones: a setting X_spread for each parameter X that the model
    reads robot by robot. They are known where a spec names them, and 0 elsewhere.
    `refused` says of others why there is none.
    """

    def __init__(self, settings: Mapping[str, Setting], model: Model) -> None:
        super().__init__(settings)
        self.model = model

    @cached_property
    def spreads(self) -> dict[str, Setting]:
        shared = abilities(self.model).shared
        names = [
            name
            for name in self.model.params._fields
            if self[name].kind == "float"
            and name not in shared
            and not self._of_records
        ]
        return {one.name: one for one in map(_spread, names) if one.name not in self}

    @cached_property
    def refused(self) -> dict[str, str]:
        allowed = [one.spread_of for one in self.spreads.values()]
        may = f"those may differ: {', '.join(allowed)}"
        if not allowed:
            may = f"it reads none so: write `{LINE}`, and see docs/own-models.md"
        return {
            f"{name}_spread": f"{self._why(name)}; {may}"
            for name in self.keys() - allowed
            if f"{name}_spread" not in self
        }

    @property
    def _of_records(self) -> list[str]:
        """Parameters that cannot be read from a record: it has something else so."""
        return [name for name in self.model.params._fields if hasattr(np.record, name)]

    def _why(self, name: str) -> str:
        """Why a setting cannot differ from robot to robot."""
        if taken := self._of_records:
            return f"a record of NumPy has another {taken[0]}: give it another name"
        if name not in self.model.params._fields:
            return f"{name} is no parameter of {self.model.name}"
        if self[name].kind != "float":
            return f"{name} is no number with decimals, which a factor could change"
        return f"{self.model.name} does not read {name} robot by robot"

    def of_study(self, maps: Iterable[str]) -> "Settings":
        """Every setting that a study may name which brings maps with these names."""
        choices = (*self["map"].choices, *maps)
        drawn = {"map": replace(self["map"], choices=choices)}
        found = Settings(self | drawn | self.spreads, self.model)
        found.refused = self.refused
        return found


def _spread(parameter: str) -> Setting:
    """By how much a parameter differs from robot to robot."""
    return Setting(
        f"{parameter}_spread",
        "float",
        "parameters",
        f"standard deviation of the logarithms of the robots' factors of {parameter}",
        low=0.0,
        high=MOST_SPREAD,
        only_where=OnlyWhere(f"0 < abs({parameter}) < 1e299"),
        spread_of=parameter,
    )


def in_a_line(places: Places) -> str:
    """Places as the one text that stands for them in tables: "1 2.5; 3 4". Numbers have
    all their digits.
    """
    return "; ".join(f"{_shortest(x)} {_shortest(y)}" for x, y in places)


def _shortest(number: float) -> str:
    return repr(float(number) + 0.0).removesuffix(".0")


def places_of(value: Any) -> Places | None:
    """The places that a list of pairs gives, or a text of `in_a_line`; None where they
    are no places.
    """
    rows = value
    if isinstance(value, str):
        rows = [one.split() for one in value.split(";")] if value.strip() else []
    if not isinstance(rows, list | tuple) or len(rows) > MOST_PLACES:
        return None
    found = [_place(row, as_text=isinstance(value, str)) for row in rows]
    return None if None in found else tuple(one for one in found if one is not None)


def _place(row: Any, *, as_text: bool) -> tuple[float, float] | None:
    if not isinstance(row, list | tuple) or len(row) != 2:
        return None
    kinds = (str,) if as_text else (int, float)
    if not all(isinstance(one, kinds) and not isinstance(one, bool) for one in row):
        return None
    try:
        x, y = map(float, row)
    except (ValueError, OverflowError):
        return None
    return (x, y) if abs(x) <= MOST_PLACE and abs(y) <= MOST_PLACE else None


GROUPS: tuple[tuple[str, type[Any]], ...] = (
    ("schedule", Schedule),
    ("world", WorldSettings),
    ("sensing", Sensing),
    ("actuation", Actuation),
    ("failures", Breakdowns),
    ("medium", Medium),
    ("start", StartSettings),
    ("observation", Observation),
)


def _entered(name: str, about: About, known: Catalogue) -> tuple[tuple[str, ...], str]:
    """The choices of a setting, and what it is: maps and starts have entries of their
    own.
    """
    if name == "map":
        return tuple(known.maps), about.text
    if name == "start_draws":
        texts = [f"{start}: {entry.text}" for start, entry in known.starts.items()]
        return tuple(known.starts), "; ".join(texts)
    return about.choices, about.text


def _setting(
    name: str, hint: Any, group: str, model: Model, known: Catalogue
) -> Setting:
    base, about, *further = get_args(hint)
    assert isinstance(about, About)
    in_parts = [one.each_step for one in further if isinstance(one, InParts)]
    only_where = [one for one in further if isinstance(one, OnlyWhere)]
    choices, text = _entered(name, about, known)
    kind = "choice" if choices else "places" if base == Places else base.__name__
    unit = spelled(about.unit, model)
    return Setting(
        name,
        kind,
        group,
        text,
        unit,
        about.low,
        about.high,
        about.exclusive,
        choices,
        about.rule,
        about.in_steps,
        in_parts[0] if in_parts else "",
        only_where[0] if only_where else None,
        about.whole_steps,
    )


@lru_cache(maxsize=256)
def settings_of(model: str, known: Catalogue) -> Settings:
    """Every setting of the model of this name: its own parameters first, then schedule,
    world, sensing, actuation, failures, medium, start and observation.
    """
    about = known.models[model]
    groups = (("parameters", about.params), *GROUPS)
    found = {
        name: _setting(name, hint, group, about, known)
        for group, settings in groups
        for name, hint in get_type_hints(settings, include_extras=True).items()
    }
    return Settings(found, about)


def no_setting(
    name: str, known: Iterable[str], keys: Container[str], more: str = ""
) -> str:
    """What to say of a name that is none of the `known` settings; it may be one of the
    `keys` of a whole spec. If not, `more` follows.
    """
    if name in keys:
        return (
            f'"{name}" is no setting: it is a key of the whole spec, with one value for'
            ' all points, and stands beside "model"'
        )
    return unknown("setting", name, known) + more


def usual_preset(model: Model) -> str:
    """The preset of a model where none is named."""
    return USUAL_PRESET if USUAL_PRESET in model.presets else next(iter(model.presets))


def spelled(unit: str, model: Model) -> str:
    """A unit in the words of `model`: length and time are px and step, or m and s."""
    own = {"length": model.length, "time": model.time}
    return re.sub(r"\b(length|time)\b", lambda word: own[word[0]], unit)


def preset_settings(model: str, preset: str, known: Catalogue) -> dict[str, Value]:
    """The value of every setting in a preset of a model."""
    values = known.models[model].preset_values(preset)
    return {
        name: setting.coerce(values[name])
        for name, setting in settings_of(model, known).items()
    }


def only_wrapping(model: Model) -> list[str]:
    """The presets of a model whose torus wraps positions only."""
    values = {name: model.preset_values(name) for name in model.presets}
    return [
        name
        for name, one in values.items()
        if one["borders"] == TORUS and not one["minimum_image"]
    ]


def usual_settings(model: str, preset: str, known: Catalogue) -> dict[str, Value]:
    """The same with the spreads, by which robots of a preset do not differ."""
    spreads = settings_of(model, known).spreads
    return preset_settings(model, preset, known) | dict.fromkeys(spreads, 0.0)


def settings_tuple(
    group: type[Any], settings: dict[str, Value], known: dict[str, Setting]
) -> Any:
    """`group` (of kernels.settings, or a model's Params) filled from `settings`,
    choices as indices, places as numbers.
    """
    values: list[Any] = []
    for name in group._fields:
        setting, value = known[name], settings[name]
        if setting.kind == "choice" and name != "map":
            values.append(setting.choices.index(str(value)))
        else:
            values.append(places_of(value) if setting.kind == "places" else value)
    return group(*values)
