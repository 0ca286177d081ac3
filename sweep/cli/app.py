"""The app of the command line, shared options, and `stop`, which ends a command."""

import inspect
import logging
import re
import sys
from collections.abc import Callable
from enum import StrEnum
from functools import partial
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup

from sweep.cli.completing import study_names
from sweep.store import Location, location
from sweep.text import description_of

FIRST = Path(__file__).with_name("first.yaml")
"""The smallest spec."""
HELP = f"""\
Monte Carlo experiments and parameter sweeps over boid swarms.

A YAML file describes a study, for example spec.yaml:

\b
{indent(FIRST.read_text(encoding="utf-8"), "    ")}
\b
sweep plan spec.yaml      trials and estimated time
sweep launch spec.yaml    run trials
sweep table my/first      means, confidence intervals
sweep plot my/first       figures
sweep guide               user guide
"""
EXAMPLES = re.compile(r"^Examples\n-+\n((?:.+\n?)+)", re.MULTILINE)
"""The section of a docstring with commands, one per line."""
Function = TypeVar("Function", bound=Callable[..., Any])


class Group(StrEnum):
    """The groups of commands, in the order of the help."""

    start = "Start"
    run = "Run"
    analyse = "Analyse"
    explore = "Explore"
    store = "Store and share"
    develop = "Develop"


class Command(TyperCommand):
    """A command with a help that ends with the examples of the docstring."""

    @property
    def examples(self) -> list[str]:
        """The commands in the section Examples of the docstring."""
        section = EXAMPLES.search(inspect.getdoc(self.callback) or "")
        lines = section[1].splitlines() if section else []
        return [line for line in lines if line.startswith("sweep ")]

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help, and then each example on a separate line.

        Parameters
        ----------
        ctx : click.Context
            The context of the command.
        formatter : click.HelpFormatter
            The formatter that gets the help. With rich, the help is printed at once,
            and the content of the formatter follows without new line breaks.
        """
        super().format_help(ctx, formatter)
        if self.examples:
            lines = "".join(f"   {line}\n" for line in self.examples)
            formatter.write(f"\n Examples:\n{lines}")


class Commands(TyperGroup):
    """All commands, in the order of the groups."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the commands.

        Parameters
        ----------
        ctx : click.Context
            The context of the app.
        """
        order = list(Group)
        places = {
            name: order.index(Group(command.rich_help_panel or ""))
            for name, command in self.commands.items()
            if isinstance(command, Command)
        }
        return sorted(super().list_commands(ctx), key=places.__getitem__)


class App(typer.Typer):
    """An app with commands whose help is from docstrings."""

    def command(
        self, name: str | None = None, **options: Any
    ) -> Callable[[Function], Function]:
        """Enter a command.

        The docstring is the help, up to the first section. The lines of the section
        Examples are commands, which end the help.

        Parameters
        ----------
        name : str, optional
            The name of the command; by default the name of the function.
        **options
            Options of `typer.Typer.command`, with `rich_help_panel`, a `Group`.
        """
        command_of_typer = super().command

        def enter(function: Function) -> Function:
            described: dict[str, Any] = {
                "cls": Command,
                "help": description_of(function),
                **options,
            }
            return command_of_typer(name, **described)(function)

        return enter


app = App(
    cls=Commands,
    help=HELP,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


def _version(requested: bool) -> None:
    if requested:
        print(f"boidsweep {sys.modules['sweep'].__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            help="Show the version and exit.",
            callback=_version,
            is_eager=True,
        ),
    ] = False,
) -> None:
    pass


Spec = Annotated[
    Path, typer.Argument(help="Spec: a YAML file of one study or of several studies.")
]
StudyName = Annotated[
    str,
    typer.Argument(
        metavar="STUDY",
        help="Name of a stored study, such as nguyen2024/separation.",
        autocompletion=study_names,
    ),
]
if TYPE_CHECKING:
    Results = Location
else:  # typer knows no union of types
    Results = Annotated[
        Path,
        typer.Option(
            parser=location,
            metavar="FOLDER|S3",
            help="Folder of stored studies, or s3://bucket/prefix of an object store.",
        ),
    ]
NoCode = Annotated[
    bool,
    typer.Option("--no-code", help="Reject a spec that names custom code."),
]
CodeFrom = Annotated[
    Path | None,
    typer.Option(
        "--code-from",
        metavar="FOLDER",
        help=(
            "Folder that contains the custom code of a spec, also in subfolders; by"
            " default the folder of the spec."
        ),
    ),
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        help="Run custom code of a study that you did not launch here.",
    ),
]
LaunchFile = Annotated[
    Path | None,
    typer.Option(
        "--launch",
        metavar="SPEC",
        help="Spec that the page may write and launch after a click.",
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace existing files.")]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]


def _hush(context: typer.Context, requested: bool) -> bool:
    """Let this command log only errors."""
    if requested:
        log = logging.getLogger("sweep")
        context.call_on_close(partial(log.setLevel, log.level))
        log.setLevel(logging.ERROR)
    return requested


Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet",
        callback=_hush,
        help="Print only errors on stderr, no progress and no warnings.",
    ),
]
MOST_WORKERS = 1024
"""A larger number is a typing error: no machine has so many cores."""
Workers = Annotated[
    int,
    typer.Option(
        min=0,
        max=MOST_WORKERS,
        help="Number of worker processes; 0 = one per core.",
    ),
]


def one_format(**formats: bool) -> None:
    """End the command if two formats are chosen, each by the option of that name."""
    if len(chosen := [f"--{name}" for name in formats if formats[name]]) > 1:
        stop(f"{' and '.join(chosen)} are two formats: choose one")


def stop(message: str, code: int = 2) -> NoReturn:
    """End the command with a message on stderr and an exit code."""
    print(message, file=sys.stderr)
    raise SystemExit(code)
