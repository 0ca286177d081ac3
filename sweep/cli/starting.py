"""The commands that begin a new study, or custom code."""

import shlex
import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import Force, Group, app, stop
from sweep.cli.completing import model_names


@app.command(rich_help_panel=Group.start)
def init(
    study: Annotated[
        str | None,
        typer.Argument(
            help="Built-in study, such as nguyen2024/separation; by default a list of"
            " all built-in studies. With --model or --recording: the file of the new"
            " spec.",
        ),
    ] = None,
    path: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE",
            help="File of the new spec, NAME.yaml; by default a file in the current"
            " folder with the name of the study or model.",
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            autocompletion=model_names,
            help="Model of a new small study: one of `sweep models`, or a file"
            " ./NAME.py, which runs.",
        ),
    ] = None,
    preset: Annotated[
        str | None,
        typer.Option(
            help="Preset of the model; by default as_run, or the first preset."
        ),
    ] = None,
    recording: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="File of tracked individuals, such as tracks.csv: the first rows give"
            " columns and time step.",
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Create a spec from a built-in study, model or recording.

    With --model, the spec is a small study that takes some seconds, and comments
    explain the keys. The study in a file NAME.yaml is my/NAME, so the results are
    separate from the results of the built-in study. Tables and images of a built-in
    spec are copied too.

    Examples
    --------
    sweep init nguyen2024/separation wide.yaml
    sweep init wide.yaml --model nguyen2024
    sweep init sheep.yaml --recording tracks.csv
    """
    from sweep.cli.listing import built_in_table
    from sweep.cli.terminal import console
    from sweep.published import begin, begin_with_model, begin_with_recording
    from sweep.workers import core_count

    if preset and not model:
        stop("--preset: needs --model")
    if model and recording:
        stop("--model and --recording exclude each other")
    if model or recording:
        option = "--model" if model else "--recording"
        if path or (study and not Path(study).suffix):
            stop(
                f"{study}: STUDY and {option} exclude each other; with {option}, give"
                f" only a file, {path or 'NAME.yaml'}"
            )
        file = Path(study) if study else None
    if model:
        begun = begin_with_model(model, file, preset or "", force=force)
    elif recording:
        begun = begin_with_recording(recording, file, force=force)
    elif study:
        begun = begin(study, path, force=force)
    else:
        console().print(built_in_table(core_count()))
        return
    files = ", ".join(map(str, begun.written))
    source = model or recording or study
    print(f"{files}: study {begun.name}, from {source}", file=sys.stderr)
    for command in ("plan", begun.command):
        print("  " + shlex.join(["sweep", command, str(begun.path)]), file=sys.stderr)


@app.command(rich_help_panel=Group.start)
def new(
    kind: Annotated[
        str,
        typer.Argument(help="Kind of custom code: model, metric, map or start."),
    ],
    name: Annotated[str, typer.Argument(help="Name of the new code, such as vortex.")],
    folder: Annotated[
        Path, typer.Option(help="Existing folder for the new files.")
    ] = Path(),
) -> None:
    """Create a custom model, metric, map or start.

    Writes a file NAME.py that runs without changes. A start is code for initial
    conditions. A model also has NAME.yaml, a small study, and test_NAME.py. Existing
    files are never replaced.

    Examples
    --------
    sweep new model vortex
    sweep new metric stretch --folder studies
    """
    from sweep.published import create

    written = create(kind, name, folder)
    print(", ".join(map(str, written)), file=sys.stderr)
    code, *with_code = written
    if with_code:
        spec = with_code[0]
        for command in (("check", code), ("launch", spec), ("view", spec)):
            arguments = ["sweep", *map(str, command)]
            print("  " + shlex.join(arguments), file=sys.stderr)
