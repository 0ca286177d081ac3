"""Reproduces everything that was published: runs missing trials, draws figures that are
out of date, judges all claims, writes the page.
"""

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from sweep.campaigns.progress import Display
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
from sweep.spec.study_folder import SCORECARD
from sweep.store.new_files import replacing
from sweep.workers.executors import ExecutorFactory


class PageFolder(NamedTuple):
    """Where pages and figures are written: `root` is the folder `results` that the user
    has named, or lies in it. They get a watermark; "" for none.
    """

    root: Path
    watermark: str
    results: Path


@dataclass
class Outcome:
    """What a reproduction did: new trials, trials that are not done, figures drawn and
    up to date, failures, and by document how many of its statements have which verdict.
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
        """Whether all trials, figures and measures came to their end. Verdicts do not
        matter here: they are results.
        """
        return not self.not_done and not self.failures

    def summary(self) -> str:
        """What a reproduction did, in a few lines."""
        times = ", ".join(
            f"{what} {seconds:.1f} s" for what, seconds in self.seconds.items()
        )
        lines = [f"failed: {failure}" for failure in self.failures]
        lines.append(
            f"trials: {self.new:,} new"
            + (f", {self.not_done:,} not done" if self.not_done else "")
        )
        lines.append(f"figures: {self.drawn} drawn, {self.up_to_date} up to date")
        for document, found in self.statements.items():
            counts = [f"{count} {status}" for status, count in sorted(found.items())]
            said = ", ".join(counts) or "none was compared with the document"
            lines.append(f"statements of {document}: {said}")
        return "\n".join([*lines, f"time: {times}", f"page: {self.page}"])


def reproduce(
    publications: Sequence[Publication],
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
    *,
    quick: bool = False,
) -> Outcome:
    """Run, draw and judge the publications. Write `scorecard.html`, `.md` and `.json`
    below `results`.

        publications  all of them; those that are `selected` are run and drawn, and the
                      page shows them; the others are named in one line
        results       the folder with the stored studies
        engine        runs the trials
        display       makes the progress display of a study from its name
        quick         whether the publications were read at the quick scale

    Raises SpecError and StoreError as a launch does, and StoreError for a damaged file
    of variants. If a trial, a figure or a measure fails, that is noted and the rest
    goes on.
    """
    wanted = [publication for publication in publications if publication.selected]
    root = results / QUICK if quick else results
    outcome, times = Outcome(root / SCORECARD[0]), [time.monotonic()]
    known = read_turned(results)
    for publication in wanted:
        ran = run_studies(publication.studies.values(), results, engine, display)
        outcome.new += ran.new
        outcome.not_done += ran.not_done
    times.append(time.monotonic())
    stored = {one.name: stored_studies(one, results) for one in publications}
    folder = PageFolder(root, WATERMARK if quick else "", results)
    files = {
        one.name: [
            FigureFile(one, name, stored[one.name], *folder) for name in one.drawings
        ]
        for one in publications
    }
    for publication in wanted:
        for file in files[publication.name]:
            what = f"figure {publication.name}/{file.name}"
            if file.possible:
                _draw(file, what, outcome)
            else:
                outcome.failures.append(f"{what}: no trial of what it shows is done")
    times.append(time.monotonic())
    sections = [
        _section(
            one,
            stored[one.name],
            files[one.name],
            folder,
            known.get(one.name),
            outcome,
        )
        for one in publications
    ]
    _write(Page(root, sections, QUICK if quick else FULL, folder.watermark), results)
    times.append(time.monotonic())
    steps = zip(("trials", "figures", "page"), times, times[1:], strict=False)
    outcome.seconds = {what: until - since for what, since, until in steps}
    return outcome


def _draw(file: FigureFile | ClaimsFile, what: str, outcome: Outcome) -> None:
    if file.current():
        outcome.up_to_date += 1
        return
    try:
        file.draw()
        outcome.drawn += 1
    except Exception as error:
        outcome.failures.append(f"{what}: {type(error).__name__}: {error}")


def _section(
    publication: Publication,
    stored: Stored,
    files: Sequence[FigureFile],
    folder: PageFolder,
    tried: DocumentVariants | None,
    outcome: Outcome,
) -> Section:
    """The section of a publication. The pictures of its claims are drawn."""
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
        _draw(file, f"picture {file.name} of {publication.name}", outcome)
    section = Section(
        publication,
        rows,
        {file.name: _picture(file, file.drawing.text) for file in files},
        [_picture(file, file.text) for file in of_claims],
        {
            spec: folder.results / study.name
            for spec, study in publication.studies.items()
            if spec in stored
        },
        [study.provenance for study in stored.values()],
        tried,
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
