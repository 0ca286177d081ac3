"""Completions in a shell: names of studies, models and topics of the guide.

A completion must be fast, and a folder may be untrusted. So the module looks for files
and reads a small part of a file, but imports no kernels and reads no stored tables.
"""

from collections.abc import Iterable
from pathlib import Path

import typer

from sweep.cli.topics import all_topics
from sweep.spec import STUDY_NAME, launched_studies
from sweep.trial import beside_kernels


def guide_topics(beginning: str) -> list[str]:
    """Return the topics of the guide that start with `beginning`."""
    return _beginning(beginning, all_topics())


def model_names(beginning: str) -> list[str]:
    """Return the built-in models that start with `beginning`, from names of files."""
    files = (beside_kernels() / "kernels" / "models").glob("[!_]*.py")
    return _beginning(beginning, sorted(file.stem for file in files))


def study_names(context: typer.Context, beginning: str) -> list[str]:
    """Return the studies that start with `beginning`, in the folder of results."""
    results = Path(str(context.params.get("results") or "results"))
    return _beginning(beginning, launched_studies(results))


def _beginning(beginning: str, names: Iterable[str]) -> list[str]:
    """Return the names that start with `beginning`, and that a shell reads as one word.

    Names of files may be untrusted.
    """
    return [
        name
        for name in names
        if name.startswith(beginning) and STUDY_NAME.fullmatch(name)
    ]
