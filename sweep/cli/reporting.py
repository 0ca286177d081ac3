"""Commands that print a report: for a reader, or as CSV, JSON or LaTeX."""

import inspect
import logging
from collections.abc import Callable, Iterable, Sequence
from functools import cache, wraps
from inspect import Parameter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sweep.cli.app import Group, Json, Results, StudyName, app, one_format
from sweep.method import Method, may_have_others, methods

if TYPE_CHECKING:
    from rich.table import Table

    from sweep.store import Location
    from sweep.tables import Report, TextTable

log = logging.getLogger("sweep")
Csv = Annotated[bool, typer.Option("--csv", help="Print CSV.")]
Latex = Annotated[
    bool, typer.Option("--latex", help="Print a LaTeX table for the package booktabs.")
]
FORMATS = {"csv": Csv, "json": Json, "latex": Latex}

Where = Annotated[
    list[str] | None,
    typer.Option(
        metavar="CONDITION",
        help=(
            "Condition on points: parameter values such as n=50,map=empty, or an"
            " expression such as \"n >= 50 and map != 'empty'\". Repeatable; all"
            " conditions must be true."
        ),
    ),
]
Make = Callable[..., "Report"]


def _option(name: str, kind: Any, default: Any = Parameter.empty) -> Parameter:
    keyword = Parameter.POSITIONAL_OR_KEYWORD
    return Parameter(name, keyword, default=default, annotation=kind)


STUDY = _option("study", StudyName)
RESULTS = _option("results", Results, default=Path("results"))
WHERE = _option("where", Where, default=None)


def report_command(make: Make, parameters: Sequence[Parameter] = ()) -> Make:
    """Enter a command that prints the report which a function returns.

    The command also has the options of `FORMATS`. Two formats are an error before the
    function is called.

    Parameters
    ----------
    make : callable
        The function. The command has its name, and its docstring as the help: the text
        before the sections, and the commands in the section Examples.
    parameters : sequence of inspect.Parameter, optional
        Arguments and options of the command; by default those of the function.
    """
    formats = [_option(name, kind, default=False) for name, kind in FORMATS.items()]

    @wraps(make)
    def command(**arguments: Any) -> None:
        chosen = [name for name in FORMATS if arguments.pop(name)]
        one_format(**dict.fromkeys(chosen, True))
        report = make(**arguments)
        if chosen:
            print(getattr(report, f"to_{chosen[0]}")(), end="")
        else:
            print_report(report)

    shown = [*(parameters or inspect.signature(make).parameters.values()), *formats]
    # typer reads types from here, and cannot know a type that is not imported.
    vars(command)["__signature__"] = inspect.Signature(shown)
    command.__annotations__ = {option.name: option.annotation for option in shown}
    app.command(rich_help_panel=Group.analyse)(command)
    return make


def enter_reports(entries: Iterable[Method]) -> None:
    """Enter a command for each report of some methods."""
    for method in entries:
        for make in method.reports:
            _of_study(make)
        for make in method.reports_of_results:
            parameters = inspect.signature(make).parameters
            results = {RESULTS.name: RESULTS}
            report_command(make, list((parameters | results).values()))


@cache
def enter_reports_of_packages() -> None:
    """Enter the commands of methods of installed packages.

    A method that cannot be used is a warning. The function imports the methods, so the
    app is complete without the methods.
    """
    if not may_have_others():
        return
    installed = methods()
    enter_reports(installed[name] for name in installed if name in installed.origins)
    for name, why in installed.refused.items():
        log.warning("%s cannot be used: %s", name, why)


def _of_study(make: Make) -> None:
    """Enter the command of a report whose first argument is a stored study.

    The command has the name of the study, results and conditions instead.
    """

    @wraps(make)
    def of_name(
        study: str, results: "Location", where: list[str] | None, **options: Any
    ) -> "Report":
        from sweep.tables import StoredStudy

        return make(StoredStudy(study, results).where(*(where or ())), **options)

    _stored_study, *further = inspect.signature(make).parameters.values()
    report_command(of_name, [STUDY, RESULTS, *further, WHERE])


def print_report(report: "Report") -> None:
    """Print the tables and lines of a report for a reader."""
    from sweep.cli.terminal import console
    from sweep.tables import TextTable

    out = console()
    for part in report.parts:
        if isinstance(part, TextTable):
            out.print(_rich_table(part))
            if part.hidden:
                out.print(part.about_hidden)
        else:
            out.print(part, soft_wrap=True)


def _rich_table(table: "TextTable") -> "Table":
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    narrow: dict[str, Any] = {"box": SIMPLE_HEAD, "padding": (0, 1, 0, 0)}
    layout = {} if table.ruled else narrow
    caption = table.caption or None
    shown = Table(title=table.title or None, caption=caption, **layout)
    for name in table.columns:
        # A cell that is too wide takes more lines, so that no digit is lost.
        shown.add_column(
            name,
            justify="right" if name in table.right else "left",
            overflow="fold",
        )
    for number, row in enumerate(table.rows):
        if number in table.sections:
            shown.add_section()
        shown.add_row(*row)
    return shown
