"""The scorecard as JSON, in the format of docs/scorecard.md."""

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
    """Return the numbers of the page as JSON; unknown values are null."""
    content = {
        "version": VERSION,
        "scale": page.scale,
        "documents": [_document(section) for section in page.sections],
        "rows": [
            _row(page, section, row) for section in page.shown for row in section.rows
        ],
    }
    return json.dumps(content, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _document(section: Section) -> dict[str, Any]:
    publication = section.publication
    tallies = section.tallies
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


def _counts(statuses: Counter[Status]) -> dict[Status, int]:
    return {status: statuses[status] for status in ORDER}


def _mutants(effects: DocumentVariants | None) -> dict[str, Any] | None:
    if effects is None:
        return None
    return {
        "tried": len(effects.tried("mutants")),
        "noticed": effects.noticed,
        "killed_by": effects.killed_by,
        "unmoved": effects.unmoved,
    }


def _variants(section: Section, kind: Kind) -> dict[str, Any] | None:
    effects = section.tried(kind)
    if effects is None:
        return None
    return {
        "before": effects.before,
        "variants": {
            name: variant.stored() for name, variant in effects.tried(kind).items()
        },
    }


def _row(page: Page, section: Section, row: Row) -> dict[str, Any]:
    claim, verdict, measured = row
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
        "ours": _ours(measured) if measured else None,
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
        "trials": measured.used if measured else 0,
        "left_out": measured.left_out if measured else 0,
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
    """Return the trials that test a claim."""
    if claim.measure is None or claim.spec is None:
        return []
    studies = section.publication.studies
    return [
        {
            "study": studies[trials.spec].name,
            "column": trials.column,
            "settings": {
                name: _plain(trials.settings[name]) for name in trials.settings
            },
        }
        for trials in trials_read(claim.measure, claim.spec)
    ]


def _plain(value: object) -> object:
    """Return a parameter value for JSON: infinity becomes a string."""
    endless = isinstance(value, float) and math.isinf(value)
    return str(value) if endless else value


def _ours(measured: Measured) -> float | None:
    """Return the estimate; None for a transition."""
    estimate = measured.estimate
    return None if isinstance(estimate, Scaling) else _number(estimate.value)


def _expected(expect: Expectation | None) -> str | None:
    """Return the kind of an expectation, or the order of a transition."""
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
