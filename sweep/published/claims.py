"""Claims of a publication: texts, and expectations for our trials.

This module reads and checks the list `claims` of published.yaml.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any, Literal, NamedTuple, cast, get_args

from sweep.analysis import Order
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
from sweep.spec import Entry, parse_document

ABOUT = ("id", "where", "says", "kind", "registered")
TESTED = ("measure", "expect", "looked")
UNTESTABLE = "untestable"
ALTERNATIVES = "alternatives"
UNVERIFIED = "unverified"
MAY_HAVE = (
    *("statement", "spec", "figure", *TESTED),
    *(ALTERNATIVES, UNTESTABLE, UNVERIFIED),
)
ORDER = "order"
ORDERS = ("continuous", "first order")
SHARE = re.compile(r"([0-9]+(?:\.[0-9]+)?) %")

Kind = Literal["number", "reading", "exact", "hypothesis", "fit"]
"""Kind of a claim, which decides how the claim is counted.

    number      a number in the text or the data of the publication
    reading     our reading of a sentence of the publication

    exact       a consequence of the equations, without any trial
    hypothesis  our own hypothesis
    fit         a test of a value that was fitted to the number
"""
FIT: Kind = "fit"
"""The kind that is shown and not counted."""
Looked = Literal["before", "after"]
"""Time of the first look at results of such trials, relative to the registration."""


@dataclass(frozen=True)
class Claim:
    """A published number or statement, with measure and expectation.

    Attributes
    ----------
    id : str
        Name of the claim, unique in the publication.
    where : str
        Place in the publication.
    says : str
        Text of the claim.
    kind : Kind
        Origin of the claim.
    statement : str
        Name that claims on one statement share.
    registered : date
        Day of the last change of the expectation.
    spec : str, optional
        Spec whose trials test the claim.
    figure : str, optional
        Figure that shows the claim.
    measure : Measure, optional
        Quantity that is measured.
    expect : Expectation, optional
        Expectation for the quantity.
    looked : Looked, optional
        Time when results were first seen.
    alternatives : str
        Other expectations or measures that were tried; "" for none.
    untestable : str
        Reason why the claim cannot be tested, or "".
    unverified : str
        Reason why `says` has not been compared with the publication, or "".

    Notes
    -----
    A claim that cannot be tested has no measure, no expectation and no look. Claims of
    a publication that is not selected also lack measure, expectation and look.
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
        """True if the claim is tested and counts; a fit does not count."""
        return self.measure is not None and self.kind != FIT


class Shown(NamedTuple):
    """Expectation of a claim, for the figure that shows the claim.

    `measure` is the mapping under `measure`, unchanged. `region` is the range of values
    that the expectation allows.
    """

    kind: Kind
    spec: str
    measure: Mapping[str, Any]
    region: Region


def shown(file: Path, figure: str) -> list[Shown]:
    """Return the tested claims of a published.yaml that name `figure`, in file order.

    Claims on the order of a transition have no region, and are left out. A figure calls
    this function during the drawing, so neither specs nor functions are read.

    Raises
    ------
    SpecError
        If an expectation is not valid.
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
    """Return the claims of a list.

    Parameters
    ----------
    root : Entry
        The list `claims` of a published.yaml.
    drawings : mapping of str to Drawing
        Figures of the publication by name.
    reader : MeasureReader or None
        Reads the measures; None leaves all claims without measures.

    Raises
    ------
    SpecError
        One error with the first mistake of each claim.
    """
    claims = []
    mistakes = []
    places: dict[str, int] = {}
    for entry in root.entries():
        try:
            entry.keys([*ABOUT, *MAY_HAVE], required=ABOUT)
            fields = _common_fields(entry)
            test = (
                _test_fields(entry, fields["kind"], drawings, reader) if reader else {}
            )
            claim = Claim(**fields, **test)
            if claim.id in places:
                raise entry.child("id").error(
                    f'"{claim.id}" is listed twice, first as number {places[claim.id]}'
                )
            places[claim.id] = len(places) + 1
            claims.append(claim)
        except SpecError as error:
            mistakes.append(str(error))
    if mistakes:
        raise SpecError("\n".join(mistakes))
    return claims


def _test_fields(
    entry: Entry, kind: Kind, drawings: Mapping[str, Drawing], reader: MeasureReader
) -> dict[str, Any]:
    """Return the fields of a claim that describe its test."""
    spec = entry.get("spec")
    figure = entry.get("figure")
    alternatives = entry.get(ALTERNATIVES)
    chosen = spec.one_of("spec", reader.designs) if spec else None
    shown = figure.one_of("figure", drawings) if figure else None
    fields: dict[str, Any] = {"spec": chosen, "figure": shown}
    present = [key for key in TESTED if key in entry.value]
    if len(present) != (0 if UNTESTABLE in entry.value else len(TESTED)):
        raise entry.error(
            'a claim needs either "measure", "expect" and "looked",'
            ' or "untestable" with the reason'
        )
    if not present:
        return fields
    if chosen is None:
        raise entry.error('missing key "spec": the spec whose trials test the claim')
    measure = reader.read(entry.child("measure"), chosen)
    expect = entry.child("expect")
    of_order = isinstance(measure, Transition)
    return fields | {
        "measure": measure,
        "expect": _order(expect) if of_order else _expectation(expect, measure, kind),
        "looked": entry.child("looked").one_of("time of the look", get_args(Looked)),
        ALTERNATIVES: alternatives.text() if alternatives else "",
    }


def _common_fields(entry: Entry) -> dict[str, Any]:
    """Return the fields of a claim that do not depend on the test."""
    statement = entry.get("statement") or entry.child("id")
    untestable = entry.get(UNTESTABLE)
    unverified = entry.get(UNVERIFIED)
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
        UNTESTABLE: untestable.text() if untestable else "",
        UNVERIFIED: unverified.text() if unverified else "",
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
    present = [kind for kind in kinds if kind in entry.value]
    if len(present) != 1:
        raise entry.error(f"an expectation needs exactly one of {', '.join(kinds)}")
    if present == ["value"]:
        return _value(entry, measure, kind)
    entry.keys(present)
    bound = entry.child(present[0])
    if present != ["within"]:
        return Above(bound.number()) if present == ["above"] else Below(bound.number())
    numbers = [child.number() for child in bound.entries()]
    if len(numbers) != 2 or numbers[0] >= numbers[1]:
        raise bound.expected("a list of two numbers, the smaller one first")
    return Within(*numbers)


def _value(entry: Entry, measure: Measure | None, kind: Kind) -> Value:
    if kind != FIT and "margin" not in entry.value:
        raise entry.error('missing key "margin": the allowed distance from the number')
    if ("margin" in entry.value) != ("because" in entry.value):
        raise entry.error('"margin" needs "because", the reason, and vice versa')
    trials = entry.get("trials")
    because = entry.get("because")
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
    """Return a margin in the unit of `value`; also a fraction of `value` is allowed."""
    if entry is None:
        return 0.0
    if isinstance(entry.value, str):
        share = SHARE.fullmatch(entry.value)
        if not share:
            raise entry.expected('a number, or a fraction of the value such as "5 %"')
        margin = float(share[1]) / 100.0 * abs(value)
    else:
        margin = entry.number()
    if margin <= 0.0:
        raise entry.error(
            f'"margin" must be more than 0, not {margin:g}; the value is {value:g}'
        )
    return margin
