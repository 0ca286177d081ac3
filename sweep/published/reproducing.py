"""Reproduction of all publications.

Missing trials run, figures that are out of date are drawn, all claims are judged, and
the page is written.
"""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from sweep.campaigns import Display
from sweep.errors import OutputError
from sweep.published.drawings import (
    WATERMARK,
    ClaimsFile,
    FigureFile,
    forest_file,
    numerics_file,
)
from sweep.published.judging import Stored, judged, stored_studies
from sweep.published.publications import FULL, QUICK, Publication
from sweep.published.running import run_studies
from sweep.published.scorecard import Page, Picture, Section
from sweep.published.scorecard_html import as_html
from sweep.published.scorecard_json import as_json
from sweep.published.scorecard_markdown import as_markdown
from sweep.published.trying import fingerprint
from sweep.published.turned import DocumentVariants, read_turned
from sweep.published.verdicts import Status
from sweep.spec import SCORECARD
from sweep.store import replacing
from sweep.workers import ExecutorFactory


class PageFolder(NamedTuple):
    """Folder for pages and figures, with a watermark; "" for no watermark.

    `results` is the folder that the user has named; contains `root` or equals `root`.
    """

    root: Path
    watermark: str
    results: Path


@dataclass
class Outcome:
    """Counts and failures of a reproduction.

    Attributes
    ----------
    page : Path
        The scorecard as HTML.
    new : int
        Number of new trials.
    not_done : int
        Number of planned trials that are not done.
    drawn : int
        Number of figures that were drawn.
    up_to_date : int
        Number of figures that needed no drawing.
    failures : list of str
    statements : dict of str to Counter
        By publication, the number of statements per verdict.
    seconds : dict of str to float
        Wall time of each phase in seconds.
    """

    page: Path
    new: int = 0
    not_done: int = 0
    drawn: int = 0
    up_to_date: int = 0
    failures: list[str] = field(default_factory=list)
    statements: dict[str, Counter[Status]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def whole(self) -> bool:
        """True if all trials, figures and measures were completed.

        Verdicts do not matter, because verdicts are results.
        """
        return not self.not_done and not self.failures

    def summary(self) -> str:
        """Return the outcome in a few lines."""
        times = ", ".join(
            f"{phase} {seconds:.1f} s" for phase, seconds in self.seconds.items()
        )
        lines = [f"failed: {failure}" for failure in self.failures]
        lines.append(
            f"trials: {self.new:,} new"
            + (f", {self.not_done:,} not done" if self.not_done else "")
        )
        lines.append(f"figures: {self.drawn} drawn, {self.up_to_date} up to date")
        for document, statuses in self.statements.items():
            counts = [f"{count} {status}" for status, count in sorted(statuses.items())]
            text = ", ".join(counts) or "not compared with the publication"
            lines.append(f"statements of {document}: {text}")
        return "\n".join([*lines, f"time: {times}", f"page: {self.page}"])


def reproduce(
    publications: Sequence[Publication],
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
    *,
    quick: bool = False,
) -> Outcome:
    """Run, draw and judge the publications, and write the scorecard.

    `scorecard.html`, `.md` and `.json` are written below `results`. If a trial, a
    figure or a measure fails, the failure is noted and the rest continues.

    Parameters
    ----------
    publications : sequence of Publication
        All publications. Selected publications are run, drawn and shown on the page.
        One line names the publications that are not selected.
    results : Path
        Folder with the stored studies.
    engine : ExecutorFactory
        Runs the trials.
    display : callable
        Makes the progress display of a study from its name.
    quick : bool, default False
        True if the publications were read at the quick scale.

    Raises
    ------
    SpecError, StoreError
        In the cases of a launch; also StoreError for a damaged file of variants.
    OutputError
        If the page cannot be written.
    """
    selected = [publication for publication in publications if publication.selected]
    root = results / QUICK if quick else results
    outcome = Outcome(root / SCORECARD[0])
    times = [time.monotonic()]
    turned = read_turned(results)
    for publication in selected:
        ran = run_studies(publication.studies.values(), results, engine, display)
        outcome.new += ran.new
        outcome.not_done += ran.not_done
    times.append(time.monotonic())
    stored = {
        publication.name: stored_studies(publication, results)
        for publication in publications
    }
    folder = PageFolder(root, WATERMARK if quick else "", results)
    files = {
        publication.name: [
            FigureFile(publication, name, stored[publication.name], *folder)
            for name in publication.drawings
        ]
        for publication in publications
    }
    for publication in selected:
        for file in files[publication.name]:
            label = f"figure {publication.name}/{file.name}"
            if file.possible:
                _draw(file, label, outcome)
            else:
                outcome.failures.append(f"{label}: no trial of the figure is done")
    times.append(time.monotonic())
    sections = [
        _section(
            publication,
            stored[publication.name],
            files[publication.name],
            folder,
            tried=turned.get(publication.name),
            outcome=outcome,
        )
        for publication in publications
    ]
    _write(Page(root, sections, QUICK if quick else FULL, folder.watermark), results)
    times.append(time.monotonic())
    phases = zip(("trials", "figures", "page"), times, times[1:], strict=False)
    outcome.seconds = {phase: until - since for phase, since, until in phases}
    return outcome


def _draw(file: FigureFile | ClaimsFile, label: str, outcome: Outcome) -> None:
    if file.current():
        outcome.up_to_date += 1
        return
    try:
        file.draw()
        outcome.drawn += 1
    except Exception as error:
        outcome.failures.append(f"{label}: {type(error).__name__}: {error}")


def _section(
    publication: Publication,
    stored: Stored,
    files: Sequence[FigureFile],
    folder: PageFolder,
    tried: DocumentVariants | None,
    outcome: Outcome,
) -> Section:
    """Return the section of a publication, and draw the figures of claims."""
    rows, failures = judged(publication, stored)
    outcome.failures += failures
    if tried and tried.inputs != fingerprint(publication):
        tried = None
    of_claims = [
        file
        for file in (
            forest_file(publication, rows, *folder),
            numerics_file(publication, tried, folder.root, folder.results),
        )
        if file
    ]
    for file in of_claims:
        _draw(file, f"figure {file.name} of {publication.name}", outcome)
    section = Section(
        publication=publication,
        rows=rows,
        pictures={file.name: _picture(file, file.drawing.text) for file in files},
        of_claims=[_picture(file, file.text) for file in of_claims],
        folders={
            spec: folder.results / study.name
            for spec, study in publication.studies.items()
            if spec in stored
        },
        origins=[study.provenance for study in stored.values()],
        variants=tried,
    )
    if publication.selected:
        outcome.statements[publication.name] = section.tallies["statement"]
    return section


def _picture(file: FigureFile | ClaimsFile, text: str) -> Picture:
    return Picture(file.name, text, file.path if file.current() else None)


def _write(page: Page, results: Path) -> None:
    texts = as_html(page), as_markdown(page), as_json(page)
    try:
        results.mkdir(parents=True, exist_ok=True)
        for name, text in zip(SCORECARD, texts, strict=True):
            with replacing(page.root / name, results) as file:
                file.write(text.encode())
    except OSError as error:
        raise OutputError(
            f"{page.root}: cannot write the page ({error});"
            " trials and figures are stored"
        ) from None
