"""Choice of points by their parameters or by a condition.

Parameters are written `n=50,map=empty`, a condition `separation_weight >= 1`. Commands,
figures, claims and `study.where` all choose here. So all read strings, compare values
and reject mistakes in one way.
"""

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from sweep.analysis import agrees
from sweep.errors import ChoiceError
from sweep.spec import CONDITION, ExpressionError, Setting, parse
from sweep.text import SHORT_LIST, similar, unknown

FORM = "SETTING=VALUE[,SETTING=VALUE]"
SETTINGS = re.compile(r"\s*\w*\s*=(?!=)")
"""The beginning of a string of parameters."""
SIGNS = re.compile(r"[<>]|[=!]=|\b(?:and|or|not)\b")
"""Operators of conditions, which are absent from a string of parameters."""
CLOSEST = 3
BOOLEANS = {"true": True, "yes": True, "false": False, "no": False}

Choice = float | bool | str | tuple[float | bool | str, ...]
"""The required value of a parameter, or several values of which any is enough."""


class Restriction(NamedTuple):
    """Requirements of points: values of parameters, and conditions over parameters."""

    settings: dict[str, Choice]
    conditions: tuple[str, ...]


class Refusals:
    """The ChoiceErrors of a command, collected so that all are reported at once.

    Examples
    --------
    refusals = Refusals()
    with refusals.noted():
        metric = study_has(name)
    refusals.check()
    """

    def __init__(self) -> None:
        self._errors: list[ChoiceError] = []

    @contextmanager
    def noted(self) -> Iterator[None]:
        """Store a ChoiceError that ends the block, and continue after the block."""
        try:
            yield
        except ChoiceError as error:
            self._errors.append(error)

    def check(self) -> None:
        """Raise a ChoiceError with all stored errors, each on a separate line."""
        if len(self._errors) == 1:
            raise self._errors[0]
        if self._errors:
            raise ChoiceError("\n".join(dict.fromkeys(map(str, self._errors))))


@dataclass(frozen=True, eq=False)
class Chooser:
    """A choice among points by their parameters.

    Attributes
    ----------
    columns : mapping of str to array
        The values of each parameter, (points,), or the value of all points.
    points : int
        The number of points.
    study : str
        The name of the study, for errors.
    metrics : collection of str
        The columns of metrics. A metric in a condition is an error.
    """

    columns: Mapping[str, Any]
    points: int
    study: str = ""
    metrics: Collection[str] = ()

    def values(self, name: str) -> NDArray[Any]:
        """Return the value of a parameter at each point, (points,).

        Raises ChoiceError for an unknown parameter.
        """
        if name not in self.columns:
            no_setting = (
                _is_metric(name)
                if name in self.metrics
                else unknown("parameter", name, self.columns)
            )
            raise self._error(f"{no_setting} ({self._varying})")
        return np.broadcast_to(np.asarray(self.columns[name]), self.points)

    def read(self, texts: Iterable[str]) -> dict[str, Choice]:
        """Return the parameters for `having` from strings such as `map=empty,fov=90`.

        A number is written as in a spec, and a boolean as true or false, yes or no.
        Raises ChoiceError for another form, an unknown parameter, and a parameter that
        appears twice.
        """
        choices: dict[str, Choice] = {}
        for name, text in self.split(texts).items():
            if text is None:
                raise self._malformed(name)
            choices[name] = self.value(name, text)
        return choices

    def restriction(self, text: str, before: Restriction) -> Restriction:
        """Return a restriction extended by the parameters or condition in a string.

        Parameters
        ----------
        text : str
            For example `n=50,map=empty` or `n >= 50 and map != "empty"`.
        before : Restriction
            The restriction to extend.

        Raises
        ------
        ChoiceError
            As `read`, and for a parameter that `before` contains.
        """
        if SIGNS.search(text) and not SETTINGS.match(text):
            return before._replace(conditions=(*before.conditions, text))
        more = self.read([text])
        if twice := before.settings.keys() & more.keys():
            raise self._twice(min(twice))
        return before._replace(settings=before.settings | more)

    def names(self, condition: str) -> frozenset[str]:
        """Return the parameters in a condition that `holding` has accepted."""
        return parse(condition, self._settings).names

    def split(self, texts: Iterable[str]) -> dict[str, str | None]:
        """Return the names in strings such as `n=50`, with the string of each value.

        The value is None if no "=" follows the name. Raises ChoiceError for a name that
        is missing or appears twice.
        """
        values: dict[str, str | None] = {}
        for item in (item for text in texts for item in text.split(",")):
            name, equals, value = (part.strip() for part in item.partition("="))
            if not name:
                raise self._malformed(item)
            if name in values:
                raise self._twice(name)
            values[name] = value if equals else None
        return values

    def having(self, settings: Mapping[str, object]) -> NDArray[np.bool_]:
        """Return whether each point has all given parameter values, (points,).

        A list of values means any value of the list. Numbers are equal if nine digits
        agree, so that 0.3 finds 3 * 0.1. Raises ChoiceError for an unknown parameter,
        and for a value that no point has together with the parameters before it.
        """
        selected = np.ones(self.points, np.bool_)
        before: list[str] = []
        for name, choice in as_choices(settings).items():
            column = self.values(name)
            allowed = choice if isinstance(choice, tuple) else (choice,)
            if not allowed:
                raise self._error(f"{name} has an empty list of values; give a value")
            matching = [selected & agrees(column, value) for value in allowed]
            for value, each in zip(allowed, matching, strict=True):
                if not each.any():
                    raise self._error(_lacking(name, value, column[selected], before))
            selected = np.logical_or.reduce(matching)
            before.append(f"{name} = {_shown(choice)}")
        return selected

    def holding(self, condition: str) -> NDArray[np.bool_]:
        """Return whether a condition is true at each point, (points,).

        The condition is an expression over parameters, as in a spec, for example
        `n >= 50 and map != "empty"`. Raises ChoiceError for an expression that is no
        condition, for an unknown parameter, and if the condition is true at no point.
        """
        try:
            expression = parse(condition, self._settings)
            if expression.kind != CONDITION:
                raise ExpressionError(
                    f"the expression is {expression.kind}, not a condition"
                )
            holds = expression.evaluate(self.columns, self.points)
        except ExpressionError as error:
            metrics = self._metrics_in(condition)
            reason = f"{_is_metric(metrics[0])} ({self._varying})" if metrics else error
            raise self._error(f'"{condition}": {reason}') from None
        if not holds.any():
            settings = sorted(expression.names)
            available = [listed(name, self.values(name)) for name in settings]
            nowhere = f'"{condition}" is true at no point'
            raise self._error("; ".join([nowhere, *available]))
        return np.asarray(holds, np.bool_)

    @cached_property
    def _settings(self) -> dict[str, Setting]:
        """The parameters for expressions; the points define the allowed strings."""
        return {name: _as_setting(name, self.values(name)) for name in self.columns}

    def _metrics_in(self, condition: str) -> list[str]:
        """Return the metrics in a string that is no condition over parameters."""
        measured = {name: Setting(name, "float", "", "") for name in self.metrics}
        with suppress(ExpressionError):
            names = parse(condition, measured | self._settings).names
            return sorted(names - self.columns.keys())
        return []

    @property
    def _varying(self) -> str:
        varied = ", ".join(name for name in self.columns if self._varies(name))
        return f"the study varies {varied or 'none'}"

    @property
    def example(self) -> str:
        """A choice that some point has, of a varied parameter if there is one."""
        name = max(self.columns, key=self._varies, default="")
        return f"{name}={spelled(self.values(name)[0])}" if name else "n=50"

    def _varies(self, name: str) -> bool:
        return np.ndim(self.columns[name]) > 0

    def value(self, name: str, text: str) -> Choice:
        """Return the value that a string represents.

        Parameters
        ----------
        name : str
            The parameter, which has the type of the value.
        text : str
            The string. A string that is no number or boolean of that type is itself the
            value.

        Raises
        ------
        ChoiceError
            If the parameter is unknown.
        """
        kind = self.values(name).dtype.kind
        if kind == "b":
            return BOOLEANS.get(text.lower(), text)
        if kind in "iuf":
            with suppress(ValueError):
                return float(text.replace(".inf", "inf"))
        return text

    def _twice(self, name: str) -> ChoiceError:
        return self._error(f"{name} is given twice; allowed: one value")

    def _malformed(self, item: str) -> ChoiceError:
        return self._error(
            f'"{item}" chooses nothing; allowed: {FORM}, for example {self.example}'
        )

    def _error(self, reason: str) -> ChoiceError:
        return ChoiceError(reason, self.study)


def as_names(names: str | Iterable[str]) -> list[str]:
    """Return names as a list. One string is one name, not its letters."""
    return [names] if isinstance(names, str) else list(names)


def as_choices(settings: Mapping[str, object]) -> dict[str, Choice]:
    """Return parameters with plain values; lists and arrays become tuples."""
    return {name: _as_choice(value) for name, value in settings.items()}


def spelled(value: object) -> str:
    """Return the value of a parameter as a string that `Chooser.read` can read.

    Several values have "or" between them.
    """
    if isinstance(value, tuple):
        return " or ".join(map(spelled, value))
    if isinstance(value, bool | np.bool_):
        return "true" if value else "false"
    if isinstance(value, float):
        short = f"{value:g}"
        return short if agrees([float(short)], value)[0] else repr(float(value))
    return str(value)


def listed(name: str, column: NDArray[Any], near: object = None) -> str:
    """Return the values of a parameter in words.

    Parameters
    ----------
    name : str
        The parameter.
    column : array
        The values of the parameter, (points,).
    near : object, optional
        If `near` and the many values are numbers, only the closest values are listed.

    Returns
    -------
    str
        All different values if they are few, else some values.
    """
    values = list(dict.fromkeys(column.tolist()))
    if len(values) <= SHORT_LIST:
        return f"values of {name}: {', '.join(map(_shown, values))}"
    if _is_number(near) and column.dtype.kind in "iuf":
        closest = sorted(values, key=lambda value: abs(value - near))[:CLOSEST]
        return (
            f"the closest of {len(values):,} values: {', '.join(map(spelled, closest))}"
        )
    shown = ", ".join(map(_shown, values[:SHORT_LIST]))
    return f"values of {name}: {shown}, ..."


def _is_metric(name: str) -> str:
    return f"{name} is a metric, but points are chosen by parameters"


def _as_setting(name: str, column: NDArray[Any]) -> Setting:
    kind = {"b": "bool", "i": "int", "u": "int", "f": "float"}.get(column.dtype.kind)
    choices = () if kind else tuple(dict.fromkeys(map(str, column.tolist())))
    return Setting(name, kind or "choice", "", "", choices=choices)


def _as_choice(value: Any) -> Any:
    if isinstance(value, Iterable) and not isinstance(value, str):
        return tuple(map(_as_choice, value))
    return value.item() if isinstance(value, np.generic) else value


def _lacking(name: str, value: object, column: NDArray[Any], before: list[str]) -> str:
    """Return the error for a value that no point has, with the values of points."""
    of = f" with {', '.join(before)}" if before else ""
    texts = [text for text in dict.fromkeys(column.tolist()) if isinstance(text, str)]
    close = similar(str(value), texts)
    values = listed(name, column, value)
    values = f" {values[:1].upper()}{values[1:]}" if close else f"; {values}"
    return f"no point{of} has {name} = {_shown(value)}{close}{values}"


def _shown(value: object) -> str:
    """Return a value for a list; only quotes make an empty string visible."""
    return spelled(value) or '""'


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
