"""The file of a spec: that which a command line names, and that of a stored study."""

import shlex
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.errors import ChoiceError, UserError
from sweep.own_code.sources import SUFFIX
from sweep.spec.study_folder import SPEC, SPEC_ENDINGS
from sweep.store.finding import stored_names, studies_of
from sweep.store.locations import Location
from sweep.text import shortened

if TYPE_CHECKING:
    from sweep.tables.stored_study import StoredStudy


def check_spec_file(given: Path, results: Location = Path("results")) -> None:
    """Raise ChoiceError where there is no file of a spec that a user has named: if it
    is the name of a stored study, it says how that is launched again. And for code.
    """
    if given.suffix == SUFFIX:
        raise ChoiceError(
            f"{given}: this is code, and a spec is a YAML file that names it, as"
            f' "model: ./{given.name}"'
        )
    with suppress(PermissionError):  # who reads the file says so
        if not given.exists():
            name, said = given.as_posix(), f"{given}: no such file"
            if given.suffix not in SPEC_ENDINGS:
                said += "; a spec is a YAML file, as NAME.yaml"
                if name in stored_names(results):
                    said += f", and {name} is a stored study: {_again(name, results)}"
            raise ChoiceError(said)


def _again(name: str, results: Location) -> str:
    """How to launch a stored study again, in words."""
    from sweep.tables.stored_study import StoredStudy

    try:
        stored = StoredStudy(name, results)
    except UserError as error:
        return str(error)
    if needed := what_the_spec_needs(stored):
        return needed
    if file := _file_of(stored):
        command = "search" if stored.store.read_asked() is not None else "launch"
        return f"sweep {command} {shlex.quote(str(file))} launches it on"
    return f"to launch it on, copy {stored.store.folder / SPEC}"


def what_the_spec_needs(study: "StoredStudy") -> str:
    """What to change in its spec before a study is launched on that was launched under
    another name; "" where it was launched under this one.

    Where its file is not here, or describes another study that is stored too, it is a
    copy of the stored spec that is changed.
    """
    said, new = str(study.provenance.get("study")), f'"study: {study.name}"'
    if said == study.name:
        return ""
    old, place = shortened(said), study.store.results
    file = None if said in stored_names(place) else _file_of(study)
    if file:
        return (
            f"the spec {shortened(str(file))} has the study {old}: write {new} there,"
            " or its next launch begins that study anew"
        )
    return (
        f"to launch it on, copy {study.store.folder / SPEC} and change the line"
        f' "study: {old}" of the copy to {new}: without that a launch begins {old}'
    )


def _file_of(study: "StoredStudy") -> Path | None:
    """The file from which a study was last launched; None where none is here that has
    a study of that name, as on another machine.
    """
    file, said = (str(study.provenance.get(key)) for key in ("spec_path", "study"))
    with suppress(OSError, ValueError):  # it may be anyone's, and no path
        if Path(file).is_file() and said in studies_of(Path(file)):
            return Path(file)
    return None
