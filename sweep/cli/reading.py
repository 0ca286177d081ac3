"""Commands that read what is stored."""

import sys
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperArgument, TyperCommand

from sweep.cli.app import Json, Quiet, Results, StudyName, app
from sweep.cli.reporting import report_command

if TYPE_CHECKING:
    from sweep.store.locations import Location
    from sweep.tables.reports import Report
    from sweep.tables.stored_study import StoredStudy


class Over(StrEnum):
    """Which value of a metric a table shows."""

    last = "last"
    half = "half"


class IntervalKind(StrEnum):
    """Which interval of a mean a table shows."""

    t = "t"
    bootstrap = "bootstrap"
    bootstrap_t = "bootstrap_t"


class Together(StrEnum):
    """How the rows of a comparison are judged together."""

    holm = "holm"
    bonferroni = "bonferroni"
    max_t = "max_t"


Where = Annotated[
    list[str] | None,
    typer.Option(
        metavar="CONDITION",
        help=(
            "Only these points: settings, as n=50,map=empty, or a condition, as"
            " \"n >= 50 and map != 'empty'\". Repeatable, and all hold."
        ),
    ),
]

Margin = Annotated[
    float | None,
    typer.Option(
        help="Test whether B - A lies within +-margin, in the unit of the metric."
    ),
]
Confidence = Annotated[
    float, typer.Option(help="With which all intervals hold together.")
]
Correction = Annotated[
    Together, typer.Option(help="Correction for many rows; max_t resamples pairs.")
]


def _chosen(study: str, results: "Location", where: list[str] | None) -> "StoredStudy":
    """Return what is stored of a study, at the points that a command is asked for."""
    from sweep.tables.stored_study import StoredStudy

    return StoredStudy(study, results).where(*(where or ()))


@app.command()
def status(
    study: StudyName,
    results: Results = Path("results"),
    as_json: Json = False,
    quiet: Quiet = False,  # noqa: ARG001
) -> None:
    """How much of a study is stored, and what went wrong."""
    from sweep.cli.listing import status_json, status_text
    from sweep.tables.stored_study import StoredStudy

    stored = StoredStudy(study, results)
    print(status_json(stored) if as_json else status_text(stored))


@report_command
def table(
    study: StudyName,
    results: Results = Path("results"),
    metric: Annotated[
        list[str] | None, typer.Option(help="A metric to show; may be repeated.")
    ] = None,
    over: Annotated[
        Over, typer.Option(help="The last frame, or the mean over the last half.")
    ] = Over.last,
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
    from sweep.tables.choosing import Refusals
    from sweep.tables.means_text import means_report
    from sweep.tables.point_means import point_means
    from sweep.tables.search_phases import by_phase
    from sweep.tables.stored_study import StoredStudy

    stored, refusals = by_phase(StoredStudy(study, results)), Refusals()
    chosen = stored
    with refusals.noted():
        chosen = stored.where(*(where or ()))
    with refusals.noted():
        found = point_means(
            chosen,
            metric or [],
            by=by.split(",") if by is not None else None,
            sort=sort or [],
            half=over is Over.half,
            interval=interval.value if interval else None,
        )
    refusals.check()
    return means_report(chosen, found)


@report_command
def power(
    a: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="The pilot: STUDY, STUDY:setting=value[,...], or STUDY:PRESET.",
        ),
    ],
    b: Annotated[
        str | None,
        typer.Argument(
            metavar="B",
            help=(
                "What A is to differ from, written alike. Without it the first point of"
                " A is compared with each of the others."
            ),
        ),
    ] = None,
    results: Results = Path("results"),
    half_width: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=SIZE",
            help=(
                "Half the width that the 95 % interval may have: speed=0.05 in the unit"
                " of the metric, speed=5% as a share of the mean. Repeatable."
            ),
        ),
    ] = None,
    difference: Annotated[
        list[str] | None,
        typer.Option(
            metavar="METRIC=SIZE",
            help=(
                "A true difference that sweep compare is to notice, written alike; a"
                " share is that of the mean of A. Repeatable."
            ),
        ),
    ] = None,
    chance: Annotated[
        float, typer.Option(help="With which that is to happen, from 0.5 to 0.99.")
    ] = 0.8,
    over: Annotated[
        Over, typer.Option(help="The last frame, or the mean over the last half.")
    ] = Over.last,
) -> "Report":
    """How many replicates a half width, or a difference, needs, by the stored trials as
    a pilot.
    """
    from sweep.methods.comparison import read_side
    from sweep.methods.power import needed_replicates, power_report

    found = needed_replicates(
        read_side(a, results),
        None if b is None else read_side(b, results),
        half_widths=half_width or [],
        differences=difference or [],
        half=over is Over.half,
        chance=chance,
    )
    return power_report(found)


@report_command
def boundary(
    study: StudyName,
    results: Results = Path("results"),
    where: Where = None,
) -> "Report":
    """Where the mean of a metric crosses a level, of a study whose spec has `refine`.

    With one refined axis each crossing is a row, between the nearest points that surely
    lie on either side. With several, each cell is one that the boundary goes through,
    or that is not resolved.
    """
    from sweep.methods.refinement import boundary_report, find_boundary

    stored = _chosen(study, results, where)
    found = find_boundary(stored)
    return boundary_report(stored, found)


@report_command
def scaling(
    study: StudyName,
    results: Results = Path("results"),
    where: Where = None,
    metric: Annotated[
        str | None,
        typer.Option(
            "--metric", help="Order parameter: a recorded series; by default the first."
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option(
            "--by",
            help="Setting against which it is seen; by default the only one left.",
        ),
    ] = None,
    burn_in: Annotated[
        int | None,
        typer.Option(
            "--burn-in",
            help="Steps that do not count; by default the first half of each trial.",
        ),
    ] = None,
) -> "Report":
    """What flocks of several sizes tell of a transition between disorder and order.

    Of each size the mean order, its susceptibility and Binder's cumulant; where
    cumulants cross and the susceptibility peaks; the exponents with which the curves
    collapse; whether the transition jumps; and whether the series are stationary. A
    spec has such sizes with `sizes`, and records the order parameter as a series.
    """
    from sweep.methods.scaling import finite_size_scaling, scaling_report

    stored = _chosen(study, results, where)
    found = finite_size_scaling(stored, metric, by, burn_in)
    return scaling_report(stored, found)


@report_command
def hysteresis(
    study: StudyName,
    results: Results = Path("results"),
    metric: Annotated[
        list[str] | None, typer.Option(help="A metric to show; may be repeated.")
    ] = None,
    over: Annotated[
        Over, typer.Option(help="The last frame, or the mean over the last half.")
    ] = Over.last,
    where: Where = None,
) -> "Report":
    """The loops between way up and way down, of a study with `continue: both`.

    Of each loop its area, and between which values of the continued axis both ways
    differ. Chains are independent, and links of one are not: intervals are over chains.
    """
    from sweep.methods.hysteresis import find_loops, hysteresis_report

    stored = _chosen(study, results, where)
    found = find_loops(stored, metric or (), half=over is Over.half)
    return hysteresis_report(stored, found)


@report_command
def resilience(
    study: StudyName,
    results: Results = Path("results"),
    metric: Annotated[
        list[str] | None,
        typer.Option(help="A recorded series to show; may be repeated."),
    ] = None,
    within: Annotated[
        float,
        typer.Option(help="The part of the level at which a metric has come back."),
    ] = 0.1,
    where: Where = None,
) -> "Report":
    """What failures of boids do to recorded series: the part that is kept, how many
    trials come back to the level, and when.

    A trial with `failing_share` above 0 is compared with the one of the same seed and
    replicate in which nobody fails: sweep: {failing_share: [0, 0.2]}.
    """
    from sweep.methods.resilience import resilience_report, resilience_rows

    stored = _chosen(study, results, where)
    rows = resilience_rows(stored, metric or (), within=within)
    return resilience_report(stored, rows, within)


class Format(StrEnum):
    """What kind of file a figure becomes."""

    png = "png"
    svg = "svg"
    pdf = "pdf"


class PlotCommand(TyperCommand):
    """A command whose help names the kinds of figures that there are.

    They are looked up when help is asked for: matplotlib takes a second to load.
    """

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help, with the kinds."""
        from sweep.figures.kinds import KINDS

        names = [name for name, kind in KINDS.items() if not kind.of_search]
        of_search = [name for name, kind in KINDS.items() if kind.of_search]
        for one in self.params:
            if isinstance(one, TyperArgument) and one.name == "names":
                one.help = (
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
    over: Annotated[
        Over, typer.Option(help="The last frame, or the mean over the last half.")
    ] = Over.last,
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
    from sweep.figures.asked import as_asked, check_shared
    from sweep.figures.kinds import draw_figures, plan_figures
    from sweep.figures.own_kinds import with_files
    from sweep.figures.planning import Choices
    from sweep.spec.study_folder import FIGURES

    asked = as_asked([study, *(names or ())], results, where or ())
    stored = asked.study
    choices = Choices(tuple(metric or ()), by, x, y, over is Over.half)
    check_shared(stored, choices.metrics)
    kinds, known = with_files(asked.kinds)
    figures = plan_figures(stored, kinds, choices, known)
    unshared = [f"{name} {why}" for name, why in stored.left_out.items()]
    for reason in [*unshared, *figures.left_out]:
        print(f"not drawn: {reason}", file=sys.stderr)
    below = out or (results if isinstance(results, Path) else Path())
    first, *others = [one.name for one in stored.parts]
    home = (
        below / first / FIGURES
        if isinstance(results, Path)
        else below / FIGURES / first
    )
    if others:
        home /= f"with-{'-'.join(others).replace('/', '-')}"
    kinds_of_file = [one.value for one in formats or [Format.png]]
    for path in draw_figures(stored, figures, out or home, kinds_of_file, below):
        print(path, flush=True)


@report_command
def compare(
    a: Annotated[
        str,
        typer.Argument(
            metavar="A",
            help="STUDY, STUDY:setting=value[,setting=value], or STUDY:PRESET.",
        ),
    ],
    b: Annotated[
        str,
        typer.Argument(metavar="B", help="What is compared with it, written alike."),
    ],
    results: Results = Path("results"),
    metric: Annotated[
        list[str] | None, typer.Option(help="A metric to compare; may be repeated.")
    ] = None,
    over: Annotated[
        Over, typer.Option(help="The last frame, or the mean over the last half.")
    ] = Over.last,
    margin: Margin = None,
    confidence: Confidence = 0.95,
    together: Correction = Together.holm,
) -> "Report":
    """What B has more or less than A, point by point: differences with intervals, p and
    a verdict.

    Points that agree in all that varies are compared, their trials in pairs where they
    share random numbers.
    """
    from sweep.methods.comparison import (
        Method,
        compare_sides,
        comparison_report,
        read_side,
    )

    method = Method(confidence, together.value, margin)
    one, other = (read_side(text, results) for text in (a, b))
    found = compare_sides(
        one, other, metric or (), half=over is Over.half, method=method
    )
    return comparison_report(found)


@report_command
def validity(
    study: StudyName,
    results: Results = Path("results"),
    metric: Annotated[
        list[str] | None, typer.Option(help="A metric to look at; may be repeated.")
    ] = None,
    over: Annotated[
        Over, typer.Option(help="The last frame, or the mean over the last half.")
    ] = Over.last,
    where: Where = None,
    confidence: Confidence = 0.95,
) -> "Report":
    """Whether the conclusions of a study whose spec has `validate` hold with other time
    steps, another search for neighbours and another order of updates.

    The conclusions are the signs of the differences of each point to the first one
    along an axis. Each survives, turns, or is not decided.
    """
    from sweep.methods.robustness import check_conclusions, validity_report

    stored = _chosen(study, results, where)
    half = over is Over.half
    found = check_conclusions(stored, metric or (), half=half, confidence=confidence)
    return validity_report(found)
