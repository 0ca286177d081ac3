"""The questions that the page may ask, a class per question.

`read` makes a question from the query of a GET. The query may come from anyone, so
`read` limits and checks the whole query.
"""

import math
from collections.abc import Sequence
from dataclasses import MISSING, Field, dataclass, field, fields
from typing import Annotated, Any, TypeVar, get_type_hints

from sweep.errors import ChoiceError
from sweep.text import shortened, unknown

MOST_CHARACTERS = 2000
MOST_VALUES = 100
DIGITS = 10
MOST_ROWS = 200
"""Number of rows of a page of a table."""
SEEN = {"key": "seen"}
"""Metadata of a field `known_revision`, whose key in a query is `seen`."""

Texts = tuple[str, ...]
Flag = Annotated[bool, "yes or no"]
Number = Annotated[int, "from 0"]
Real = Annotated[float, "a finite number"]
MaybeReal = Real | None
Q = TypeVar("Q")


@dataclass(frozen=True)
class AskStudies:
    """The list of all studies."""


@dataclass(frozen=True)
class AskState:
    """The progress of a study.

    `known_revision` is the revision that the page has. If this revision is still the
    newest, the answer has only the revision and the owners of a launch.
    """

    study: str
    known_revision: str = field(default="", metadata=SEEN)


@dataclass(frozen=True)
class AskPoints:
    """A page of the table of a study.

    The fields have the names and meanings of the options of `sweep table`.
    """

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
    """A page of the trials of some points, ordered by a metric."""

    study: str
    point: Texts = ()
    metric: str = ""
    where: Texts = ()
    half: Flag = False
    page: Number = 0


@dataclass(frozen=True)
class AskComparison:
    """A page of the comparison of two sides.

    The fields have the names and meanings of the options of `sweep compare`.
    `known_revision` is the revision that the page has. If this revision is still the
    newest, the answer has only the revision.
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
    known_revision: str = field(default="", metadata=SEEN)


@dataclass(frozen=True)
class AskSearch:
    """The report of a search."""

    study: str


@dataclass(frozen=True)
class AskScorecard:
    """The scorecard that a reproduction has written, `full` or `quick`.

    `known_revision` is the revision that the page has. If this revision is still the
    newest, the answer has only the revision.
    """

    scale: str = "full"
    known_revision: str = field(default="", metadata=SEEN)


@dataclass(frozen=True)
class AskPicture:
    """The figure that shows a claim of a publication."""

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
    """A figure of a study.

    The fields have the names and meanings of the options of `sweep plot`. Without a
    `kind` the answer is the kind that suits the parameters of the study.
    """

    study: str
    kind: str = ""
    metric: Texts = ()
    x: str = ""
    y: str = ""
    by: str = ""
    where: Texts = ()
    half: Flag = False
    trials: Flag = False
    width: str = ""


@dataclass(frozen=True)
class AskFile(AskFigure):
    """A file of a figure: the file that the command of the figure writes."""

    format: str = "png"


@dataclass(frozen=True)
class AskPublished:
    """The published means of a metric that hold at points of a study."""

    study: str
    metric: str
    half: Flag = False


@dataclass(frozen=True)
class AskRefine:
    """The change of a spec that puts more points into a region.

    The region is between two values of parameters, each "NAME LOW HIGH" in `between`,
    or around the points in `point`. Each segment between two values in the region is
    divided into `parts`. A number of `replicates` above 0 is the number of trials per
    point.
    """

    study: str
    between: Texts = ()
    point: Texts = ()
    parts: Number = 2
    replicates: Number = 0


def read(kind: type[Q], pairs: Sequence[tuple[str, str]]) -> Q:
    """Return the question of this kind that a query asks.

    A key whose values are several strings may appear several times. Raises ChoiceError
    if a key is unknown, missing or repeated, or if a value is not allowed.
    """
    members = fields_by_key(kind)
    hints = get_type_hints(kind, include_extras=True)
    texts: dict[str, list[str]] = {}
    for key, value in pairs:
        if key not in members:
            raise ChoiceError(unknown("key of the question", key, members))
        texts.setdefault(key, []).append(_text(key, value))
    for key, member in members.items():
        if key not in texts and member.default is MISSING:
            raise ChoiceError(f'the question lacks the key "{key}"')
    names = {key: members[key].name for key in texts}
    return kind(
        **{name: _read(key, hints[name], texts[key]) for key, name in names.items()}
    )


def fields_by_key(kind: type[Any]) -> dict[str, Field[Any]]:
    """Return the fields of a kind of question by their keys in a query."""
    return {member.metadata.get("key", member.name): member for member in fields(kind)}


def _text(name: str, value: str) -> str:
    if len(value) > MOST_CHARACTERS:
        raise ChoiceError(f"{name} has more than {MOST_CHARACTERS:,} characters")
    return value


def _read(name: str, hint: Any, values: list[str]) -> Any:
    if hint == Texts:
        if len(values) > MOST_VALUES:
            raise ChoiceError(f"{name} occurs more than {MOST_VALUES} times")
        return tuple(values)
    if len(values) > 1:
        raise ChoiceError(f"{name} occurs {len(values)} times; allowed: once")
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
        allowed = "an integer from 0"
        raise ChoiceError(f'{name} is "{shortened(text)}"; allowed: {allowed}')
    return int(text)
