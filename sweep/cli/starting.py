"""The commands that begin a new study, or custom code."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import Force, app, stop
from sweep.cli.completing import model_names


@app.command()
def init(
    study: Annotated[
        str | None,
        typer.Argument(
            help="A built-in study, e.g. nguyen2024/separation; without it all are"
            " listed. With --model there is none.",
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE",
            help="The new spec, NAME.yaml; by default in the current folder, named as"
            " the study or the model.",
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            autocompletion=model_names,
            help="Begin with a small study of this model instead: one of `sweep"
            " models`, or a file, ./NAME.py, which is run.",
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(help="A preset of the model; by default as_run, or its first."),
    ] = None,
    force: Force = False,
) -> None:
    """Begin a study of your own, as a built-in one or with a model.

    With --model it is a small one that takes some seconds and explains its keys. A
    file NAME.yaml has the study my/NAME: its results are apart from those of the
    built-in one. Tables and images that a built-in spec names are copied too.

    \b
    sweep init                                    lists the built-in studies
    sweep init nguyen2024/separation wide.yaml    a copy of one of them
    sweep init wide.yaml --model nguyen2024       a small study of a model
    """  # noqa: D301 (click keeps the lines of a paragraph that begins with \b)
    from sweep.cli.listing import built_in_table
    from sweep.cli.terminal import console
    from sweep.published import begin, begin_with_model
    from sweep.workers import core_count

    if preset and not model:
        stop("--preset is that of a model: add --model")
    if model:
        if path or (study and not Path(study).suffix):
            stop(
                f"{study}: STUDY and --model exclude each other; with --model there is"
                f" a file alone, {path or 'NAME.yaml'}"
            )
        file = Path(study) if study else None
        begun = begin_with_model(model, file, preset or "", force=force)
    elif study:
        begun = begin(study, path, force=force)
    else:
        console().print(built_in_table(core_count()))
        return
    files = ", ".join(map(str, begun.written))
    print(f"{files}: study {begun.study.name}, as {model or study}", file=sys.stderr)
    for command in ("plan", begun.study.command):
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
    from sweep.published import create

    written = create(kind, name, folder)
    print(", ".join(map(str, written)), file=sys.stderr)
    code, *with_code = written
    if with_code:
        spec = with_code[0]
        for command in (("check", code), ("launch", spec), ("view", spec)):
            words = ["sweep", *map(str, command)]
            print("  " + shlex.join(words), file=sys.stderr)
