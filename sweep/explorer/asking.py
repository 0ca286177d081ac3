"""The questions that the page may ask, a class each, and how the query of a GET is read
into one. The query may come from anyone.
"""

import math
from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from typing import Annotated, Any, TypeVar, get_type_hints

from sweep.errors import ChoiceError
from sweep.text import shortened, unknown

MOST_CHARACTERS, MOST_VALUES = 2000, 100
DIGITS = 10
MOST_ROWS = 200
"""Of a page of a table."""

Texts = tuple[str, ...]
Flag = Annotated[bool, "yes or no"]
Number = Annotated[int, "from 0"]
Real = Annotated[float, "a finite number"]
MaybeReal = Real | None
Q = TypeVar("Q")


@dataclass(frozen=True)
class AskStudies:
    """Which studies there are."""


@dataclass(frozen=True)
class AskState:
    """How far a study is. `seen` is the revision that the page has: nothing else is
    answered where it is still the last one.
    """

    study: str
    seen: str = ""


@dataclass(frozen=True)
class AskPoints:
    """A page of the table of a study, in the words of `sweep table`."""

    study: str
    metric: Texts = ()
    where: Texts = ()
    by: Texts = ()
    sort: Texts = ()
    half: Flag = False
    page: Number = 0
    csv: Flag = False


@dataclass(frozen=True)
class AskTrials:
    """A page of the trials of some points, by a metric."""

    study: str
    point: Texts = ()
    metric: str = ""
    where: Texts = ()
    half: Flag = False
    page: Number = 0


@dataclass(frozen=True)
class AskComparison:
    """A page of the comparison of two sides, in the words of `sweep compare`. `seen` is
    the revision that the page has: nothing else is answered where it is still the last
    one.
    """

    a: str
    b: str
    metric: Texts = ()
    half: Flag = False
    margin: MaybeReal = None
    confidence: Real = 0.95
    together: str = "holm"
    page: Number = 0
    csv: Flag = False
    seen: str = ""


@dataclass(frozen=True)
class AskSearch:
    """The report of a search."""

    study: str


@dataclass(frozen=True)
class AskScorecard:
    """The scorecard that a reproduction has written, `full` or `quick`; of one that was
    `seen` only its revision.
    """

    scale: str = "full"
    seen: str = ""


@dataclass(frozen=True)
class AskPicture:
    """The figure that shows a claim of a document."""

    study: str
    claim: str
    scale: str = "full"


@dataclass(frozen=True)
class AskSpec:
    """The spec that launches a stored trial."""

    study: str
    trial: str


@dataclass(frozen=True)
class AskFigure:
    """A figure of a study, in the words of `sweep plot`; without a kind the one that
    suits its settings.
    """

    study: str
    kind: str = ""
    metric: Texts = ()
    x: str = ""
    y: str = ""
    by: str = ""
    where: Texts = ()
    half: Flag = False


@dataclass(frozen=True)
class AskPublished:
    """The published means of a metric that hold at points of a study."""

    study: str
    metric: str
    half: Flag = False


@dataclass(frozen=True)
class AskRefine:
    """The change of a spec that puts more points into a region: between two values of
    settings, each "NAME LOW HIGH", or about some points. Each interval there is divided
    into `parts`. With `replicates`, other than 0, all points have so many trials.
    """

    study: str
    between: Texts = ()
    point: Texts = ()
    parts: Number = 2
    replicates: Number = 0


def read(kind: type[Q], pairs: Sequence[tuple[str, str]]) -> Q:
    """The question of this kind that a query asks. Raises ChoiceError where it is none.

    A key whose values are several texts may stand several times.
    """
    hints = get_type_hints(kind, include_extras=True)
    given: dict[str, list[str]] = {}
    for name, value in pairs:
        if name not in hints:
            raise ChoiceError(unknown("key of the question", name, hints))
        given.setdefault(name, []).append(_text(name, value))
    for member in fields(kind):  # type: ignore[arg-type]
        if member.name not in given and member.default is MISSING:
            raise ChoiceError(f'the question lacks the key "{member.name}"')
    return kind(
        **{name: _read(name, hints[name], each) for name, each in given.items()}
    )


def _text(name: str, value: str) -> str:
    if len(value) > MOST_CHARACTERS:
        raise ChoiceError(f"{name} has more than {MOST_CHARACTERS:,} characters")
    return value


def _read(name: str, hint: Any, values: list[str]) -> Any:
    if hint == Texts:
        if len(values) > MOST_VALUES:
            raise ChoiceError(f"{name} stands more than {MOST_VALUES} times")
        return tuple(values)
    if len(values) > 1:
        raise ChoiceError(f"{name} stands {len(values)} times; allowed: once")
    if hint == Flag:
        return _flag(name, values[0])
    if hint in (Real, MaybeReal):
        return _real(name, values[0])
    return _number(name, values[0]) if hint == Number else values[0]


def _flag(name: str, text: str) -> bool:
    if text not in ("yes", "no"):
        raise ChoiceError(f'{name} is "{shortened(text)}"; allowed: yes, no')
    return text == "yes"


def _real(name: str, text: str) -> float:
    try:
        value = float(text) if text.isascii() else math.nan
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ChoiceError(f'{name} is "{shortened(text)}"; allowed: a finite number')
    return value


def _number(name: str, text: str) -> int:
    if not (text.isascii() and text.isdecimal() and len(text) < DIGITS):
        allowed = "a whole number from 0"
        raise ChoiceError(f'{name} is "{shortened(text)}"; allowed: {allowed}')
    return int(text)
