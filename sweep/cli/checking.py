"""The command that says whether a model keeps its promises."""

from typing import Annotated

import typer

from sweep.cli.app import Json, app


@app.command()
def check(
    model: Annotated[
        str,
        typer.Argument(
            metavar="FILE[:NAME]",
            help="A file with a model, or the name of a model; NAME is MODEL if not"
            " given.",
        ),
    ],
    as_json: Json = False,
) -> None:
    """Whether a model keeps the promises of the built-in ones; it runs code, the model.

    A line a promise: kept, broken with file, line and rule, or why it does not apply.
    The exit code is 1 if one is broken.
    """
    import json
    from dataclasses import asdict

    from sweep.testing.promises import BROKEN, check_all
    from sweep.testing.subject import subject

    found = []
    for kept in check_all(subject(model)):
        found.append(kept)
        if not as_json:
            seconds = f"{kept.seconds:.1f} s"
            print(f"{kept.status:<14} {kept.promise:<11} {seconds:>7}  {kept.words}")
    if as_json:
        print(json.dumps([asdict(kept) for kept in found], indent=1))
    if any(kept.status == BROKEN for kept in found):
        raise SystemExit(1)
