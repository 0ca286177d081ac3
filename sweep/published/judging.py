"""Verdicts on the claims of a publication by stored trials."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from sweep.design import study_code
from sweep.errors import StoreError
from sweep.method import methods
from sweep.methods.scaling import Scaling
from sweep.published.claims import Claim
from sweep.published.clocks import converted
from sweep.published.estimates import Measured, MeasureError, measure, metrics_left_out
from sweep.published.measures import specs_of
from sweep.published.publications import Publication
from sweep.published.published_code import CODE
from sweep.published.verdicts import (
    Expectation,
    OfOrder,
    Verdict,
    judge,
    judge_order,
    not_run,
    partial,
    untestable,
)
from sweep.spec import Study
from sweep.tables import StoredStudy

NOT_ASKED = f"not requested: the code, {CODE}, did not run"
NO_RESULT = ("missing", "failed", "timeout")
"""Statuses of planned trials without a result; a diverged trial has a result."""

Stored = Mapping[str, StoredStudy]


class Row(NamedTuple):
    """A claim, the verdict and the measured values; None without values."""

    claim: Claim
    verdict: Verdict
    measured: Measured | None = None


def stored_studies(publication: Publication, results: Path) -> dict[str, StoredStudy]:
    """Return the stored studies of a publication by spec.

    A study counts if spec and code are unchanged, and at least one trial is finished.
    """
    usable = {}
    for spec, study in publication.studies.items():
        try:
            stored = _stored(study, results, publication.clocks.get(spec, 1))
        except StoreError:
            continue
        same = stored.spec == study.text and stored.code == study_code(study)
        if same and stored.statuses()["done"]:
            usable[spec] = stored
    return usable


def _stored(study: Study, results: Path, clock: int) -> StoredStudy:
    stored = StoredStudy(study.name, results)
    return converted(study, stored, clock) if clock > 1 else stored


def judged(publication: Publication, stored: Stored) -> tuple[list[Row], list[str]]:
    """Return the rows of a publication in the order of claims, and the failures.

    `stored` has the stored studies by spec.
    """
    gaps = {spec: gap for spec, study in stored.items() if (gap := _gap(study))}
    rows = []
    failures = []
    for claim in publication.claims:
        try:
            rows.append(_row(publication, claim, stored, gaps))
        except MeasureError as error:
            failures.append(f"claim {publication.name}/{claim.id}: {error}")
            rows.append(Row(claim, untestable(f"the measure failed: {error}")))
    return rows, failures


def _gap(study: StoredStudy) -> str:
    """Return in words the missing trials of a study; "" for a complete study."""
    counts = study.statuses()
    planned = counts.total()
    missing = sum(counts[status] for status in NO_RESULT)
    if missing:
        present = planned - missing
        return f"{present:,} of {planned:,} trials of {study.name} are stored"
    whys = (method.unfinished(study) for method in methods().values())
    return next(filter(None, whys), "")


def _row(
    publication: Publication, claim: Claim, stored: Stored, gaps: Mapping[str, str]
) -> Row:
    """Return the row of a claim.

    Raises MeasureError.
    """
    if claim.untestable:
        return Row(claim, untestable(claim.untestable))
    if claim.measure is None or claim.expect is None:
        return Row(claim, not_run(NOT_ASKED))
    needed = specs_of(claim.measure, publication.studies)
    missing = [spec for spec in needed if spec not in stored]
    if missing:
        return Row(claim, not_run(f"no trial of {', '.join(missing)} is done"))
    if reason := metrics_left_out(stored, claim.measure):
        return Row(claim, untestable(reason))
    measured = measure(stored, claim.measure, publication.functions)
    verdict = _verdict(measured, claim.expect, publication.family)
    gap = "; ".join(gaps[spec] for spec in needed if spec in gaps)
    return Row(claim, partial(verdict, gap) if gap else verdict, measured)


def _verdict(measured: Measured, expect: Expectation, family: int) -> Verdict:
    if isinstance(expect, OfOrder):
        assert isinstance(measured.estimate, Scaling)
        return judge_order(measured.estimate, expect, family)
    assert not isinstance(measured.estimate, Scaling)
    return judge(measured.estimate, expect, family, measured.used)
