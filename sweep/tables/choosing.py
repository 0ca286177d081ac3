"""The one chooser of points by their settings: `n=50,map=empty`, or by a condition,
`separation_weight >= 1`.

Commands, figures, claims and `study.where` choose here. Texts are read, values are
compared, and what cannot be chosen is refused, in one way for all of them.
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
from sweep.spec.evaluation import ExpressionError
from sweep.spec.expressions import CONDITION, parse
from sweep.spec.settings import Setting
from sweep.text import SHORT_LIST, similar, unknown

FORM = "SETTING=VALUE[,SETTING=VALUE]"
SETTINGS = re.compile(r"\s*\w*\s*=(?!=)")
"""How a text of settings begins."""
SIGNS = re.compile(r"[<>]|[=!]=|\b(?:and|or|not)\b")
"""What a condition has, and settings alone have not."""
CLOSEST = 3
BOOLEANS = {"true": True, "yes": True, "false": False, "no": False}

Choice = float | bool | str | tuple[float | bool | str, ...]
"""The value of a setting that points are to have, or several, of which one."""


class Restriction(NamedTuple):
    """What points are to have: settings, and conditions over settings."""

    settings: dict[str, Choice]
    conditions: tuple[str, ...]


class Refusals:
    """Gathers the ChoiceErrors of one command, so that all are said at once:

    refusals = Refusals()
    with refusals.noted():
        metric = study_has(name)
    refusals.check()
    """

    def __init__(self) -> None:
        self._found: list[ChoiceError] = []

    @contextmanager
    def noted(self) -> Iterator[None]:
        """A ChoiceError that ends this block is noted, and what follows goes on."""
        try:
            yield
        except ChoiceError as error:
            self._found.append(error)

    def check(self) -> None:
        """Raise one ChoiceError with all that was noted, each in a line of its own."""
        if len(self._found) == 1:
            raise self._found[0]
        if self._found:
            raise ChoiceError("\n".join(dict.fromkeys(map(str, self._found))))


@dataclass(frozen=True, eq=False)
class Chooser:
    """Chooses among points by their settings.

    `columns` has the values of each setting, shape (points,), or the one value that all
    have. `study` is the name that errors say. `metrics` are the columns of what was
    measured: by those nothing is chosen, and errors say so.
    """

    columns: Mapping[str, Any]
    points: int
    study: str = ""
    metrics: Collection[str] = ()

    def values(self, name: str) -> NDArray[Any]:
        """The value of a setting at each point. Raises ChoiceError for an unknown
        setting.
        """
        if name not in self.columns:
            no_setting = (
                _is_metric(name)
                if name in self.metrics
                else unknown("setting", name, self.columns)
            )
            raise self._error(f"{no_setting} ({self._varying})")
        return np.broadcast_to(np.asarray(self.columns[name]), self.points)

    def read(self, texts: Iterable[str]) -> dict[str, Choice]:
        """What `having` wants, from texts such as `n=50` and `map=empty,fov=90`.

        A number is written as in a spec, and a truth value as true or false, yes or no.
        Raises ChoiceError for another form, an unknown setting, and one that stands
        twice.
        """
        found: dict[str, Choice] = {}
        for name, text in self.split(texts).items():
            if text is None:
                raise self._malformed(name)
            found[name] = self.value(name, text)
        return found

    def wanted(self, text: str, before: Restriction) -> Restriction:
        """What was wanted before, and what a text wants: settings, as
        `n=50,map=empty`, or a condition, as `n >= 50 and map != "empty"`.

        Raises ChoiceError as `read`, and for a setting that was wanted before.
        """
        if SIGNS.search(text) and not SETTINGS.match(text):
            return before._replace(conditions=(*before.conditions, text))
        more = self.read([text])
        if twice := before.settings.keys() & more.keys():
            raise self._twice(min(twice))
        return before._replace(settings=before.settings | more)

    def names(self, condition: str) -> frozenset[str]:
        """The settings in a condition that `holding` has accepted."""
        return parse(condition, self._settings).names

    def split(self, texts: Iterable[str]) -> dict[str, str | None]:
        """The names in such texts, with the text of each value; None where no "="
        follows. Raises ChoiceError for a name that is missing or stands twice.
        """
        found: dict[str, str | None] = {}
        for item in (item for text in texts for item in text.split(",")):
            name, equals, value = (part.strip() for part in item.partition("="))
            if not name:
                raise self._malformed(item)
            if name in found:
                raise self._twice(name)
            found[name] = value if equals else None
        return found

    def having(self, settings: Mapping[str, object]) -> NDArray[np.bool_]:
        """Whether each point has all these settings, shape (points,). A list of values
        means one of them.

        Numbers are equal if they agree in nine digits, so that 0.3 finds 3 * 0.1.
        Raises ChoiceError for an unknown setting, and for a value that no point has, or
        none of the points that have the settings before it.
        """
        found = np.ones(self.points, np.bool_)
        before: list[str] = []
        for name, choice in as_choices(settings).items():
            values = self.values(name)
            wanted = choice if isinstance(choice, tuple) else (choice,)
            if not wanted:
                raise self._error(f"{name} is to have one of no values; name one")
            matching = [found & agrees(values, value) for value in wanted]
            for value, each in zip(wanted, matching, strict=True):
                if not each.any():
                    raise self._error(_lacking(name, value, values[found], before))
            found = np.logical_or.reduce(matching)
            before.append(f"{name} = {_shown(choice)}")
        return found

    def holding(self, condition: str) -> NDArray[np.bool_]:
        """Whether a condition holds at each point, shape (points,): an expression as in
        a spec, over settings, `n >= 50 and map != "empty"`.

        Raises ChoiceError for what is no condition, for an unknown setting, and where
        it holds at no point.
        """
        try:
            expression = parse(condition, self._settings)
            if expression.kind != CONDITION:
                raise ExpressionError(f"it is {expression.kind}, and no condition")
            found = expression.evaluate(self.columns, self.points)
        except ExpressionError as error:
            metrics = self._metrics_in(condition)
            said = f"{_is_metric(metrics[0])} ({self._varying})" if metrics else error
            raise self._error(f'"{condition}": {said}') from None
        if not found.any():
            there = [listed(one, self.values(one)) for one in sorted(expression.names)]
            raise self._error("; ".join([f'"{condition}" holds at no point', *there]))
        return np.asarray(found, np.bool_)

    @cached_property
    def _settings(self) -> dict[str, Setting]:
        """The settings as expressions know them; the choices of a text are the values
        that points have.
        """
        return {name: _as_setting(name, self.values(name)) for name in self.columns}

    def _metrics_in(self, condition: str) -> list[str]:
        """The metrics in what would be a condition if metrics were settings."""
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
        """A choice that some point has, of a setting that varies if one does."""
        name = max(self.columns, key=self._varies, default="")
        return f"{name}={spelled(self.values(name)[0])}" if name else "n=50"

    def _varies(self, name: str) -> bool:
        return np.ndim(self.columns[name]) > 0

    def value(self, name: str, text: str) -> Choice:
        """The value that `text` writes, as a number or a truth value where the setting
        is one and `text` too. Raises ChoiceError for an unknown setting.
        """
        kind = self.values(name).dtype.kind
        if kind == "b":
            return BOOLEANS.get(text.lower(), text)
        if kind in "iuf":
            with suppress(ValueError):
                return float(text.replace(".inf", "inf"))
        return text

    def _twice(self, name: str) -> ChoiceError:
        return self._error(f"{name} stands twice; allowed: one value of it")

    def _malformed(self, item: str) -> ChoiceError:
        return self._error(
            f'"{item}" chooses nothing; allowed: {FORM}, for example {self.example}'
        )

    def _error(self, reason: str) -> ChoiceError:
        return ChoiceError(reason, self.study)


def as_names(given: str | Iterable[str]) -> list[str]:
    """Names as a caller gives them. One text is one name, and not its letters."""
    return [given] if isinstance(given, str) else list(given)


def as_choices(settings: Mapping[str, object]) -> dict[str, Choice]:
    """The same settings with plain values, tuples of them for lists and arrays."""
    return {name: _as_choice(value) for name, value in settings.items()}


def spelled(value: object) -> str:
    """The value of a setting as a text that `Chooser.read` finds again; several with
    "or" between them.
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
    """The values of a setting in words: all where they are few, else some, of numbers
    those closest to `near`.
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
    return f"{name} is a metric, and points are chosen by settings"


def _as_setting(name: str, column: NDArray[Any]) -> Setting:
    kind = {"b": "bool", "i": "int", "u": "int", "f": "float"}.get(column.dtype.kind)
    choices = () if kind else tuple(dict.fromkeys(map(str, column.tolist())))
    return Setting(name, kind or "choice", "", "", choices=choices)


def _as_choice(value: Any) -> Any:
    if isinstance(value, Iterable) and not isinstance(value, str):
        return tuple(map(_as_choice, value))
    return value.item() if isinstance(value, np.generic) else value


def _lacking(name: str, value: object, column: NDArray[Any], before: list[str]) -> str:
    """That no point has a value of a setting, and which values there are."""
    of = f" with {', '.join(before)}" if before else ""
    texts = [str(one) for one in dict.fromkeys(column.tolist()) if isinstance(one, str)]
    close = similar(str(value), texts)
    there = listed(name, column, value)
    there = f" {there[:1].upper()}{there[1:]}" if close else f"; {there}"
    return f"no point{of} has {name} = {_shown(value)}{close}{there}"


def _shown(value: object) -> str:
    """A value in a list; a text that is empty needs quotes to be seen."""
    return spelled(value) or '""'


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
