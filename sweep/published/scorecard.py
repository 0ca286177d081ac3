"""The scorecard: rows of each publication, one per claim, and the counts.

The scorecard is available as HTML, Markdown and JSON.
"""

import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from sweep.analysis import number, with_interval
from sweep.methods.scaling import Scaling
from sweep.published.judging import Row
from sweep.published.program_mutants import PROGRAM_MUTANTS
from sweep.published.publications import Publication
from sweep.published.statements import Group, tallies
from sweep.published.turned import SLIGHT, DocumentVariants
from sweep.published.variants import Kind
from sweep.published.verdicts import (
    LEVEL,
    Above,
    Below,
    OfOrder,
    Status,
    Value,
    Within,
    brief,
)
from sweep.store import device_said

TITLE = "Reproducibility of the published results"
ORDER: tuple[Status, ...] = (
    "refuted",
    "undecided",
    "partial",
    "not testable",
    "not run",
    "confirmed",
)
MARKS: dict[Status, str] = {
    "refuted": "✗",
    "undecided": "?",
    "partial": "…",
    "not testable": "○",
    "not run": "-",
    "confirmed": "✓",
}
LISTED: dict[Status, str] = {
    "refuted": "Refuted",
    "undecided": "Undecided",
    "not testable": "Not testable",
}
"""Verdicts whose rows are listed above all tables, with headings."""
COUNTED: dict[Group, str] = {
    "statement": "Statements of the publications",
    "exact": "Exact results, which need no publication",
    "hypothesis": "Our own hypotheses, and claims not compared with the publication",
    "fit": "Tests of fitted values: shown, not counted",
}
HEADINGS = (
    "claim",
    "published",
    "our estimate, 95 % interval",
    "trials",
    "detectable difference",
    "verdict",
    "variants with another verdict",
    "see",
)
UNTURNED = "no mutant changes the verdict"
TRIED: dict[Kind, str] = {
    "mutants": "Detected mutants",
    "details": "Details that change verdicts",
    "numerics": "Verdicts that depend on time step, order of updates or seed",
}
"""Kinds of variants, with headings."""
MOST_NAMED = 8
"""Largest number of variants of a kind that a row names."""


class Picture(NamedTuple):
    """A figure.

    `path` is without the endings of the files. A figure that was not drawn from the
    presently stored trials has the path None.
    """

    name: str
    text: str
    path: Path | None


@dataclass(frozen=True)
class Section:
    """Rows and figures of a publication.

    Attributes
    ----------
    publication : Publication
    rows : sequence of Row
    pictures : mapping of str to Picture
        Figures of the publication by name.
    of_claims : sequence of Picture
        Figures of all claims of the publication.
    folders : mapping of str to Path
        Folders of the stored studies by spec.
    origins : sequence of dict
        Provenance of the stored studies.
    variants : DocumentVariants, optional
        Effects of variants; None without tried variants for the present inputs.
    """

    publication: Publication
    rows: Sequence[Row]
    pictures: Mapping[str, Picture]
    of_claims: Sequence[Picture]
    folders: Mapping[str, Path]
    origins: Sequence[dict[str, Any]]
    variants: DocumentVariants | None = None

    def ordered(self) -> list[Row]:
        """Return the rows, refuted rows first and confirmed rows last."""
        return sorted(self.rows, key=lambda row: ORDER.index(row.verdict.status))

    def anchor(self, row: Row) -> str:
        """Return the name of a row, for links."""
        return f"{self.publication.name}-{row.claim.id}"

    @cached_property
    def tallies(self) -> dict[Group, Counter[Status]]:
        """Number of statements per verdict, by group."""
        return tallies(self.rows)

    def tried(self, kind: Kind) -> DocumentVariants | None:
        """Return the effects of variants; None without tried variants of the kind.

        For mutants, also return None if some mutants were not tried.
        """
        effects = self.variants.tried(kind) if self.variants else {}
        mutants = {
            *PROGRAM_MUTANTS,
            *(mutant.name for mutant in self.publication.mutants),
        }
        complete = kind != "mutants" or effects.keys() >= mutants
        return self.variants if effects and complete else None

    def turning(self, kind: Kind, row: Row) -> dict[str, Status] | None:
        """Return the variants that turn a row, each with the new verdict.

        Parameters
        ----------
        kind : Kind
            Kind of the variants.
        row : Row
            Row of the section.

        Returns
        -------
        dict of str to Status or None
            None if no variant was tried, or if the row has no verdict without variants.
        """
        effects = self.tried(kind)
        claim = row.claim.id
        return (
            effects.turning(kind, claim)
            if effects and claim in effects.before
            else None
        )

    def unjudging(self, kind: Kind, row: Row) -> dict[str, str]:
        """Return the variants without a verdict on a row, each with the reason.

        Parameters
        ----------
        kind : Kind
            Kind of the variants.
        row : Row
            Row of the section.
        """
        effects = self.tried(kind)
        return effects.unjudging(kind, row.claim.id) if effects else {}

    def mutants(self, row: Row) -> list[str] | None:
        """Return the mutants that a row kills; None without tried mutants."""
        effects = self.tried("mutants")
        if effects is None:
            return None
        return [name for name, ids in effects.killed_by.items() if row.claim.id in ids]

    def least_share(self, row: Row) -> float | None:
        """Return the smallest relative change of one parameter that turns a row."""
        effects = self.tried("details")
        return effects.least_share(row.claim.id) if effects else None

    def weaknesses(self, row: Row) -> list[str]:
        """Return the reasons why a row is weak; empty for a strong row."""
        reasons = [_beyond(row)] if row.verdict.weak else []
        confirmed = row.claim.counted and row.verdict.status == "confirmed"
        return reasons + ([UNTURNED] if confirmed and self.mutants(row) == [] else [])


class Page(NamedTuple):
    """All sections; sections of selected publications are `shown`.

    Links are relative to `root`. `scale` is "full" or "quick".
    """

    root: Path
    sections: Sequence[Section]
    scale: str
    watermark: str

    @property
    def shown(self) -> list[Section]:
        """Sections of the selected publications."""
        return [section for section in self.sections if section.publication.selected]

    @property
    def unasked(self) -> str:
        """Sentence with the publications that are not selected; or ""."""
        names = [
            section.publication.name
            for section in self.sections
            if not section.publication.selected
        ]
        return f"Not requested, and so not shown: {', '.join(names)}." if names else ""

    def counts(self, group: Group) -> dict[str, Counter[Status]]:
        """Return, by publication, the number of statements of a group per verdict.

        Publications without such statements are left out.
        """
        tallies = {
            section.publication.name: section.tallies[group] for section in self.shown
        }
        return {name: counts for name, counts in tallies.items() if counts}

    def of_status(self, status: Status) -> Iterator[tuple[Section, Row]]:
        """Yield the rows with a verdict, each after the section of the row."""
        for section in self.shown:
            for row in section.rows:
                if row.verdict.status == status:
                    yield section, row

    def link(self, path: Path) -> str:
        """Return the relative link to `path`."""
        return Path(os.path.relpath(path, self.root)).as_posix()

    def links(self, section: Section, row: Row) -> list[tuple[str, str]]:
        """Return text and address of the figure, the spec and the trials of a row.

        Parameters
        ----------
        section : Section
        row : Row
            Row of the section.
        """
        claim = row.claim
        picture = section.pictures[claim.figure] if claim.figure else None
        folder = section.folders.get(claim.spec) if claim.spec else None
        links = (
            [("figure", f"{self.link(picture.path)}.png")]
            if picture and picture.path
            else []
        )
        if folder:
            links += [
                ("spec", self.link(folder / "spec.yaml")),
                ("trials", self.link(folder / "parts")),
            ]
        return links


def rule() -> list[str]:
    """Return the rule of the verdicts, in paragraphs."""
    return [
        (
            "Verdicts are computed, and can fail. The claims of a publication form a"
            " family. With m claims, each claim has a simultaneous confidence interval"
            f" of level 1 - {LEVEL:.2g}/m (Bonferroni), which is wider than the 95 %"
            " interval shown. So the probability of even one wrong verdict in a"
            f" publication, confirmed or refuted, is at most {100 * LEVEL:.0f} %."
        ),
        (
            "A number is confirmed if the whole simultaneous interval is within the"
            " margin and the rounding. A number is refuted if the whole interval is"
            " outside. The margin was stated with a reason, and does not depend on our"
            " interval. If the number of published trials is known, the chance error"
            " of the published mean counts too, with our standard deviation. Otherwise"
            " the published number is taken to be exact. A single bound, or a range of"
            " two bounds, is confirmed or refuted in the same way."
        ),
        (
            "All remaining claims are undecided, with the number of trials that would"
            " decide the claim for an unchanged mean and spread. A claim with missing"
            " planned trials is partial, with provisional numbers. A claim without"
            " trials is not run, and has no verdict. Rank correlations have Fisher's"
            " interval with the variance of Bonett and Wright. The verdict on the order"
            " of a transition is the result of `sweep scaling` with the simultaneous"
            " confidence, or undecided without a result. The table also shows the"
            " result with 95 % confidence."
        ),
        (
            "Statements are counted, not rows. A statement is refuted if a row of the"
            " statement is refuted, and confirmed if all testable rows are confirmed."
            " A claim is a printed number, our reading of a sentence, an exact result"
            " of the equations, our own hypothesis, or a test of a fitted value. Exact"
            " results and hypotheses are counted separately. Expectations from memory,"
            " without a comparison with the publication, count as hypotheses. Fits are"
            " shown only."
        ),
        (
            "The detectable difference is the half-width of the simultaneous interval."
            " A row is weak if the half-width is more than the margin, because these"
            " trials cannot confirm the claim. The row reports the number of trials"
            " that could, for an unchanged spread and a mean as expected. A confirmed"
            " row is also weak if no mutant, a wrong version of the study, changes"
            " the verdict. Variants are tried with few trials: a verdict that changes"
            " with the seed changes by chance. Incomplete trials, and trials without a"
            " value of the measure, are left out and counted."
        ),
    ]


def _beyond(row: Row) -> str:
    """Return why a row cannot be confirmed, and the number of trials that could."""
    enough = row.verdict.enough
    text = "no number of trials could" if enough is None else f"about {enough:,} could"
    return f"these trials cannot confirm the claim, {text}"


def family_text(section: Section) -> str:
    """Return the level at which each claim of a section is tested, in words."""
    family = section.publication.family
    return (
        f"{family} of {len(section.rows)} claims are counted and tested together, each"
        f" at {LEVEL:.2g}/{max(family, 1)} = {LEVEL / max(family, 1):.2g}."
    )


def variants_text(section: Section, kind: Kind) -> str:
    """Return in words the number of verdicts that the variants turn."""
    effects = section.tried(kind)
    if effects is None:
        return f"no {kind} were tried with the present claims, specs and code"
    return effects.summary(kind)


def kind_text(row: Row) -> str:
    """Return the kind of a claim and the day of its registration.

    An example is `number, registered 2026-03-01, such results first seen after that`.
    """
    claim = row.claim
    parts = [claim.kind, f"registered {claim.registered.isoformat()}"]
    parts += [f"such results first seen {claim.looked} that"] if claim.looked else []
    parts += [f"statement {claim.statement}"] if claim.statement != claim.id else []
    parts += [f"unverified: {claim.unverified}"] if claim.unverified else []
    return ", ".join(parts) + (
        f"; also tried: {claim.alternatives}" if claim.alternatives else ""
    )


def weakness_text(section: Section, row: Row) -> str:
    """Return why a row is weak; "" for a strong row."""
    reasons = section.weaknesses(row)
    return f"weak: {' and '.join(reasons)}" if reasons else ""


def turning_texts(section: Section, row: Row) -> list[str]:
    """Return the variants that turn a row, one text per kind.

    The list is empty for a claim that does not count.
    """
    if not row.claim.counted:
        return []
    killers = section.mutants(row)
    parts = [] if killers is None else [f"mutants: {', '.join(killers) or 'none'}"]
    for kind in ("details", "numerics"):
        turning = section.turning(kind, row)
        if turning is not None:
            parts.append(f"{kind}: {_listed(turning) or 'none'}")
        if unjudging := section.unjudging(kind, row):
            parts.append(f"not judged with {_listed(unjudging)}")
    share = section.least_share(row)
    if share is not None and share <= SLIGHT:
        parts.append(f"a change of {100 * share:.2g} % changes the verdict")
    return parts


def _listed(texts: Mapping[str, str]) -> str:
    """Return the first variants, each with a text, such as `n-up-2 (refuted)`."""
    named = [f"{name} ({text})" for name, text in texts.items()]
    more = len(named) - MOST_NAMED
    return ", ".join(named[:MOST_NAMED]) + (f" and {more:,} more" if more > 0 else "")


def reason(row: Row) -> str:
    """Return the reason of a verdict as a sentence."""
    return sentence(row.verdict.reason)


def sentence(text: str) -> str:
    """Return `text` with a capital letter and a full stop."""
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def published_text(row: Row) -> str:
    """Return the expectation, such as `57.30; mean of 3 trials; margin 0.5: REASON`."""
    expect = row.claim.expect
    if isinstance(expect, Value):
        parts = [_printed(expect)]
        parts += [f"mean of {expect.trials:,} trials"] if expect.trials else []
        parts += (
            [f"margin {expect.margin:g}: {expect.because}"]
            if expect.margin > 0.0
            else []
        )
        return "; ".join(parts)
    if isinstance(expect, Above):
        return f"above {expect.bound:g}"
    if isinstance(expect, Below):
        return f"below {expect.bound:g}"
    if isinstance(expect, OfOrder):
        return expect.order
    return f"{expect.low:g} to {expect.high:g}" if isinstance(expect, Within) else ""


def _printed(expect: Value) -> str:
    """Return the value with the decimals that the rounding implies."""
    if expect.rounding == 0:
        return f"{expect.value:g}"
    return f"{expect.value:.{max(0, round(-math.log10(2 * expect.rounding)))}f}"


def ours_text(row: Row) -> str:
    """Return our estimate and its 95 % confidence interval.

    All numbers end at the second significant digit of the half-width.
    """
    if row.measured is None:
        return ""
    if isinstance(row.measured.estimate, Scaling):
        return row.measured.estimate.order.order
    value = row.measured.estimate.value
    interval = row.verdict.interval
    if math.isnan(value):
        return ""
    return number(value) if interval is None else with_interval(value, *interval)


def trials_text(row: Row) -> str:
    """Return the number of trials, and the number of excluded trials."""
    if row.measured is None:
        return ""
    left_out = row.measured.left_out
    return row.measured.trials + (f" ({left_out:,} left out)" if left_out else "")


def noticeable_text(row: Row) -> str:
    """Return the smallest difference that the test could detect."""
    return "" if row.verdict.noticeable is None else brief(row.verdict.noticeable)


def origin_lines(page: Page) -> list[tuple[str, str]]:
    """Return the origin of the trials.

    Each line has a name and all distinct values over all studies.
    """
    origins = [origin for section in page.shown for origin in section.origins]
    lines = {
        "kernels_sha": [origin["kernels_sha"] for origin in origins],
        "commit": [_commit(origin["git"]) for origin in origins],
        "versions": [
            ", ".join(f"{name} {number}" for name, number in origin["versions"].items())
            for origin in origins
        ],
        "device": [device_said(origin) for origin in origins if "device" in origin],
        "processor": [origin["cpu"] for origin in origins],
        "system": [origin["platform"] for origin in origins],
    }
    return [
        (name, "; ".join(dict.fromkeys(values)))
        for name, values in lines.items()
        if values
    ]


def _commit(git: Mapping[str, str]) -> str:
    return f"{git.get('commit', 'unknown')}{' with changes' if git.get('diff') else ''}"
