"""Which studies there are, and what to say where the one that is asked for is not."""

import os
from pathlib import Path

from sweep.errors import SpecError, StoreError
from sweep.spec.strict_yaml import read_documents
from sweep.spec.study_folder import PLAN, SPEC_ENDINGS, launched_studies
from sweep.store.locations import Location
from sweep.text import choices


def stored_names(results: Location) -> list[str]:
    """The names of the studies in a folder, at most three folders deep, or below a
    prefix.
    """
    if isinstance(results, Path):
        return launched_studies(results)
    ending = f"/{PLAN}"
    found = results.listed().objects or ()
    return sorted(key.removesuffix(ending) for key in found if key.endswith(ending))


def no_study(place: Location, results: Location) -> StoreError:
    """The error that says that no study lies in a place below `results`: which there
    are, or which name a spec gives to its study.
    """
    if isinstance(results, Path):
        check_folder(results)
    said = f"{place}: no study has been launched here"
    name = _name(place, results)
    if name.endswith(SPEC_ENDINGS):
        return StoreError(f"{said}; {_named_by(Path(name))}")
    names = stored_names(results)
    if below := [one for one in names if one.startswith(f"{name}/")]:
        return StoreError(said + choices("", below, "Below it"))
    return StoreError(said + choices(name, names, "Stored"))


def check_folder(results: Path) -> None:
    """Raise StoreError where there is no such folder of results."""
    if not results.is_dir():
        what = "is no folder" if results.exists() else "no such folder of results"
        raise StoreError(
            f"{results}: {what}; name another one, or launch a study first"
        )


def _name(place: Location, results: Location) -> str:
    if isinstance(place, Path):
        return Path(os.path.relpath(place, str(results))).as_posix()
    return str(place).removeprefix(f"{results}/")


def _named_by(spec: Path) -> str:
    """How the file of a spec, which was given as a study, names its study."""
    if names := studies_of(spec):
        return f"{spec} is a spec, of the study {' and '.join(names)}"
    return "a study is named as its spec says, and not as the file of that"


def studies_of(spec: Path) -> list[str]:
    """The names of the studies that the file of a spec describes; none where it cannot
    be read.
    """
    try:
        roots = read_documents(spec)
    except SpecError:
        return []
    said = [one.value.get("study") for one in roots if isinstance(one.value, dict)]
    return [name for name in said if isinstance(name, str)]
