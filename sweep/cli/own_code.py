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
    """
    from sweep.tables.outputs import unfinished
    from sweep.tables.stored_study import StoredStudy

    texts = StoredStudy(study, results).own_code
    if not texts:
        print(f"{study} was computed by no code but ours", file=sys.stderr)
    elif to:
        if to.exists():
            stop(f"{to}: exists already; name a new folder")
        to.mkdir(parents=True)
        for name, text in texts.items():
            with unfinished(to / name, to) as file:
                file.write(text.encode())
            print(to / name)
    else:
        for name, text in texts.items():
            print(f"# {'-' * 20} {name}\n{text}")
