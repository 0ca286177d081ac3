"""Names of the stored studies, and the error for a study that is not stored."""

import os
from pathlib import Path

from sweep.errors import SpecError, StoreError
from sweep.spec import PLAN, SPEC_ENDINGS, launched_studies, read_documents
from sweep.store.locations import Location
from sweep.text import choices


def stored_names(results: Location) -> list[str]:
    """Return the names of the studies in a folder, or below a prefix, sorted.

    In a folder the search is at most three folders deep.
    """
    if isinstance(results, Path):
        return launched_studies(results)
    ending = f"/{PLAN}"
    keys = results.listed().objects or ()
    return sorted(key.removesuffix(ending) for key in keys if key.endswith(ending))


def no_study(place: Location, results: Location) -> StoreError:
    """Return the error that no study is stored in a location below `results`.

    The error lists the stored studies, or the name that a spec gives to its study.
    """
    if isinstance(results, Path):
        check_folder(results)
    message = f"{place}: no study has been launched here"
    name = _name(place, results)
    if name.endswith(SPEC_ENDINGS):
        return StoreError(f"{message}; {_named_by(Path(name))}")
    studies = stored_names(results)
    if below := [study for study in studies if study.startswith(f"{name}/")]:
        return StoreError(message + choices("", below, "Below it"))
    return StoreError(message + choices(name, studies, "Stored"))


def check_folder(results: Path) -> None:
    """Raise StoreError if there is no such folder of results."""
    if not results.is_dir():
        flaw = "is not a folder" if results.exists() else "no such folder of results"
        raise StoreError(
            f"{results}: {flaw}; choose another folder, or launch a study first"
        )


def _name(place: Location, results: Location) -> str:
    if isinstance(place, Path):
        return Path(os.path.relpath(place, str(results))).as_posix()
    return str(place).removeprefix(f"{results}/")


def _named_by(spec: Path) -> str:
    """Return the study names in a spec whose file was given as a study, in words."""
    if studies := studies_of(spec):
        return f"{spec} is a spec, of the study {' and '.join(studies)}"
    return "use the name after `study` in the spec, not the name of the file"


def studies_of(spec: Path) -> list[str]:
    """Return the names of the studies that the file of a spec describes.

    The list is empty if the file cannot be read.
    """
    try:
        roots = read_documents(spec)
    except SpecError:
        return []
    names = [root.value.get("study") for root in roots if isinstance(root.value, dict)]
    return [name for name in names if isinstance(name, str)]
