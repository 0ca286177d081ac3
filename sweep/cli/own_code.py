"""The command that shows custom code of a stored study."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import Results, StudyName, app


@app.command()
def code(
    study: StudyName,
    to: Annotated[
        Path | None,
        typer.Option(
            "--to", help="Write the spec and the code into this new folder, to launch."
        ),
    ] = None,
    results: Results = Path("results"),
) -> None:
    """Show the code of the user's own that computed a study.

    It is that of models, metrics, maps and starts from files beside its spec. It is
    read, and not run.

    Each version is shown by which any stored trial was computed, that of the spec as
    last launched first. A folder gets the spec as last launched and that version of the
    code, ready to launch, and each earlier version in a folder of its own.
    """
    from sweep.cli.spec_files import how_to_launch_on
    from sweep.sharing import lay_out
    from sweep.tables import StoredStudy

    stored = StoredStudy(study, results)
    versions = stored.own_code
    if not versions:
        print(f"{study} was computed by no code but ours", file=sys.stderr)
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
