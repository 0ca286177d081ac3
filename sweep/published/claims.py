"""The claims of a document: what it says, and what is expected of our trials. They are
read from the list `claims` of published.yaml, and checked.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast, get_args

from sweep.analysis.coexistence import Order
from sweep.errors import SpecError
from sweep.figures import NAME, Drawing
from sweep.published.measures import (
    Measure,
    MeasureReader,
    RankCorrelation,
    Transition,
)
from sweep.published.verdicts import (
    Above,
    Below,
    Expectation,
    Numeric,
    OfOrder,
    Region,
    Value,
    Within,
    region,
)
from sweep.spec.document import Entry
from sweep.spec.strict_yaml import parse_document

ABOUT = ("id", "where", "says", "kind", "registered")
TESTED = ("measure", "expect", "looked")
UNTESTABLE, ALTERNATIVES = "untestable", "alternatives"
UNVERIFIED = "unverified"
MAY_HAVE = (
    *("statement", "spec", "figure", *TESTED),
    *(ALTERNATIVES, UNTESTABLE, UNVERIFIED),
)
ORDER, ORDERS = "order", ("continuous", "first order")
SHARE = re.compile(r"([0-9]+(?:\.[0-9]+)?) %")

Kind = Literal["number", "reading", "exact", "hypothesis", "fit"]
"""What a claim is: a number that the document prints, or that its own data have; our
reading of one of its sentences; what follows from the equations without any trial; a
hypothesis of ours; a test of what was fitted to it.
"""
FIT: Kind = "fit"
"""The kind that is shown and not counted."""
Looked = Literal["before", "after"]
"""When results of such trials were first seen: before or after the expectation was
fixed.
"""


@dataclass(frozen=True)
class Claim:
    """One published number or statement: where it stands, what it says, how it is
    measured and what is expected.

    kind          what it is
    statement     the name that claims on the same statement share
    registered    the day on which the expectation got its present form
    spec, figure  whose trials test it, and which figure shows it
    looked        when results were first seen
    alternatives  other expectations or measures that were tried; "" for none
    untestable    the reason why it cannot be tested, or ""
    unverified    why what it says has not been compared with the document, or ""

    A claim that cannot be tested has no measure, no expectation and no look. Neither
    has one of a publication that was not asked for.
    """

    id: str
    where: str
    says: str
    kind: Kind
    statement: str
    registered: date
    spec: str | None = None
    figure: str | None = None
    measure: Measure | None = None
    expect: Expectation | None = None
    looked: Looked | None = None
    alternatives: str = ""
    untestable: str = ""
    unverified: str = ""

    @property
    def counted(self) -> bool:
        """Whether it is tested, and counts. What was fitted to a number does not."""
        return self.measure is not None and self.kind != FIT


class Shown(NamedTuple):
    """What a claim expects, for the figure that shows it: its kind, its spec, what it
    measures as it is written, and what it allows.
    """

    kind: Kind
    spec: str
    measure: Mapping[str, Any]
    region: Region


def shown(file: Path, figure: str) -> list[Shown]:
    """The tested claims of a published.yaml that name `figure`, in their order; without
    those on the order of a transition, which allow no region.

    Neither specs nor functions are read: a figure calls this while it is drawn. Raises
    SpecError for an expectation that is none.
    """
    document = parse_document(file.read_text("utf-8"), file)
    claims = document.child("claims").entries()
    return [
        Shown(
            entry.value["kind"],
            entry.value["spec"],
            entry.value["measure"],
            region(_expectation(entry.child("expect"), None, entry.value["kind"])),
        )
        for entry in claims
        if entry.value.get("figure") == figure
        and ORDER not in entry.value.get("expect", {ORDER})
    ]


def read_claims(
    root: Entry, drawings: Mapping[str, Drawing], reader: MeasureReader | None
) -> list[Claim]:
    """The claims of a list. Without a `reader` of measures they have none.

    Raises one SpecError with the first mistake of each claim.
    """
    claims, mistakes = [], []
    places: dict[str, int] = {}
    for entry in root.entries():
        try:
            entry.keys([*ABOUT, *MAY_HAVE], required=ABOUT)
            about = _about(entry)
            tested = _tested(entry, about["kind"], drawings, reader) if reader else {}
            claim = Claim(**about, **tested)
            if claim.id in places:
                raise entry.child("id").error(
                    f'"{claim.id}" stands twice, first as number {places[claim.id]}'
                )
            places[claim.id] = len(places) + 1
            claims.append(claim)
        except SpecError as error:
            mistakes.append(str(error))
    if mistakes:
        raise SpecError("\n".join(mistakes))
    return claims


def _tested(
    entry: Entry, kind: Kind, drawings: Mapping[str, Drawing], reader: MeasureReader
) -> dict[str, Any]:
    """How a claim is tested."""
    spec, figure, others = (entry.get(key) for key in ("spec", "figure", ALTERNATIVES))
    chosen = spec.one_of("spec", reader.designs) if spec else None
    shown = figure.one_of("figure", drawings) if figure else None
    found: dict[str, Any] = {"spec": chosen, "figure": shown}
    given = [key for key in TESTED if key in entry.value]
    if len(given) != (0 if UNTESTABLE in entry.value else len(TESTED)):
        raise entry.error(
            'a claim needs either "measure", "expect" and "looked",'
            ' or "untestable" with the reason'
        )
    if not given:
        return found
    if chosen is None:
        raise entry.error('missing key "spec": whose trials test the claim')
    measure, wanted = reader.read(entry.child("measure"), chosen), entry.child("expect")
    of_order = isinstance(measure, Transition)
    return found | {
        "measure": measure,
        "expect": _order(wanted) if of_order else _expectation(wanted, measure, kind),
        "looked": entry.child("looked").one_of("time of the look", get_args(Looked)),
        ALTERNATIVES: others.text() if others else "",
    }


def _about(entry: Entry) -> dict[str, Any]:
    """What every claim says about itself, tested or not."""
    statement = entry.get("statement") or entry.child("id")
    reason, unread = entry.get(UNTESTABLE), entry.get(UNVERIFIED)
    for name in (entry.child("id"), statement):
        if not NAME.fullmatch(name.text()):
            raise name.expected('a name of letters, digits, "_", "-" and "."')
    return {
        "id": entry.child("id").text(),
        "where": entry.child("where").text(),
        "says": entry.child("says").text(),
        "kind": entry.child("kind").one_of("kind of claim", get_args(Kind)),
        "statement": statement.text(),
        "registered": _day(entry.child("registered")),
        UNTESTABLE: reason.text() if reason else "",
        UNVERIFIED: unread.text() if unread else "",
    }


def _day(entry: Entry) -> date:
    try:
        return date.fromisoformat(entry.text())
    except ValueError:
        raise entry.expected("a day such as 2026-03-01") from None


def _order(entry: Entry) -> OfOrder:
    entry.keys([ORDER], required=[ORDER])
    return OfOrder(cast(Order, entry.child(ORDER).one_of("order", ORDERS)))


def _expectation(entry: Entry, measure: Measure | None, kind: Kind) -> Numeric:
    kinds = ("value", "above", "below", "within")
    entry.keys([*kinds, "rounding", "trials", "margin", "because"])
    given = [kind for kind in kinds if kind in entry.value]
    if len(given) != 1:
        raise entry.error(f"an expectation needs exactly one of {', '.join(kinds)}")
    if given == ["value"]:
        return _value(entry, measure, kind)
    entry.keys(given)
    bound = entry.child(given[0])
    if given != ["within"]:
        return Above(bound.number()) if given == ["above"] else Below(bound.number())
    numbers = [child.number() for child in bound.entries()]
    if len(numbers) != 2 or numbers[0] >= numbers[1]:
        raise bound.expected("a list of two numbers, the smaller one first")
    return Within(*numbers)


def _value(entry: Entry, measure: Measure | None, kind: Kind) -> Value:
    if kind != FIT and "margin" not in entry.value:
        raise entry.error('missing key "margin": how far ours may be from the number')
    if ("margin" in entry.value) != ("because" in entry.value):
        raise entry.error('"margin" and "because", its reason, go together')
    trials, because = entry.get("trials"), entry.get("because")
    if trials and isinstance(measure, RankCorrelation):
        raise trials.error('"trials" has no meaning for a rank correlation')
    value = entry.child("value").number()
    return Value(
        value=value,
        rounding=_rounding(entry.get("rounding")),
        trials=trials.whole(1) if trials else None,
        margin=_margin(entry.get("margin"), value),
        because=because.text() if because else "",
    )


def _rounding(entry: Entry | None) -> float:
    number = entry.number() if entry else 0.0
    if entry and number < 0:
        raise entry.expected("a number from 0")
    return number


def _margin(entry: Entry | None, value: float) -> float:
    """A margin in the unit of `value`, which may be given as a share of it."""
    if entry is None:
        return 0.0
    if isinstance(entry.value, str):
        share = SHARE.fullmatch(entry.value)
        if not share:
            raise entry.expected('a number, or a share of the value such as "5 %"')
        margin = float(share[1]) / 100.0 * abs(value)
    else:
        margin = entry.number()
    if margin <= 0.0:
        raise entry.error(
            f'"margin" must be more than 0, not {margin:g}; the value is {value:g}'
        )
    return margin
