"""Commands that report and plot stored results."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperArgument, TyperCommand

from sweep.cli.app import Json, Quiet, Results, StudyName, app
from sweep.cli.reporting import Where, enter_reports, report_command
from sweep.method import own_methods
from sweep.methods import Metrics, Over, OverOption

if TYPE_CHECKING:
    from sweep.tables import Report


class IntervalKind(StrEnum):
    """The kind of confidence interval of a mean in a table."""

    t = "t"
    bootstrap = "bootstrap"
    bootstrap_t = "bootstrap_t"


@app.command()
def status(
    study: StudyName,
    results: Results = Path("results"),
    as_json: Json = False,
    quiet: Quiet = False,  # noqa: ARG001
) -> None:
    """How much of a study is stored, and what went wrong."""
    from sweep.cli.listing import status_json, status_text
    from sweep.tables import StoredStudy

    stored = StoredStudy(study, results)
    print(status_json(stored) if as_json else status_text(stored))


@report_command
def table(
    study: StudyName,
    results: Results = Path("results"),
    metric: Metrics = None,
    over: OverOption = Over.last,
    interval: Annotated[
        IntervalKind | None,
        typer.Option(
            help=(
                "Student's; or a bootstrap: BCa, or bootstrap-t for few and skewed"
                " values. By default that of the distribution of each metric."
            )
        ),
    ] = None,
    where: Where = None,
    by: Annotated[
        str | None,
        typer.Option(
            metavar="SETTING[,SETTING]",
            help=(
                "One row for all points that agree in these settings. Each point weighs"
                " the same: a value is the mean over the points in one replicate, and"
                " only replicates count of which all points have a value."
            ),
        ),
    ] = None,
    sort: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN[:desc]",
            help="A setting or metric to sort by, the least first. Repeatable.",
        ),
    ] = None,
) -> "Report":
    """Means of the metrics with 95 % intervals over the replicates of each point."""
    from sweep.tables import (
        Refusals,
        StoredStudy,
        keep_apart,
        means_report,
        point_means,
    )

    stored = keep_apart(StoredStudy(study, results))
    refusals = Refusals()
    chosen = stored
    with refusals.noted():
        chosen = stored.where(*(where or ()))
    with refusals.noted():
        means = point_means(
            chosen,
            metric or [],
            by=by.split(",") if by is not None else None,
            sort=sort or [],
            half=over == Over.half,
            interval=interval.value if interval else None,
        )
    refusals.check()
    return means_report(chosen, means)


enter_reports(own_methods().values())


class Format(StrEnum):
    """The format of the file of a figure."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


class PlotCommand(TyperCommand):
    """A command whose help names all kinds of figures.

    The kinds are imported only for the help: matplotlib takes a second to load.
    """

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help, with the kinds of figures.

        Parameters
        ----------
        ctx : click.Context
            The context of the command.
        formatter : click.HelpFormatter
            The formatter that gets the help.
        """
        from sweep.figures import KINDS

        names = [name for name, kind in KINDS.items() if not kind.of_search]
        of_search = [name for name, kind in KINDS.items() if kind.of_search]
        for parameter in self.params:
            if isinstance(parameter, TyperArgument) and parameter.name == "names":
                parameter.help = (
                    "More studies, for one figure of all; and kinds of figures:"
                    f" {', '.join(names)}; of a search {', '.join(of_search)};"
                    " or a file with one, ./NAME.py; else all that suit. A study that"
                    " has the name of a kind is written with a slash, as curves/."
                )
        super().format_help(ctx, formatter)


@app.command(cls=PlotCommand)
def plot(
    study: StudyName,
    names: Annotated[
        list[str] | None, typer.Argument(metavar="[STUDY | KIND]...")
    ] = None,
    results: Results = Path("results"),
    metric: Annotated[
        list[str] | None,
        typer.Option(
            help=(
                "A metric to show; coverage+ is to be high,"
                " coverage_cv- low. Repeatable."
            )
        ),
    ] = None,
    by: Annotated[
        str | None, typer.Option(help="The setting whose values are lines or colours.")
    ] = None,
    x: Annotated[str | None, typer.Option(help="The setting along x.")] = None,
    y: Annotated[str | None, typer.Option(help="The setting along y.")] = None,
    where: Where = None,
    over: OverOption = Over.last,
    formats: Annotated[
        list[Format] | None,
        typer.Option("--format", help="Repeatable; png by default."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help=(
                "Folder of the files; by default results/STUDY/figures, of an object"
                " store figures/STUDY here; of several studies a folder in that of the"
                " first one."
            )
        ),
    ] = None,
) -> None:
    """Draw figures of a study, with intervals and units, and print where they are.

    Several studies are drawn into one figure, told apart as settings are.
    """
    from sweep.figures import (
        Choices,
        check_shared,
        draw_figures,
        plan_figures,
        plot_arguments,
        with_files,
    )
    from sweep.spec import FIGURES
    from sweep.tables import stored_parts

    arguments = plot_arguments([study, *(names or ())], results, where or ())
    stored = arguments.study
    choices = Choices(tuple(metric or ()), by, x, y, half=over == Over.half)
    check_shared(stored, choices.metrics)
    kinds, known = with_files(arguments.kinds)
    figures = plan_figures(stored, kinds, choices, known)
    unshared = [f"{name} {why}" for name, why in stored.left_out.items()]
    for reason in [*unshared, *figures.left_out]:
        print(f"not drawn: {reason}", file=sys.stderr)
    below = out or (results if isinstance(results, Path) else Path())
    first, *further = [part.name for part in stored_parts(stored)]
    home = (
        below / first / FIGURES
        if isinstance(results, Path)
        else below / FIGURES / first
    )
    if further:
        home /= f"with-{'-'.join(further).replace('/', '-')}"
    endings = [kind.value for kind in formats or [Format.png]]
    for path in draw_figures(stored, figures, out or home, endings, below=below):
        print(path, flush=True)
