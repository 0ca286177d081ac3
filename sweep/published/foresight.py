"""Differences that the claims of a publication could detect with the planned trials.

The estimate precedes the run. The spread comes from a pilot: the stored trials of the
full scale, or otherwise of the quick scale. A claim is weak if the detectable
difference exceeds the margin, so that the planned trials cannot confirm the claim.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from sweep.design import expand
from sweep.methods.scaling import Scaling
from sweep.published.claims import Claim
from sweep.published.judging import Row, Stored, judged, stored_studies
from sweep.published.measures import specs_of
from sweep.published.publications import Publication
from sweep.published.verdicts import Foreseen, OfOrder, brief, foresee
from sweep.spec import Study


class Outlook(NamedTuple):
    """A claim and the foreseen power.

    `foreseen` is None without a pilot that has a confidence interval.
    """

    claim: Claim
    foreseen: Foreseen | None


def outlooks(full: Publication, quick: Publication, results: Path) -> list[Outlook]:
    """Return the outlooks of the tested claims with all planned trials.

    Claims on the order of a transition are left out, because no half-width
    decides such a claim.

    Parameters
    ----------
    full : Publication
        The publication at the full scale.
    quick : Publication
        The publication at the quick scale.
    results : Path
        Folder with the stored pilot studies.
    """
    planned = {spec: _planned(study) for spec, study in full.studies.items()}
    pilots = [_pilot(publication, results, planned) for publication in (full, quick)]
    return [
        Outlook(claim, _foreseen(claim, full.family, pilots))
        for claim in full.claims
        if claim.measure and not isinstance(claim.expect, OfOrder)
    ]


class _Pilot(NamedTuple):
    """Judged rows by claim, and by spec the ratio of planned to stored trials."""

    rows: Mapping[str, Row]
    times: Mapping[str, float]


def _pilot(
    publication: Publication, results: Path, planned: Mapping[str, int]
) -> _Pilot:
    stored: Stored = stored_studies(publication, results)
    rows, _ = judged(publication, stored)
    return _Pilot(
        {row.claim.id: row for row in rows},
        {
            spec: planned[spec] / study.statuses()["done"]
            for spec, study in stored.items()
        },
    )


def _planned(study: Study) -> int:
    return study.most_trials(expand(study).n_points)


def _foreseen(claim: Claim, family: int, pilots: Sequence[_Pilot]) -> Foreseen | None:
    """Return the foresight from the first pilot that has a confidence interval.

    A claim on several specs gets the smallest factor of these specs.
    """
    expect = claim.expect
    if claim.measure is None or claim.spec is None or expect is None:
        return None
    if isinstance(expect, OfOrder):
        return None
    specs = specs_of(claim.measure, [claim.spec])
    for pilot in pilots:
        measured = pilot.rows[claim.id].measured
        if measured is None or isinstance(measured.estimate, Scaling):
            continue
        if measured.estimate.testable:
            times = min(pilot.times[spec] for spec in specs)
            return foresee(
                measured.estimate, expect, family, trials=measured.used, times=times
            )
    return None


def outlook_lines(name: str, claim_outlooks: Sequence[Outlook]) -> Iterator[str]:
    """Yield the outlooks of a publication in words, the weak claims first."""
    foreseen = [outlook for outlook in claim_outlooks if outlook.foreseen]
    weak = [
        outlook for outlook in foreseen if outlook.foreseen and outlook.foreseen.weak
    ]
    unknown = [outlook.claim.id for outlook in claim_outlooks if not outlook.foreseen]
    yield (
        f"{name}: {len(weak)} of {len(foreseen)} claims are weak: the planned trials"
        " cannot confirm these claims"
    )
    for outlook in sorted(foreseen, key=lambda outlook: outlook not in weak):
        if outlook.foreseen:
            mark = "weak  " if outlook in weak else "      "
            yield f"  {mark}{_line(outlook.claim, outlook.foreseen)}"
    if unknown:
        yield f"  no pilot trials: {', '.join(unknown)}"


def _line(claim: Claim, foreseen: Foreseen) -> str:
    text = f"{claim.id}: {foreseen.trials:,} trials detect {brief(foreseen.noticeable)}"
    if foreseen.margin < math.inf:
        text += f", the margin is {brief(foreseen.margin)}"
        does = "would detect the margin"
    else:
        does = "would decide the claim, for an unchanged mean"
    if foreseen.enough is None:
        return f"{text}; no number of trials {does}"
    return f"{text}; about {foreseen.enough:,} trials {does}"
