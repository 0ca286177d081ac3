"""Statements of a document: claims on the same one are counted once."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Literal, get_args

from sweep.published.claims import Claim, Kind
from sweep.published.judging import Row
from sweep.published.verdicts import Status

Group = Literal["statement", "exact", "hypothesis", "fit"]
"""What is counted apart: statements of the document, exact results, hypotheses of ours,
and fits.
"""
GROUPS: tuple[Group, ...] = get_args(Group)
GROUP_OF: Mapping[Kind, Group] = {
    "number": "statement",
    "reading": "statement",
    "exact": "exact",
    "hypothesis": "hypothesis",
    "fit": "fit",
}
DECISIVE: tuple[Status, ...] = (
    "refuted",
    "undecided",
    "partial",
    "not run",
    "confirmed",
    "not testable",
)
"""The first of these that one of its rows has is the verdict on a statement."""


def group_of(claim: Claim) -> Group:
    """Where a claim is counted. What has not been compared with the document is a
    hypothesis of ours about it.
    """
    return "hypothesis" if claim.unverified else GROUP_OF[claim.kind]


def tallies(rows: Iterable[Row]) -> dict[Group, Counter[Status]]:
    """How many statements, exact results, hypotheses and fits of a document have which
    verdict.

    Rows of the same statement count once in their group.
    """
    found: dict[tuple[Group, str], list[Status]] = {}
    for row in rows:
        key = group_of(row.claim), row.claim.statement
        found.setdefault(key, []).append(row.verdict.status)
    counts: dict[Group, Counter[Status]] = {group: Counter() for group in GROUPS}
    for (group, _), statuses in found.items():
        counts[group][together(statuses)] += 1
    return counts


def together(statuses: Iterable[Status]) -> Status:
    """The verdict on a statement whose rows have these verdicts."""
    return min(statuses, key=DECISIVE.index)
