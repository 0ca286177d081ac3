"""The app of the command line, shared options, and `stop`, which ends a command."""

import logging
import sys
from functools import partial
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from sweep.cli.completing import study_names
from sweep.store import Location, location

FIRST = Path(__file__).with_name("first.yaml")
"""The smallest spec."""
HELP = f"""\
Monte Carlo experiments and parameter sweeps over boid swarms.

A study is a file, here spec.yaml:

\b
{indent(FIRST.read_text(encoding="utf-8"), "    ")}
\b
sweep launch spec.yaml    runs its trials
sweep table my/first      means with intervals
sweep plot my/first       figures
sweep guide               the documentation
"""
app = typer.Typer(
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
    Path, typer.Argument(help="The spec of a study, a YAML file; or of several.")
]
StudyName = Annotated[
    str,
    typer.Argument(
        metavar="STUDY",
        help="Name of a study, e.g. nguyen2024/separation.",
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
            help=(
                "Folder that holds the stored studies,"
                " or s3://bucket/prefix of an object store."
            ),
        ),
    ]
NoCode = Annotated[
    bool,
    typer.Option("--no-code", help="Refuse a spec that names code of its own."),
]
CodeFrom = Annotated[
    Path | None,
    typer.Option(
        "--code-from",
        metavar="FOLDER",
        help=(
            "Take the files of code that a spec names from this folder and those below"
            " it, as ../models/vortex.py; else they lie beside the spec."
        ),
    ),
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust",
        help="Run the study's own code, though it was not launched by you here.",
    ),
]
LaunchFile = Annotated[
    Path | None,
    typer.Option(
        "--launch",
        metavar="SPEC",
        help=(
            "Let the page launch: when you say so, it writes what you see into this"
            " file, and runs sweep launch of it."
        ),
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Replace files that exist.")]
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
        help="No progress and no warnings on stderr: errors alone.",
    ),
]
MOST_WORKERS = 1024
"""A larger number is a typing error: no machine has so many cores."""
Workers = Annotated[
    int,
    typer.Option(
        min=0,
        max=MOST_WORKERS,
        help="Worker processes; 0 for as many as there are cores.",
    ),
]


def one_format(**formats: bool) -> None:
    """End the command if two formats are chosen, each by the option of its name."""
    if len(chosen := [f"--{name}" for name in formats if formats[name]]) > 1:
        stop(f"{' and '.join(chosen)} are two formats: choose one")


def stop(message: str, code: int = 2) -> NoReturn:
    """End the command with a message on stderr and an exit code."""
    print(message, file=sys.stderr)
    raise SystemExit(code)
