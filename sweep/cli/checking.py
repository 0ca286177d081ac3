"""The command that says whether a model, and what else a file offers, keeps its
promises.
"""

from typing import Annotated

import typer

from sweep.cli.app import Json, app


@app.command()
def check(
    model: Annotated[
        str,
        typer.Argument(
            metavar="FILE[:NAME]",
            help="A file with a model, metrics, maps, starts or samplers, or the name"
            " of a model; NAME is MODEL if not given.",
        ),
    ],
    as_json: Json = False,
) -> None:
    """Whether a model keeps the promises of the built-in ones, and so do the metrics,
    maps, starts and samplers of its file, or of a file without a model. It runs code,
    the file.

    A line a promise: kept, broken with file, line and rule, or why it does not apply.
    The exit code is 1 if one is broken.
    """
    import json
    from dataclasses import asdict

    from sweep.testing.promises import BROKEN, check_file

    found = []
    of = ""
    for kept in check_file(model):
        if kept.of != of and not as_json:
            print(kept.of)
        of = kept.of
        found.append(kept)
        if not as_json:
            seconds = f"{kept.seconds:.1f} s"
            print(f"{kept.status:<14} {kept.promise:<11} {seconds:>7}  {kept.words}")
    if as_json:
        print(json.dumps([asdict(kept) for kept in found], indent=1))
    if any(kept.status == BROKEN for kept in found):
        raise SystemExit(1)
