"""Commands that report and plot stored results."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperArgument

from sweep.cli.app import Command, Group, Json, Quiet, Results, StudyName, app
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


@app.command(rich_help_panel=Group.store)
def status(
    study: StudyName,
    results: Results = Path("results"),
    as_json: Json = False,
    quiet: Quiet = False,  # noqa: ARG001
) -> None:
    """Show progress and failures of a study.

    Examples
    --------
    sweep status my/first
    sweep status my/first --json
    """
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
                "Kind of confidence interval: Student's t, BCa bootstrap or bootstrap-t"
                " for few skewed values; by default the kind for the distribution of"
                " each metric."
            )
        ),
    ] = None,
    where: Where = None,
    by: Annotated[
        str | None,
        typer.Option(
            metavar="PARAMETER[,PARAMETER]",
            help=(
                "Parameters to group by: one row per combination of their values,"
                " averaged with equal weight over all other parameters. Only replicates"
                " with a value at every point count."
            ),
        ),
    ] = None,
    sort: Annotated[
        list[str] | None,
        typer.Option(
            metavar="COLUMN[:desc]",
            help="Parameter or metric to sort by, in ascending order; in descending"
            " order with :desc. Repeatable.",
        ),
    ] = None,
) -> "Report":
    """Print means of metrics with confidence intervals.

    One row per point, that is, per combination of parameter values. The 95 % confidence
    intervals are over the replicates of the point.

    Examples
    --------
    sweep table my/first --metric speed
    sweep table my/first --where "separation_weight >= 1" --csv
    """
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


class PlotCommand(Command):
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
                    "Further studies for a figure of several studies, and kinds of"
                    f" figures: {', '.join(names)}; of a search {', '.join(of_search)};"
                    " or a file with a kind, ./NAME.py. By default all kinds that"
                    " apply. A condition may follow a study, such as my/flock:noise=1."
                    " A study with the name of a kind needs a slash, for example"
                    " curves/."
                )
        super().format_help(ctx, formatter)


@app.command(cls=PlotCommand, rich_help_panel=Group.analyse)
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
                "Metric to plot; + or - at the end marks high or low values as better,"
                " such as coverage+ and coverage_cv-. Repeatable."
            )
        ),
    ] = None,
    by: Annotated[
        str | None, typer.Option(help="Parameter of the lines or colours.")
    ] = None,
    x: Annotated[str | None, typer.Option(help="Parameter on the x axis.")] = None,
    y: Annotated[str | None, typer.Option(help="Parameter on the y axis.")] = None,
    where: Where = None,
    over: OverOption = Over.last,
    trials: Annotated[
        bool,
        typer.Option("--trials", help="Draw each trial as a small dot behind means."),
    ] = False,
    formats: Annotated[
        list[Format] | None,
        typer.Option("--format", help="File format; by default png. Repeatable."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help=(
                "Folder for the files; by default results/STUDY/figures. For an object"
                " store: figures/STUDY in the current folder. For several studies: a"
                " subfolder of the folder of the first study."
            )
        ),
    ] = None,
    width: Annotated[
        float | None,
        typer.Option(
            min=40.0,
            max=400.0,
            metavar="MM",
            help=(
                "Width in mm for a journal, such as 89 or 183: text of 5 to 7 points,"
                " 300 dots per inch."
            ),
        ),
    ] = None,
    font: Annotated[
        str,
        typer.Option(help="With --width: an installed font, such as Arial."),
    ] = "",
    why: Annotated[
        bool,
        typer.Option("--why", help="Print why further kinds do not suit the study."),
    ] = False,
) -> None:
    """Plot figures of a study with confidence intervals.

    Prints the path of each file. With several studies, each figure has the data of all
    studies, and distinguishes studies in the same way as parameter values.

    Examples
    --------
    sweep plot my/first
    sweep plot my/first curves --metric speed --format pdf --width 89
    """
    from sweep.errors import ChoiceError
    from sweep.figures import (
        Choices,
        PrintSize,
        check_shared,
        draw_figures,
        plan_figures,
        plot_arguments,
        with_files,
    )
    from sweep.spec import FIGURES
    from sweep.tables import stored_parts

    if font and not width:
        raise ChoiceError("--font is for a figure with --width")
    size = PrintSize(width, font) if width else None
    if size:
        size.check()
    arguments = plot_arguments([study, *(names or ())], results, where or ())
    stored = arguments.study
    choices = Choices(
        tuple(metric or ()), by, x, y, half=over == Over.half, trials=trials
    )
    check_shared(stored, choices.metrics)
    kinds, available = with_files(arguments.kinds)
    figures = plan_figures(stored, kinds, choices, available)
    unshared = [f"{name} {why}" for name, why in stored.left_out.items()]
    for reason in [*unshared, *(figures.reasons() if why else [])]:
        print(f"not drawn: {reason}", file=sys.stderr)
    if figures.left_out and not why:
        kinds_left = f"{len(figures.left_out)} kinds that do not suit the study"
        print(f"not drawn: {kinds_left}; --why prints why", file=sys.stderr)
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
    written = draw_figures(
        stored, figures, out or home, endings, below=below, size=size
    )
    for path in written:
        print(path, flush=True)
