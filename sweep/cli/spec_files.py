"""The file of a spec: named on a command line, or of a stored study."""

import shlex
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from sweep.errors import ChoiceError, UserError
from sweep.own_code import SUFFIX
from sweep.spec import SPEC, SPEC_ENDINGS
from sweep.store import Location, stored_names, studies_of
from sweep.tables import command_of
from sweep.text import shortened

if TYPE_CHECKING:
    from sweep.sharing import LaidOut
    from sweep.tables import StoredStudy


def check_spec_file(file: Path, results: Location = Path("results")) -> None:
    """Raise ChoiceError if a file that a user named is missing or is code.

    For the name of a stored study, the error explains how to resume the study.
    """
    if file.suffix == SUFFIX:
        raise ChoiceError(
            f"{file}: is code, but a spec is a YAML file that names the code with"
            f' "model: ./{file.name}"'
        )
    with suppress(PermissionError):  # the reader of the file reports the error
        if not file.exists():
            name = file.as_posix()
            message = f"{file}: no such file"
            if file.suffix not in SPEC_ENDINGS:
                message += "; a spec is a YAML file, NAME.yaml"
                if name in stored_names(results):
                    again = _again(name, results)
                    message += f", and {name} is a stored study: {again}"
            raise ChoiceError(message)


def _again(name: str, results: Location) -> str:
    """Return how to resume a stored study, in words."""
    from sweep.tables import StoredStudy

    try:
        stored = StoredStudy(name, results)
    except UserError as error:
        return str(error)
    if needed := what_the_spec_needs(stored):
        return needed
    if file := _file_of(stored):
        return f"{_command(stored)} {shlex.quote(str(file))} resumes the study"
    return f"to resume the study, copy {stored.store.folder / SPEC}"


def _command(stored: "StoredStudy") -> str:
    return f"sweep {command_of(stored.spec)}"


def how_to_launch_on(study: "StoredStudy", laid: "LaidOut") -> str:
    """Return how to resume a study from spec and code in a folder, in words."""
    arguments = [str(laid.spec)]
    arguments += ["--code-from", str(laid.code_from)] if laid.code_from else []
    place = str(study.store.results)
    arguments += ["--results", place] if place != "results" else []
    return f"{_command(study)} {shlex.join(arguments)} resumes the study"


def what_the_spec_needs(study: "StoredStudy") -> str:
    """Return the change of the spec that a renamed study needs before a launch.

    The text is "" if the study was launched under the current name. A copy of the
    stored spec is needed if the spec file is missing, or describes another stored
    study.
    """
    launched_as = str(study.provenance.get("study"))
    if launched_as == study.name:
        return ""
    old = shortened(launched_as)
    new = f'"study: {study.name}"'
    stored = stored_names(study.store.results)
    file = None if launched_as in stored else _file_of(study)
    if file:
        return (
            f"the spec {shortened(str(file))} has the study {old}: write {new} in the"
            f" spec, or the next launch starts study {old} from the beginning"
        )
    return (
        f"to resume the study, copy {study.store.folder / SPEC} and change the line"
        f' "study: {old}" of the copy to {new}; without the change a launch starts'
        f" study {old}"
    )


def _file_of(study: "StoredStudy") -> Path | None:
    """Return the file from which a study was last launched.

    None if no such file has a study of that name, for example on another machine.
    """
    file = str(study.provenance.get("spec_path"))
    launched_as = str(study.provenance.get("study"))
    with suppress(OSError, ValueError):  # the text may be untrusted, and no path
        if Path(file).is_file() and launched_as in studies_of(Path(file)):
            return Path(file)
    return None
