"""Reproduces everything that was published: runs missing trials, draws figures that are
out of date, judges all claims, writes the page.
"""

import sys
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from sweep.campaigns.launch import launch
from sweep.campaigns.progress import Display
from sweep.design.code import study_code
from sweep.errors import OutputError, StoreError
from sweep.published.claims import QUICK, Claim, Publication
from sweep.published.drawings import FigureFile
from sweep.published.estimates import MeasureError, measure
from sweep.published.measures import specs_of
from sweep.published.scorecard import Page, Picture, Row, Section
from sweep.published.scorecard_html import as_html
from sweep.published.scorecard_markdown import as_markdown
from sweep.published.verdicts import judge, untestable
from sweep.spec.study_folder import SCORECARD
from sweep.store.new_files import replacing
from sweep.tables.stored_study import StoredStudy
from sweep.workers.executors import ExecutorFactory

WATERMARK = "QUICK: FEW TRIALS"

Stored = Mapping[str, StoredStudy]


@dataclass
class Outcome:
    """What a reproduction did: new trials, trials that are not done, figures drawn and
    kept, failures, verdicts.
    """

    page: Path
    new: int = 0
    not_done: int = 0
    drawn: int = 0
    kept: int = 0
    failures: list[str] = field(default_factory=list)
    verdicts: Counter[str] = field(default_factory=Counter)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def whole(self) -> bool:
        """Whether all trials, figures and measures came to their end. Verdicts do not
        matter here: they are results.
        """
        return not self.not_done and not self.failures

    def summary(self) -> str:
        """What a reproduction did, in a few lines."""
        counts = ", ".join(
            f"{count} {status}" for status, count in sorted(self.verdicts.items())
        )
        times = ", ".join(
            f"{what} {seconds:.1f} s" for what, seconds in self.seconds.items()
        )
        lines = [f"failed: {failure}" for failure in self.failures]
        lines.append(
            f"trials: {self.new:,} new"
            + (f", {self.not_done:,} not done" if self.not_done else "")
        )
        lines.append(f"figures: {self.drawn} drawn, {self.kept} up to date")
        return "\n".join(
            [*lines, f"claims: {counts}", f"time: {times}", f"page: {self.page}"]
        )


def reproduce(
    publications: Sequence[Publication],
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
    *,
    quick: bool = False,
) -> Outcome:
    """Run, draw and judge the publications. Write `scorecard.html` and `.md` below
    `results`.

        publications  all of them; those that are `asked` for are run and drawn, and the
                      page shows all
        results       the folder with the stored studies
        engine        runs the trials
        display       makes the progress display of a study from its name
        quick         whether the publications were read at the quick scale

    Raises SpecError and StoreError as a launch does. If a trial, a figure or a measure
    fails, that is noted and the rest goes on.
    """
    wanted = [publication for publication in publications if publication.asked]
    root = results / QUICK if quick else results
    outcome, times = Outcome(root / SCORECARD[0]), [time.monotonic()]
    for publication in wanted:
        _run(publication, results, engine, display, outcome)
    times.append(time.monotonic())
    stored = {
        publication.name: _stored(publication, results) for publication in publications
    }
    watermark = WATERMARK if quick else ""
    files = {
        one.name: [
            FigureFile(one, name, stored[one.name], root, watermark, results)
            for name in one.drawings
        ]
        for one in publications
    }
    for publication in wanted:
        for file in files[publication.name]:
            _draw(file, outcome)
    times.append(time.monotonic())
    claims = sum(publication.tested for publication in publications)
    sections = [
        _section(one, stored[one.name], files[one.name], results, claims, outcome)
        for one in publications
    ]
    _write(Page(root, sections, claims, WATERMARK if quick else ""), results)
    times.append(time.monotonic())
    steps = zip(("trials", "figures", "page"), times, times[1:], strict=False)
    outcome.seconds = {what: until - since for what, since, until in steps}
    return outcome


def _run(
    publication: Publication,
    results: Path,
    engine: ExecutorFactory,
    display: Callable[[str], Display],
    outcome: Outcome,
) -> None:
    for study in publication.studies.values():
        with display(study.name) as bar, ExitStack() as ending:
            ending.callback(engine.stop)
            progress = launch(study, results, engine, report=bar.show)
        print(bar.summary(progress, results / study.name), file=sys.stderr)
        outcome.new += progress.statuses.total()
        statuses = StoredStudy(study.name, results).statuses()
        if not_done := statuses.total() - statuses["done"]:
            outcome.not_done += not_done
            print(
                f"{study.name}: {not_done:,} trials are not done:"
                f" sweep status {study.name}",
                file=sys.stderr,
            )


def _stored(publication: Publication, results: Path) -> dict[str, StoredStudy]:
    """The stored studies of a publication, by the names of their specs. Only those of
    the same spec and code count, with at least one trial that is done.
    """
    found = {}
    for spec, study in publication.studies.items():
        try:
            stored = StoredStudy(study.name, results)
        except StoreError:
            continue
        same = stored.spec == study.text and stored.code == study_code(study)
        if same and stored.statuses()["done"]:
            found[spec] = stored
    return found


def _draw(file: FigureFile, outcome: Outcome) -> None:
    what = f"figure {file.publication.name}/{file.name}"
    if not file.possible:
        outcome.failures.append(f"{what}: no trial of what it shows is done")
    elif file.current():
        outcome.kept += 1
    else:
        try:
            file.draw()
            outcome.drawn += 1
        except Exception as error:
            outcome.failures.append(f"{what}: {type(error).__name__}: {error}")


def _section(
    publication: Publication,
    stored: Stored,
    files: Sequence[FigureFile],
    results: Path,
    claims: int,
    outcome: Outcome,
) -> Section:
    rows = [
        _row(publication, claim, stored, claims, outcome)
        for claim in publication.claims
    ]
    outcome.verdicts.update(row.verdict.status for row in rows)
    pictures = [
        Picture(file.name, file.drawing.text, file.path if file.current() else None)
        for file in files
    ]
    folders = {
        spec: results / study.name
        for spec, study in publication.studies.items()
        if spec in stored
    }
    origins = [study.provenance for study in stored.values()]
    return Section(
        publication,
        rows,
        {picture.name: picture for picture in pictures},
        folders,
        origins,
    )


def _row(
    publication: Publication,
    claim: Claim,
    stored: Stored,
    claims: int,
    outcome: Outcome,
) -> Row:
    if claim.measure is None or claim.expect is None:
        return Row(claim, untestable(claim.untestable))
    missing = [
        spec
        for spec in specs_of(claim.measure, publication.studies)
        if spec not in stored
    ]
    if missing:
        return Row(
            claim,
            untestable(
                f"no trial of {', '.join(missing)} is done: not run yet, or all failed"
            ),
        )
    try:
        measured = measure(stored, claim.measure, publication.functions)
    except MeasureError as error:
        outcome.failures.append(f"claim {publication.name}/{claim.id}: {error}")
        return Row(claim, untestable(f"its measure failed: {error}"))
    return Row(claim, judge(measured.estimate, claim.expect, claims), measured)


def _write(page: Page, results: Path) -> None:
    texts = as_html(page), as_markdown(page)
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
