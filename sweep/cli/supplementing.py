"""The options of `sweep show --to`, and the written file."""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from sweep.cli.progress_line import ProgressLine

if TYPE_CHECKING:
    from sweep.explorer import PaperTexts, SupplementChoice
    from sweep.spec import Study
    from sweep.tables import StoredStudy
    from sweep.workers import ExecutorFactory

FRAMES = 601
PANEL = "With --to"
"""The heading of the options in the help."""


class TrialRole(StrEnum):
    """A trial of a point that plays, by rank or merit."""

    lowest = "lowest"
    median = "median"
    highest = "highest"
    worst = "worst"
    best = "best"
    all = "all"


To = Annotated[
    Path | None,
    typer.Option(
        "--to",
        metavar="FILE.html",
        help="File for an interactive figure of the study, which opens from disk"
        " without a server.",
    ),
]
FigureMetric = Annotated[
    str,
    typer.Option(
        help="Metric of the figure, by default the first metric; for two sides, metric"
        " to compare, by default all shared metrics.",
        rich_help_panel=PANEL,
    ),
]
AcrossSetting = Annotated[
    str,
    typer.Option(
        help="Parameter on the axis; by default the parameter with the most values.",
        rich_help_panel=PANEL,
    ),
]
BySetting = Annotated[
    str,
    typer.Option(
        help="Parameter that is a colour; by default chosen by the figure.",
        rich_help_panel=PANEL,
    ),
]
ShownTrials = Annotated[
    list[TrialRole] | None,
    typer.Option(
        "--trials",
        help="Trial of each point that plays, by rank in the metric; by default the"
        " median; or all. Repeatable.",
        rich_help_panel=PANEL,
    ),
]
Frames = Annotated[
    int,
    typer.Option(
        min=2,
        max=100_000,
        help="Maximum number of frames per trial; fewer if the file becomes too large.",
        rich_help_panel=PANEL,
    ),
]
Compute = Annotated[
    bool,
    typer.Option(
        "--compute",
        help="The page computes the trials in the browser of the reader and compares"
        " them with the stored results, instead of having frames (extra wasm).",
        rich_help_panel=PANEL,
    ),
]
CitationFile = Annotated[
    Path | None,
    typer.Option(
        "--about",
        metavar="CITATION.cff",
        help="File with title, authors, DOI, licence and abstract.",
        rich_help_panel=PANEL,
    ),
]
Title = Annotated[str, typer.Option(help="Title of the page.", rich_help_panel=PANEL)]
Authors = Annotated[
    list[str] | None,
    typer.Option(
        "--author", help="Author of the data. Repeatable.", rich_help_panel=PANEL
    ),
]
Doi = Annotated[
    str, typer.Option(help="DOI of the related publication.", rich_help_panel=PANEL)
]
Licence = Annotated[
    str, typer.Option(help="Licence of the data.", rich_help_panel=PANEL)
]
Caption = Annotated[
    str, typer.Option(help="Caption of the figure.", rich_help_panel=PANEL)
]


def write_supplement(
    study: "StoredStudy",
    to: Path,
    choice: "SupplementChoice",
    texts: "PaperTexts",
    workers: int,
) -> None:
    """Write a supplement. Progress is shown on stderr.

    Raises the errors of `planned` and `Supplement.content`, and OutputError if the file
    cannot be written.

    Parameters
    ----------
    study : StoredStudy
        The stored study.
    to : Path
        The new file.
    choice : SupplementChoice
        The metric, points and trials of the figure.
    texts : PaperTexts
        Title, authors and other texts.
    workers : int
        The number of worker processes; 0 for one per core.
    """
    from sweep.explorer import planned
    from sweep.tables import unfinished
    from sweep.workers import Loky, core_count

    plan = planned(study, choice, texts)
    engine = Loky(workers or core_count())
    try:
        content = plan.content(engine, ProgressLine(str(to), "runs").show)
    finally:
        engine.stop()
    with unfinished(to) as file:
        file.write(content)


def computed_page(
    study: "Study",
    title: str,
    engine: "ExecutorFactory",
    report: Callable[[int, int], None],
) -> bytes:
    """Return a page that computes the trials of a study in the browser of the reader.

    The trials run here too, so that the page can compare. No result is stored.

    Parameters
    ----------
    study : Study
        The trials. The page has all.
    title : str
    engine : ExecutorFactory
        Runs the trials.
    report : callable
        Callback with the numbers of finished and of all trials of the page.

    Raises
    ------
    ChoiceError
        If a page cannot compute the trials.
    """
    from sweep.campaigns import launch
    from sweep.design import Jobs, expand
    from sweep.explorer import (
        PaperTexts,
        SupplementChoice,
        computed_metrics,
        planned,
    )
    from sweep.tables import StoredStudy

    metrics = computed_metrics(Jobs(study, expand(study))[0])
    choice = SupplementChoice(
        metric=metrics[0] if metrics else "", trials=("all",), compute=True
    )
    with TemporaryDirectory(prefix="boidsweep-page-") as results:
        launch(study, Path(results), engine)
        stored = StoredStudy(study.name, Path(results))
        return planned(stored, choice, PaperTexts(title=title)).content(engine, report)


def check_file(to: Path, *, force: bool) -> None:
    """Raise OutputError if the file cannot be written to the path."""
    from sweep.tables import check_output

    check_output(to, [".html"], force=force)
