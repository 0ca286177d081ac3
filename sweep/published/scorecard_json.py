"""The scorecard for machines. docs/scorecard.md describes the format."""

import json
import math
from collections import Counter
from typing import Any

from sweep.methods.scaling import Scaling
from sweep.published.claims import Claim
from sweep.published.estimates import Measured
from sweep.published.judging import Row
from sweep.published.measures import trials_read
from sweep.published.scorecard import ORDER, Page, Section
from sweep.published.turned import DocumentVariants
from sweep.published.variants import Kind
from sweep.published.verdicts import Expectation, OfOrder, Status, Value, Within

VERSION = 1


def as_json(page: Page) -> str:
    """The same numbers as on the page, as JSON. What is not known is null."""
    about = {
        "version": VERSION,
        "scale": page.scale,
        "documents": [_document(section) for section in page.sections],
        "rows": [_row(page, one, row) for one in page.shown for row in one.rows],
    }
    return json.dumps(about, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _document(section: Section) -> dict[str, Any]:
    publication, tallies = section.publication, section.tallies
    return {
        "study": publication.name,
        "title": publication.title,
        "source": publication.source,
        "asked": publication.selected,
        "family": publication.family if publication.selected else None,
        "statements": _counts(tallies["statement"]),
        "exact": _counts(tallies["exact"]),
        "hypotheses": _counts(tallies["hypothesis"]),
        "fits": _counts(tallies["fit"]),
        "mutants": _mutants(section.tried("mutants")),
        "details": _variants(section, "details"),
        "numerics": _variants(section, "numerics"),
    }


def _counts(found: Counter[Status]) -> dict[Status, int]:
    return {status: found[status] for status in ORDER}


def _mutants(found: DocumentVariants | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "tried": len(found.tried("mutants")),
        "noticed": found.noticed,
        "killed_by": found.killed_by,
        "unmoved": found.unmoved,
    }


def _variants(section: Section, kind: Kind) -> dict[str, Any] | None:
    found = section.tried(kind)
    if found is None:
        return None
    return {
        "before": found.before,
        "variants": {name: one.stored() for name, one in found.tried(kind).items()},
    }


def _row(page: Page, section: Section, row: Row) -> dict[str, Any]:
    claim, verdict, found = row
    expect = claim.expect
    return {
        "id": claim.id,
        "study": section.publication.name,
        "statement": claim.statement,
        "kind": claim.kind,
        "counted": claim.counted,
        "where": claim.where,
        "says": claim.says,
        "spec": claim.spec,
        "picture": _picture(page, section, claim),
        "behind": _behind(section, claim),
        "status": verdict.status,
        "reason": verdict.reason,
        "ours": _ours(found) if found else None,
        "interval": _interval(verdict.interval),
        "simultaneous": _interval(verdict.simultaneous),
        "expect": _expected(expect),
        "published": _published(expect),
        "rounding": expect.rounding if isinstance(expect, Value) else None,
        "margin": expect.margin if isinstance(expect, Value) else None,
        "noticeable": verdict.noticeable,
        "needed": verdict.needed,
        "enough": verdict.enough,
        "weak": bool(section.weaknesses(row)),
        "weaknesses": section.weaknesses(row),
        "trials": found.used if found else 0,
        "left_out": found.left_out if found else 0,
        "registered": claim.registered.isoformat(),
        "looked": claim.looked,
        "alternatives": claim.alternatives,
        "unverified": claim.unverified,
        "mutants": section.mutants(row),
        "details": section.turning("details", row),
        "numerics": section.turning("numerics", row),
        "least_share": section.least_share(row),
    }


def _picture(page: Page, section: Section, claim: Claim) -> str | None:
    picture = section.pictures[claim.figure] if claim.figure else None
    return f"{page.link(picture.path)}.png" if picture and picture.path else None


def _behind(section: Section, claim: Claim) -> list[dict[str, Any]]:
    """The trials that a claim is tested by."""
    if claim.measure is None or claim.spec is None:
        return []
    studies = section.publication.studies
    return [
        {
            "study": studies[one.spec].name,
            "column": one.column,
            "settings": {name: _plain(one.settings[name]) for name in one.settings},
        }
        for one in trials_read(claim.measure, claim.spec)
    ]


def _plain(value: object) -> object:
    """A setting as JSON has it: an infinite number as the text inf."""
    endless = isinstance(value, float) and math.isinf(value)
    return str(value) if endless else value


def _ours(found: Measured) -> float | None:
    """The estimate; a transition has none."""
    estimate = found.estimate
    return None if isinstance(estimate, Scaling) else _number(estimate.value)


def _expected(expect: Expectation | None) -> str | None:
    """The kind of an expectation; of a transition, its order."""
    if isinstance(expect, OfOrder):
        return expect.order
    return type(expect).__name__.lower() if expect else None


def _published(expect: Expectation | None) -> float | list[float] | None:
    if expect is None or isinstance(expect, OfOrder):
        return None
    if isinstance(expect, Within):
        return [expect.low, expect.high]
    return expect.value if isinstance(expect, Value) else expect.bound


def _interval(bounds: tuple[float, float] | None) -> list[float | None] | None:
    return [_number(bound) for bound in bounds] if bounds else None


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
