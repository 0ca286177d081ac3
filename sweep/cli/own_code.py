"""The command that shows the code of a stored study."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from sweep.cli.app import Results, StudyName, app, stop


@app.command()
def code(
    study: StudyName,
    to: Annotated[
        Path | None,
        typer.Option("--to", help="Write the files into this new folder."),
    ] = None,
    results: Results = Path("results"),
) -> None:
    """The code of the user's own that computed a study: models, metrics, maps and
    starts from files beside its spec. It is read, and not run.

    Each version is shown by which any stored trial was computed, that of the spec as
    last launched first. In a folder, several versions have a folder each.
    """
    from sweep.tables.outputs import unfinished
    from sweep.tables.stored_study import StoredStudy

    versions = StoredStudy(study, results).own_code
    if not versions:
        print(f"{study} was computed by no code but ours", file=sys.stderr)
    if to and to.exists():
        stop(f"{to}: exists already; name a new folder")
    for sha, texts in versions.items():
        if to:
            folder = to / sha[:12] if len(versions) > 1 else to
            folder.mkdir(parents=True)
            for name, text in texts.items():
                with unfinished(folder / name, folder) as file:
                    file.write(text.encode(errors="replace"))
                print(folder / name)
            continue
        print(f"# {'=' * 20} version {sha[:12]}: {', '.join(texts)}")
        for name, text in texts.items():
            print(f"# {'-' * 20} {name}")
            print("\n".join(f"    {line}" for line in text.splitlines()))
