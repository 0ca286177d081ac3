"""What a shell completes: names of studies, models and topics of the guide.

It must answer at once, and a folder may be anyone's: so files are looked for and a
small part of one is read, but neither kernels nor stored tables.
"""

from collections.abc import Iterable
from pathlib import Path

import typer

from sweep.cli.topics import all_topics
from sweep.spec.study_folder import STUDY_NAME, launched_studies
from sweep.trial.compiled import beside_kernels


def guide_topics(beginning: str) -> list[str]:
    """The topics of the guide."""
    return _beginning(beginning, all_topics())


def model_names(beginning: str) -> list[str]:
    """The built-in models, each of which has a file of its name."""
    files = (beside_kernels() / "kernels" / "models").glob("[!_]*.py")
    return _beginning(beginning, sorted(file.stem for file in files))


def study_names(context: typer.Context, beginning: str) -> list[str]:
    """The studies in the folder of results that the command line names."""
    results = Path(str(context.params.get("results") or "results"))
    return _beginning(beginning, launched_studies(results))


def _beginning(beginning: str, names: Iterable[str]) -> list[str]:
    """The names that begin so, less those of others that a shell could read as more."""
    return [
        name
        for name in names
        if name.startswith(beginning) and STUDY_NAME.fullmatch(name)
    ]
