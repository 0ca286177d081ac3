"""The command that checks the requirements of a model or of other custom code."""

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
    """Check whether a model keeps the promises of the built-in ones.

    The metrics, maps, starts and samplers of its file are checked too, or those of a
    file without a model. It runs code, the file.

    A line a promise: kept, broken with file, line and rule, or why it does not apply.
    The exit code is 1 if one is broken.
    """
    import json
    from dataclasses import asdict

    from sweep.testing import BROKEN, check_file

    checks = []
    owner = ""
    for check in check_file(model):
        if check.of != owner and not as_json:
            print(check.of)
        owner = check.of
        checks.append(check)
        if not as_json:
            seconds = f"{check.seconds:.1f} s"
            print(f"{check.status:<14} {check.promise:<11} {seconds:>7}  {check.words}")
    if as_json:
        print(json.dumps([asdict(check) for check in checks], indent=1))
    if any(check.status == BROKEN for check in checks):
        raise SystemExit(1)
