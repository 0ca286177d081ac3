"""Commands whose answer is a report: printed for a reader, or as CSV, JSON or LaTeX."""

import inspect
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sweep.cli.app import Json, app, one_format

if TYPE_CHECKING:
    from rich.table import Table

    from sweep.tables.reports import Report, TextTable

Csv = Annotated[bool, typer.Option("--csv", help="Print CSV.")]
Latex = Annotated[
    bool, typer.Option("--latex", help="Print the table for LaTeX, with booktabs.")
]
FORMATS = {"csv": Csv, "json": Json, "latex": Latex}


def report_command(make: "Callable[..., Report]") -> "Callable[..., Report]":
    """Enter a command that prints the report which a function returns.

    The command has the options of the function, and those of `FORMATS`. Two formats at
    once are refused before the function is called.
    """
    signature = inspect.signature(make)
    formats = [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=False, annotation=option
        )
        for name, option in FORMATS.items()
    ]

    @wraps(make)
    def command(**options: Any) -> None:
        asked = {name: options.pop(name) for name in FORMATS}
        one_format(**asked)
        report = make(**options)
        chosen = [name for name, is_asked in asked.items() if is_asked]
        if chosen:
            print(getattr(report, f"to_{chosen[0]}")(), end="")
        else:
            print_report(report)

    parameters = [*signature.parameters.values(), *formats]
    vars(command)["__signature__"] = signature.replace(parameters=parameters)
    command.__annotations__ = make.__annotations__ | FORMATS | {"return": None}
    app.command()(command)
    return make


def print_report(report: "Report") -> None:
    """Print the tables and lines of a report for a reader."""
    from sweep.cli.terminal import console
    from sweep.tables.reports import TextTable

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
        shown.add_column(name, justify="right" if name in table.right else "left")
    for number, row in enumerate(table.rows):
        if number in table.sections:
            shown.add_section()
        shown.add_row(*row)
    return shown
