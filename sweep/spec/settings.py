"""Parameters of a model for users: by name, with unit, range and preset values."""

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
"""Values of a parameter at many points: float64, int64, bool, or object for strings."""

DTYPES: dict[str, type[Any]] = {
    "float": np.float64,
    "int": np.int64,
    "bool": np.bool_,
    "choice": np.object_,
    "places": np.object_,
}
MOST_PLACES = 100
"""Largest number of positions of a parameter."""
MOST_PLACE = 1e15
"""Largest distance of a position from the origin, along x and along y."""


USUAL_PRESET = "as_run"
TORUS = "torus"
WRAPS_ONLY = "wraps positions only: boids do not perceive each other across the borders"
"""Note on the torus of a preset without `minimum_image`."""
BROUGHT = {"width": "map", "height": "map", "minimum_image": "borders"}
"""Parameters that follow from another parameter if the spec gives no value."""


class NotAllowedError(ValueError):
    """A value that a parameter cannot have.

    `index` is the index of the value among several values.
    """

    def __init__(self, message: str, index: int = 0) -> None:
        super().__init__(message)
        self.index = index


@dataclass(frozen=True)
class Setting:
    """A parameter of a study.

    Attributes
    ----------
    name : str
        Name in specs.
    kind : {"float", "int", "bool", "choice", "places"}
    group : str
        Group of parameters, such as "world".
    text : str
        Description.
    unit : str, default ""
        Unit in the words of the model, "" for no unit.
    low, high : float
        Bounds of numbers, by default infinite.
    exclusive : bool, default False
        True if `low` itself is not allowed.
    choices : tuple of str
        Allowed names of a choice.
    rule : str, default ""
        The rule whose weight the parameter is.
    in_steps : bool, default False
        True if the parameter is counted in steps.
    each_step : EachStep, default ""
        Effect of a shorter step on the value, see `kernels.settings.InParts`.
    only_where : OnlyWhere, optional
        Condition under which the parameter has an effect.
    whole_steps : bool, default False
        True if the parameter is a time of an integer number of steps.
    spread_of : str, default ""
        Parameter that a spread varies from robot to robot.
    symbol : str, default ""
        Symbol in equations, in LaTeX.
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
    symbol: str = ""

    def in_parts(self, value: float, parts: float) -> float:
        """Return the value after each step is cut into shorter steps.

        Parameters
        ----------
        value : float
        parts : float
            Number of shorter steps per step. 1 / k reverses a cut into k.
        """
        if self.in_steps:
            return value * parts
        if self.each_step == "time":
            return value / parts
        if self.each_step == "share":
            return float(-math.expm1(math.log1p(-value) / parts)) if value < 1 else 1.0
        return value * math.sqrt(parts) if self.each_step == "noise" else value

    def coerce(self, value: Any) -> Value:
        """Return a value in the type of this parameter.

        So 1 and 1.0 give equal points, and so do -0 and 0. Raises NotAllowedError, with
        the allowed values, for a wrong type, a value out of range or an unknown choice.
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
            f"{shortened(repr(value))} is not allowed for {self.name}; allowed:"
            f" {self.allowed()}"
        )

    def as_entered(self, value: Value) -> Any:
        """Return a value in the form of a spec: positions are a list of pairs."""
        if self.kind != "places":
            return value
        rows = places_of(value) or ()
        return [[_whole(number) for number in row] for row in rows]

    def column(self, values: Sequence[Any] | Values) -> Values:
        """Return many values in the type of this parameter.

        Raises NotAllowedError for the first value that is not allowed.
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
        """Return whether a number, or each number of an array, is in range; not NaN."""
        above = value > self.low if self.exclusive else value >= self.low
        within = above & (value <= self.high)
        return within & (value % 1 == 0) if self.kind == "int" else within

    def allowed(self) -> str:
        """Return the allowed values, such as `a number from 0 to 360 (degrees)`."""
        if self.kind == "choice":
            return "one of " + ", ".join(self.choices)
        if self.kind == "bool":
            return "true or false"
        if self.kind == "places":
            unit = f" ({self.unit})" if self.unit else ""
            return (
                f"a list of up to {MOST_PLACES} positions [x, y]{unit}, or a string"
                f' such as "{in_a_line(((1, 2.5), (3, 4)))}"'
            )
        text = "an integer" if self.kind == "int" else "a number"
        if self.low > -math.inf:
            text += (
                f" above {_in_full(self.low)}"
                if self.exclusive
                else f" from {_in_full(self.low)}"
            )
        if self.high < math.inf:
            text += f" to {_in_full(self.high)}"
        return text + (f" ({self.unit})" if self.unit else "")


def _in_full(bound: float) -> str:
    return (
        f"{bound:,.0f}"
        if bound % 1 == 0 and 1e6 <= abs(bound) <= 1e15
        else f"{bound:g}"
    )


MOST_SPREAD = 10.0
"""Largest spread, with factors far from the limits of floats."""


class Settings(dict[str, Setting]):
    """Parameters of a model by name.

    `spreads` are further parameters, which are 0 if a spec does not name the parameter.
    `refused` has the reasons why further spreads do not exist.
    """

    def __init__(self, settings: Mapping[str, Setting], model: Model) -> None:
        super().__init__(settings)
        self.model = model

    @cached_property
    def spreads(self) -> dict[str, Setting]:
        """A parameter X_spread for each parameter X that is read robot by robot."""
        shared = abilities(self.model).shared
        names = [
            name
            for name in self.model.params._fields
            if self[name].kind == "float"
            and name not in shared
            and not self._of_records
        ]
        spreads = map(_spread, names)
        return {spread.name: spread for spread in spreads if spread.name not in self}

    @cached_property
    def refused(self) -> dict[str, str]:
        """The reasons, by name, why a spread does not exist."""
        allowed = [spread.spread_of for spread in self.spreads.values()]
        may = f"parameters that may differ: {', '.join(allowed)}"
        if not allowed:
            may = f"no parameter may differ: write `{LINE}`, and see docs/own-models.md"
        return {
            f"{name}_spread": f"{self._why(name)}; {may}"
            for name in self.keys() - allowed
            if f"{name}_spread" not in self
        }

    @property
    def _of_records(self) -> list[str]:
        """Parameters that cannot be read from a record of NumPy.

        The name of the parameter is already an attribute of records.
        """
        return [name for name in self.model.params._fields if hasattr(np.record, name)]

    def _why(self, name: str) -> str:
        """Return why a parameter cannot differ from robot to robot."""
        if taken := self._of_records:
            return f"{taken[0]} is an attribute of NumPy records: rename the parameter"
        if name not in self.model.params._fields:
            return f"{name} is not a parameter of {self.model.name} itself"
        if self[name].kind != "float":
            return f"{name} is not a real number, which a factor could change"
        return f"{self.model.name} does not read {name} robot by robot"

    def of_study(self, maps: Iterable[str]) -> "Settings":
        """Return all parameters of a study with custom maps of these names."""
        choices = (*self["map"].choices, *maps)
        drawn = {"map": replace(self["map"], choices=choices)}
        settings = Settings(self | drawn | self.spreads, self.model)
        settings.refused = self.refused
        return settings


def _spread(parameter: str) -> Setting:
    """Return the spread of a parameter, by which robots differ."""
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
    """Return positions as the string in tables, such as "1 2.5; 3 4".

    Numbers have all digits.
    """
    return "; ".join(f"{_shortest(x)} {_shortest(y)}" for x, y in places)


def _whole(number: float) -> float:
    return int(number) if number.is_integer() else number


def _shortest(number: float) -> str:
    return repr(float(number) + 0.0).removesuffix(".0")


def places_of(value: Any) -> Places | None:
    """Return the positions of a list of pairs, or of a string of `in_a_line`.

    None for a value that is not positions.
    """
    rows = value
    if isinstance(value, str):
        rows = [row.split() for row in value.split(";")] if value.strip() else []
    if not isinstance(rows, list | tuple) or len(rows) > MOST_PLACES:
        return None
    places = [_place(row, as_text=isinstance(value, str)) for row in rows]
    return None if None in places else tuple(place for place in places if place)


def _place(row: Any, *, as_text: bool) -> tuple[float, float] | None:
    if not isinstance(row, list | tuple) or len(row) != 2:
        return None
    kinds = (str,) if as_text else (int, float)
    if not all(isinstance(v, kinds) and not isinstance(v, bool) for v in row):
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


def _entered(
    name: str, declared: About, catalogue: Catalogue
) -> tuple[tuple[str, ...], str]:
    """Return the choices and the description of a parameter.

    The choices of maps and starts come from the catalogue.
    """
    if name == "map":
        return tuple(catalogue.maps), declared.text
    if name == "start_draws":
        texts = [f"{start}: {entry.text}" for start, entry in catalogue.starts.items()]
        return tuple(catalogue.starts), "; ".join(texts)
    return declared.choices, declared.text


def _setting(
    name: str, hint: Any, group: str, model: Model, catalogue: Catalogue
) -> Setting:
    base, declared, *further = get_args(hint)
    assert isinstance(declared, About)
    in_parts = [note.each_step for note in further if isinstance(note, InParts)]
    only_where = [note for note in further if isinstance(note, OnlyWhere)]
    choices, text = _entered(name, declared, catalogue)
    kind = "choice" if choices else "places" if base == Places else base.__name__
    unit = spelled(declared.unit, model)
    return Setting(
        name,
        kind,
        group,
        text=text,
        unit=unit,
        low=declared.low,
        high=declared.high,
        exclusive=declared.exclusive,
        choices=choices,
        rule=declared.rule,
        in_steps=declared.in_steps,
        each_step=in_parts[0] if in_parts else "",
        only_where=only_where[0] if only_where else None,
        whole_steps=declared.whole_steps,
        symbol=declared.symbol,
    )


@lru_cache(maxsize=256)
def settings_of(model: str, catalogue: Catalogue) -> Settings:
    """Return every parameter of the model of a name.

    The parameters of the model itself are first, then schedule, world, sensing,
    actuation, failures, medium, start and observation.
    """
    entry = catalogue.models[model]
    groups = (("parameters", entry.params), *GROUPS)
    described = {
        name: _setting(name, hint, group, entry, catalogue=catalogue)
        for group, settings in groups
        for name, hint in get_type_hints(settings, include_extras=True).items()
    }
    return Settings(described, entry)


def no_setting(
    name: str, settings: Iterable[str], keys: Container[str], more: str = ""
) -> str:
    """Return the message for a name that is not a parameter.

    Parameters
    ----------
    name : str
    settings : iterable of str
        Parameters.
    keys : container of str
        Keys of a whole spec, which may include the name.
    more : str, default ""
        End of the message if the name is not a key of a spec.
    """
    if name in keys:
        return (
            f'"{name}" is not a parameter but a key of the whole spec, with one value'
            ' for all points: write the key next to "model"'
        )
    return unknown("parameter", name, settings) + more


def usual_preset(model: Model) -> str:
    """Return the default preset of a model."""
    return USUAL_PRESET if USUAL_PRESET in model.presets else next(iter(model.presets))


def spelled(unit: str, model: Model) -> str:
    """Return a unit in the words of a model, such as px/step or m/s."""
    own = {"length": model.length, "time": model.time}
    return re.sub(r"\b(length|time)\b", lambda word: own[word[0]], unit)


def preset_settings(model: str, preset: str, catalogue: Catalogue) -> dict[str, Value]:
    """Return the value of every parameter in a preset of a model.

    Parameters
    ----------
    model : str
    preset : str
    catalogue : Catalogue
        Models by name.
    """
    values = catalogue.models[model].preset_values(preset)
    return {
        name: setting.coerce(values[name])
        for name, setting in settings_of(model, catalogue).items()
    }


def only_wrapping(model: Model) -> list[str]:
    """Return the presets of a model whose torus wraps positions only."""
    values = {name: model.preset_values(name) for name in model.presets}
    return [
        name
        for name, preset in values.items()
        if preset["borders"] == TORUS and not preset["minimum_image"]
    ]


def usual_settings(model: str, preset: str, catalogue: Catalogue) -> dict[str, Value]:
    """Return the value of every parameter in a preset, with spreads.

    Robots of a preset do not differ, so all spreads are 0.

    Parameters
    ----------
    model : str
    preset : str
    catalogue : Catalogue
        Models by name.
    """
    spreads = settings_of(model, catalogue).spreads
    return preset_settings(model, preset, catalogue) | dict.fromkeys(spreads, 0.0)


def settings_tuple(
    group: type[Any], settings: dict[str, Value], described: dict[str, Setting]
) -> Any:
    """Return a group of parameters, filled with values.

    Parameters
    ----------
    group : type
        A NamedTuple of `kernels.settings`, or Params of a model.
    settings : dict
        Values by parameter.
    described : dict
        Parameters by name.

    Returns
    -------
    NamedTuple
        Choices are indices, positions are numbers.
    """
    values: list[Any] = []
    for name in group._fields:
        setting = described[name]
        value = settings[name]
        if setting.kind == "choice" and name != "map":
            values.append(setting.choices.index(str(value)))
        else:
            values.append(places_of(value) if setting.kind == "places" else value)
    return group(*values)
