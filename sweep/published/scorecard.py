"""The rows of the scorecard, one a published claim: HTML and Markdown show them."""

import math
import os
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from sweep.analysis.notation import number, with_interval
from sweep.published.claims import Claim, Publication
from sweep.published.estimates import Measured
from sweep.published.verdicts import (
    LEVEL,
    Above,
    Below,
    Status,
    Value,
    Verdict,
    Within,
    brief,
)

TITLE = "What of the published results could be reproduced"
ORDER: tuple[Status, ...] = (
    "not reproduced",
    "not testable as published",
    "reproduced",
)
MARKS: dict[Status, str] = {
    "not reproduced": "✗",
    "not testable as published": "○",
    "reproduced": "✓",
}
HEADINGS = (
    "claim",
    "published",
    "ours, 95 % interval",
    "trials",
    "noticeable",
    "verdict",
    "see",
)


class Row(NamedTuple):
    """A claim with its verdict, and what was measured; None where nothing was."""

    claim: Claim
    verdict: Verdict
    measured: Measured | None = None


class Picture(NamedTuple):
    """A figure. `path` lacks the endings of its two files. It is None if the figure was
    not drawn from the trials that are stored now.
    """

    name: str
    text: str
    path: Path | None


class Section(NamedTuple):
    """The rows and figures of a publication. `folders` has the stored studies by spec,
    `origins` their provenance.
    """

    publication: Publication
    rows: Sequence[Row]
    pictures: Mapping[str, Picture]
    folders: Mapping[str, Path]
    origins: Sequence[dict[str, Any]]

    def ordered(self) -> list[Row]:
        """The rows, those not reproduced first."""
        return sorted(self.rows, key=lambda row: ORDER.index(row.verdict.status))

    def anchor(self, row: Row) -> str:
        """The name of a row, for links."""
        return f"{self.publication.name}-{row.claim.id}"


class Page(NamedTuple):
    """All sections; links are relative to `root`, `claims` counts those tested."""

    root: Path
    sections: Sequence[Section]
    claims: int
    watermark: str

    def counts(self) -> dict[Status, int]:
        """The number of claims by verdict."""
        found = Counter(
            row.verdict.status for section in self.sections for row in section.rows
        )
        return {status: found[status] for status in ORDER}

    def of_status(self, status: Status) -> Iterator[tuple[Section, Row]]:
        """The rows with this verdict, and their sections."""
        for section in self.sections:
            for row in section.rows:
                if row.verdict.status == status:
                    yield section, row

    def link(self, path: Path) -> str:
        """The relative link to `path`."""
        return Path(os.path.relpath(path, self.root)).as_posix()

    def links(self, section: Section, row: Row) -> list[tuple[str, str]]:
        """Text and address of what a row refers to: its figure, spec and trials."""
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


def rule(page: Page) -> list[str]:
    """How verdicts are computed, in paragraphs."""
    claims, level = page.claims, LEVEL / max(page.claims, 1)
    return [
        (
            f"Verdicts are computed, two-sided, and can fail. {claims} claims are"
            f" tested on this page, each at the level {LEVEL:g}/{max(claims, 1)} ="
            f" {level:.2g} (Bonferroni). So the chance that the page calls even one"
            " true number not reproduced, or one false bound reproduced, is at most"
            f" {100 * LEVEL:.0f} %. The simultaneous interval that a verdict uses is"
            " therefore wider than the 95 % interval shown."
        ),
        (
            "A number is reproduced where our mean differs from it by no more than half"
            " the simultaneous Student (for two groups Welch) interval, plus its"
            " rounding, plus a margin where one is stated with its reason. Where the"
            " number of published trials is known, their chance error counts too, with"
            " our standard deviation; where it is not, the published number is taken to"
            " be exact."
        ),
        (
            "That something lies above or below a bound, or within two, is reproduced"
            " only where the whole simultaneous interval does; the reason says whether"
            " the opposite was shown or nothing could be. Rank correlations have"
            " Fisher's interval with the variance of Bonett and Wright."
        ),
        (
            "Noticeable is the smallest difference from the published number, or"
            " distance from the bound, that the test could notice: a large one marks a"
            " weak test. Trials that did not come to their end are left out, and"
            " counted."
        ),
    ]


def reason(row: Row) -> str:
    """The reason of a verdict as a sentence."""
    return sentence(row.verdict.reason)


def sentence(text: str) -> str:
    """`text` with a capital letter and a full stop."""
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")


def published_text(row: Row) -> str:
    """What is expected, such as `57.30 ± 0.005, 3 trials`."""
    expect = row.claim.expect
    if isinstance(expect, Value):
        parts = [_printed(expect)]
        parts += [f"mean of {expect.trials:,} trials"] if expect.trials else []
        parts += (
            [f"margin {expect.margin:g}: {expect.because}"]
            if expect.margin is not None
            else []
        )
        return "; ".join(parts)
    if isinstance(expect, Above):
        return f"above {expect.bound:g}"
    if isinstance(expect, Below):
        return f"below {expect.bound:g}"
    return f"{expect.low:g} to {expect.high:g}" if isinstance(expect, Within) else ""


def _printed(expect: Value) -> str:
    """The value with as many decimals as its rounding means."""
    if expect.rounding == 0:
        return f"{expect.value:g}"
    return f"{expect.value:.{max(0, round(-math.log10(2 * expect.rounding)))}f}"


def ours_text(row: Row) -> str:
    """Our estimate and its 95 % interval. Both end at the second significant digit of
    the half width.
    """
    if row.measured is None or math.isnan(row.measured.estimate.value):
        return ""
    value, interval = row.measured.estimate.value, row.verdict.interval
    return number(value) if interval is None else with_interval(value, *interval)


def trials_text(row: Row) -> str:
    """The number of trials, and how many were left out."""
    if row.measured is None:
        return ""
    left_out = row.measured.left_out
    return row.measured.trials + (f" ({left_out:,} left out)" if left_out else "")


def noticeable_text(row: Row) -> str:
    """The smallest difference that the test could notice."""
    return "" if row.verdict.noticeable is None else brief(row.verdict.noticeable)


def origin_lines(page: Page) -> list[tuple[str, str]]:
    """Where the trials come from. Each line has a name and all distinct values over all
    studies.
    """
    origins = [origin for section in page.sections for origin in section.origins]
    found = {
        "kernels_sha": [origin["kernels_sha"] for origin in origins],
        "commit": [_commit(origin["git"]) for origin in origins],
        "versions": [
            ", ".join(f"{name} {number}" for name, number in origin["versions"].items())
            for origin in origins
        ],
        "processor": [origin["cpu"] for origin in origins],
        "system": [origin["platform"] for origin in origins],
    }
    return [
        (what, "; ".join(dict.fromkeys(values)))
        for what, values in found.items()
        if values
    ]


def _commit(git: Mapping[str, str]) -> str:
    return f"{git.get('commit', 'unknown')}{' with changes' if git.get('diff') else ''}"
