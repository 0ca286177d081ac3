"""What each claim of a document could notice with its planned trials, before these run.

A pilot tells the spread: the trials that are stored at the full scale, or else those of
the quick scale. A claim whose noticeable difference exceeds its margin is weak: its
planned trials cannot confirm it.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from sweep.design.design import expand
from sweep.methods.scaling import Scaling
from sweep.published.claims import Claim
from sweep.published.judging import Row, Stored, judged, stored_studies
from sweep.published.measures import specs_of
from sweep.published.publications import Publication
from sweep.published.verdicts import Foreseen, OfOrder, brief, foresee
from sweep.spec.study import Study


class Outlook(NamedTuple):
    """A claim and what it could notice; None without a pilot that has an interval."""

    claim: Claim
    foreseen: Foreseen | None


def outlooks(full: Publication, quick: Publication, results: Path) -> list[Outlook]:
    """What the claims of a document that are tested could notice with all its trials,
    from those that are stored below `results`: `quick` is the document at that scale.
    What decides the order of a transition is no width: those claims are left out.
    """
    planned = {spec: _planned(study) for spec, study in full.studies.items()}
    pilots = [_pilot(one, results, planned) for one in (full, quick)]
    return [
        Outlook(claim, _foreseen(claim, full.family, pilots))
        for claim in full.claims
        if claim.measure and not isinstance(claim.expect, OfOrder)
    ]


class _Pilot(NamedTuple):
    """Rows by id, and by spec how many times as many trials are planned."""

    rows: Mapping[str, Row]
    times: Mapping[str, float]


def _pilot(
    publication: Publication, results: Path, planned: Mapping[str, int]
) -> _Pilot:
    stored: Stored = stored_studies(publication, results)
    rows, _ = judged(publication, stored)
    return _Pilot(
        {row.claim.id: row for row in rows},
        {spec: planned[spec] / one.statuses()["done"] for spec, one in stored.items()},
    )


def _planned(study: Study) -> int:
    return study.most_trials(expand(study).n_points)


def _foreseen(claim: Claim, family: int, pilots: Sequence[_Pilot]) -> Foreseen | None:
    """By the first of the pilots that has an interval. A claim on several specs has the
    factor of the one that grows least.
    """
    expect = claim.expect
    if claim.measure is None or claim.spec is None or expect is None:
        return None
    if isinstance(expect, OfOrder):
        return None
    specs = specs_of(claim.measure, [claim.spec])
    for pilot in pilots:
        found = pilot.rows[claim.id].measured
        if found is None or isinstance(found.estimate, Scaling):
            continue
        if found.estimate.testable:
            times = min(pilot.times[spec] for spec in specs)
            return foresee(found.estimate, expect, family, found.used, times)
    return None


def outlook_lines(name: str, found: Sequence[Outlook]) -> Iterator[str]:
    """What the claims of a document could notice, in words: the weak ones first."""
    known = [one for one in found if one.foreseen]
    weak = [one for one in known if one.foreseen and one.foreseen.weak]
    unknown = [one.claim.id for one in found if not one.foreseen]
    yield (
        f"{name}: {len(weak)} of {len(known)} claims are weak, as their planned trials"
        " cannot confirm them"
    )
    for one in sorted(known, key=lambda one: one not in weak):
        if one.foreseen:
            mark = "weak  " if one in weak else "      "
            yield f"  {mark}{_line(one.claim, one.foreseen)}"
    if unknown:
        yield f"  no trial to judge from: {', '.join(unknown)}"


def _line(claim: Claim, found: Foreseen) -> str:
    said = f"{claim.id}: {found.trials:,} trials notice {brief(found.noticeable)}"
    if found.margin < math.inf:
        said += f", the margin is {brief(found.margin)}"
        does = "would notice it"
    else:
        does = "would decide it if our mean stayed"
    if found.enough is None:
        return f"{said}; no number {does}"
    return f"{said}; about {found.enough:,} {does}"
