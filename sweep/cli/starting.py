"""The command that begins a study of one's own."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import Force, app


@app.command()
def init(
    study: Annotated[
        str | None,
        typer.Argument(
            help="A built-in study, e.g. nguyen2024/separation; without it all are"
            " listed."
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE",
            help="The new spec; by default in the current folder, of the same name.",
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Begin a study of your own with the spec of a built-in one, or list these.

    A file NAME.yaml has the study my/NAME: its results are apart from those of the
    built-in one. Tables and images that the spec names are copied too.
    """
    from sweep.cli.listing import built_in_table
    from sweep.cli.terminal import console
    from sweep.published.starting import begin
    from sweep.workers.executors import core_count

    if study is None:
        console().print(built_in_table(core_count()))
        return
    begun = begin(study, path, force=force)
    files = ", ".join(map(str, begun.written))
    print(f"{files}: study {begun.study.name}, as {study}", file=sys.stderr)
    run = "search" if begun.study.search else "launch"
    for command in ("plan", run):
        print("  " + shlex.join(["sweep", command, str(begun.path)]), file=sys.stderr)


@app.command()
def new(
    kind: Annotated[str, typer.Argument(help="model, metric, map or start.")],
    name: Annotated[str, typer.Argument(help="Its name, e.g. vortex.")],
    folder: Annotated[
        Path, typer.Option(help="The folder of the new files, which is there.")
    ] = Path(),
) -> None:
    """Begin a model, a metric, a map or a start of your own.

    It is a file NAME.py that works as it stands. A model comes with NAME.yaml, a small
    study of it, and with test_NAME.py. No file is replaced.
    """
    from sweep.published.creating import create

    written = create(kind, name, folder)
    print(", ".join(map(str, written)), file=sys.stderr)
    code, *others = written
    if others:
        for command in (("check", code), ("launch", others[0]), ("view", others[0])):
            words = ["sweep", *map(str, command)]
            print("  " + shlex.join(words), file=sys.stderr)
