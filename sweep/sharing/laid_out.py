"""A stored study as files that are launched on: its spec, with its code where the spec
looks for it, and earlier versions of the code apart. Nothing of it runs.
"""

import os
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from sweep.errors import OutputError, StoreError
from sweep.spec.study_folder import SPEC
from sweep.store.stored_code import stored_folder
from sweep.tables.outputs import unfinished
from sweep.tables.stored_study import StoredStudy

PLAIN = re.compile(r"\w[\w.-]*")
MOST_ABOVE = 8
"""Folders between a spec and the one from which its code is taken."""


@dataclass(frozen=True)
class LaidOut:
    """Files that were written, the spec first; `code_from` is the folder that a launch
    must be told, None where the code lies beside the spec.
    """

    files: tuple[Path, ...]
    code_from: Path | None

    @property
    def spec(self) -> Path:
        return self.files[0]


def check_new(folder: Path) -> None:
    """Raise OutputError where there is something already."""
    if os.path.lexists(folder):
        raise OutputError(f"{folder}: exists already; name a new folder")


def lay_out(study: StoredStudy, folder: Path) -> LaidOut:
    """Write the spec of a study as last launched into a new folder, with the version of
    its own code that it was launched with, and each other version by which stored
    trials were computed in a folder of its own.

    A study that was renamed has its new name in the spec. Raises OutputError for a
    folder that exists or cannot be written, and StoreError for code that no launch has
    stored.
    """
    check_new(folder)
    versions, place = study.own_code, PurePosixPath()
    current = study.provenance.get("own", {}).get("sha")
    steps = PurePosixPath()
    if current:
        steps = PurePosixPath(os.path.normpath(stored_folder(study.store, current)))
        place = _spec_folder(study, steps)
    beside = PurePosixPath(os.path.normpath(place / steps))
    texts = [(place / SPEC, _spec(study))]
    for sha, files in versions.items():
        home = beside if sha == current else PurePosixPath(f"version-{sha[:12]}")
        texts += [(home / name, text) for name, text in files.items()]
    names = [name for name, _ in texts]
    if len({str(name).casefold() for name in names}) < len(names):
        raise StoreError("two files of its code have one name", study.name)
    folder.mkdir(parents=True)
    for name, text in texts:
        with unfinished(folder / name, folder) as file:
            file.write(text.encode(errors="replace"))
    told = folder / beside if beside != place else None
    return LaidOut(tuple(folder / name for name in names), told)


def _spec_folder(study: StoredStudy, steps: PurePosixPath) -> PurePosixPath:
    """Where the spec lies so that the folder of its code, some steps up and down from
    there, lies in the new folder. The names are those of the folders of then.
    """
    above = steps.parts.count("..")
    if steps.is_absolute() or above > MOST_ABOVE:
        raise StoreError(f'its code was taken from "{steps}"', study.name)
    then = PurePosixPath(str(study.provenance.get("spec_path", ""))).parent.parts
    names = then[len(then) - above :] if above <= len(then) else ()
    if not all(map(PLAIN.fullmatch, names)) or len(names) < above:
        names = ("study",) * above
    return PurePosixPath(*names)


def _spec(study: StoredStudy) -> str:
    """The text of its spec, in which it has the name that it has now."""
    launched_as = str(study.provenance.get("study", study.name))
    quoted = rf"([\"']?){re.escape(launched_as)}\1"
    line = re.compile(rf"^study:[ \t]*{quoted}(?=\s*(?:#|$))", re.MULTILINE)
    return line.sub(f"study: {study.name}", study.spec, count=1)
