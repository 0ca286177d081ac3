"""Judges the claims of a document by the trials that are stored."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from sweep.design.code import study_code
from sweep.errors import StoreError
from sweep.method import methods
from sweep.methods.scaling import Scaling
from sweep.published.claims import Claim
from sweep.published.clocks import RetoldStudy
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
from sweep.spec.study import Study
from sweep.tables.stored_study import StoredStudy

NOT_ASKED = f"not asked for: its code, {CODE}, was not run"
NO_RESULT = ("missing", "failed", "timeout")
"""Planned trials of these statuses are not there; one that diverged is a result."""

Stored = Mapping[str, StoredStudy]


class Row(NamedTuple):
    """A claim with its verdict, and what was measured; None where nothing was."""

    claim: Claim
    verdict: Verdict
    measured: Measured | None = None


def stored_studies(publication: Publication, results: Path) -> dict[str, StoredStudy]:
    """The stored studies of a publication, by the names of their specs. Only those of
    the same spec and code count, with at least one trial that is done.
    """
    found = {}
    for spec, study in publication.studies.items():
        try:
            stored = _stored(study, results, publication.clocks.get(spec, 1))
        except StoreError:
            continue
        same = stored.spec == study.text and stored.code == study_code(study)
        if same and stored.statuses()["done"]:
            found[spec] = stored
    return found


def _stored(study: Study, results: Path, clock: int) -> StoredStudy:
    if clock > 1:
        return RetoldStudy(study, results, clock)
    return StoredStudy(study.name, results)


def judged(publication: Publication, stored: Stored) -> tuple[list[Row], list[str]]:
    """The rows of a publication in the order of its claims, and what failed.

    `stored` are its studies, by the names of their specs.
    """
    gaps = {spec: gap for spec, study in stored.items() if (gap := _gap(study))}
    rows, failures = [], []
    for claim in publication.claims:
        try:
            rows.append(_row(publication, claim, stored, gaps))
        except MeasureError as error:
            failures.append(f"claim {publication.name}/{claim.id}: {error}")
            rows.append(Row(claim, untestable(f"its measure failed: {error}")))
    return rows, failures


def _gap(study: StoredStudy) -> str:
    """What is missing of a study, in words; "" where every planned trial is there."""
    counts = study.statuses()
    planned, missing = counts.total(), sum(counts[status] for status in NO_RESULT)
    if missing:
        there = planned - missing
        return f"{there:,} of {planned:,} trials of {study.name} are there"
    whys = (method.unfinished(study) for method in methods().values())
    return next(filter(None, whys), "")


def _row(
    publication: Publication, claim: Claim, stored: Stored, gaps: Mapping[str, str]
) -> Row:
    """The row of a claim. Raises MeasureError."""
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
    found = measure(stored, claim.measure, publication.functions)
    verdict = _verdict(found, claim.expect, publication.family)
    gap = "; ".join(gaps[spec] for spec in needed if spec in gaps)
    return Row(claim, partial(verdict, gap) if gap else verdict, found)


def _verdict(found: Measured, expect: Expectation, family: int) -> Verdict:
    if isinstance(expect, OfOrder):
        assert isinstance(found.estimate, Scaling)
        return judge_order(found.estimate, expect, family)
    assert not isinstance(found.estimate, Scaling)
    return judge(found.estimate, expect, family, found.used)
