"""The command that shows custom code of a stored study."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import Group, Results, StudyName, app


@app.command(rich_help_panel=Group.store)
def code(
    study: StudyName,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to", help="New folder for the spec and the code, ready for a launch."
        ),
    ] = None,
    results: Results = Path("results"),
) -> None:
    """Show the custom code that computed a study.

    Custom code is the code of models, metrics, maps and initial conditions in files
    next to the spec. The code does not run.

    Prints each version that computed a stored trial, first the version of the last
    launch. With --to, writes the spec and the code of the last launch, and each earlier
    version in a subfolder.

    Examples
    --------
    sweep code my/vortex
    sweep code my/vortex --to received
    """
    from sweep.cli.spec_files import how_to_launch_on
    from sweep.sharing import lay_out
    from sweep.tables import StoredStudy

    stored = StoredStudy(study, results)
    versions = stored.own_code
    if not versions:
        print(f"{study} was computed by built-in code only", file=sys.stderr)
    if to:
        laid = lay_out(stored, to)
        print(*laid.files, sep="\n")
        print(how_to_launch_on(stored, laid), file=sys.stderr)
        return
    for sha, texts in versions.items():
        print(f"# {'=' * 20} version {sha[:12]}: {', '.join(texts)}")
        for name, text in texts.items():
            print(f"# {'-' * 20} {name}")
            print("\n".join(f"    {line}" for line in text.splitlines()))
