"""The command that checks the requirements of a model or of other custom code."""

from typing import Annotated

import typer

from sweep.cli.app import Group, Json, app


@app.command(rich_help_panel=Group.develop)
def check(
    model: Annotated[
        str,
        typer.Argument(
            metavar="FILE[:NAME]",
            help="File with a model, metrics, maps, initial conditions or samplers, or"
            " the name of a model; the default of NAME is MODEL.",
        ),
    ],
    as_json: Json = False,
) -> None:
    """Check a custom model (this runs the file).

    Checks the requirements that all built-in models meet. Checks the metrics, maps,
    initial conditions and samplers of the file too, also in a file without a model.

    Prints one line per requirement: kept, broken with file, line and rule, or the
    reason why the requirement does not apply. The exit code is 1 if a requirement is
    broken.

    Examples
    --------
    sweep check vortex.py
    sweep check vortex.py --json
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
