"""Statements of a publication: claims on one statement are counted once."""

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Literal, get_args

from sweep.published.claims import Claim, Kind
from sweep.published.judging import Row
from sweep.published.verdicts import Status

Group = Literal["statement", "exact", "hypothesis", "fit"]
"""Groups that are counted separately.

The groups are statements of the publication, exact results, our own hypotheses, and
fits.
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
"""Verdicts in order of precedence.

The verdict on a statement is the first of these verdicts that a row has.
"""


def group_of(claim: Claim) -> Group:
    """Return the group in which a claim is counted.

    A claim that has not been compared with the publication is our own hypothesis.
    """
    return "hypothesis" if claim.unverified else GROUP_OF[claim.kind]


def tallies(rows: Iterable[Row]) -> dict[Group, Counter[Status]]:
    """Return the number of statements per verdict, by group.

    Rows of one statement count once in a group.
    """
    by_statement: dict[tuple[Group, str], list[Status]] = {}
    for row in rows:
        key = group_of(row.claim), row.claim.statement
        by_statement.setdefault(key, []).append(row.verdict.status)
    counts: dict[Group, Counter[Status]] = {group: Counter() for group in GROUPS}
    for (group, _), statuses in by_statement.items():
        counts[group][together(statuses)] += 1
    return counts


def together(statuses: Iterable[Status]) -> Status:
    """Return the verdict on a statement from the verdicts of rows."""
    return min(statuses, key=DECISIVE.index)
