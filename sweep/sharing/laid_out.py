"""A stored study as files from which it can be resumed.

The files are the spec, the code in the folder that the spec expects, and earlier
versions of the code in separate folders. No code runs.
"""

import os
import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from sweep.errors import OutputError, StoreError
from sweep.spec import SPEC
from sweep.store import stored_folder
from sweep.tables import StoredStudy, unfinished

PLAIN = re.compile(r"\w[\w.-]*")
MOST_ABOVE = 8
"""Most folders that the folder of the code may be above the spec."""


@dataclass(frozen=True)
class LaidOut:
    """Files that were written, the spec first.

    `code_from` is the folder of the code, which a run needs as an option. The value is
    None if the code is next to the spec.
    """

    files: tuple[Path, ...]
    code_from: Path | None

    @property
    def spec(self) -> Path:
        """Path of the spec."""
        return self.files[0]


def check_new(folder: Path) -> None:
    """Raise OutputError if something exists at the path of a new folder."""
    if os.path.lexists(folder):
        raise OutputError(f"{folder}: exists already; name a new folder")


def lay_out(study: StoredStudy, folder: Path) -> LaidOut:
    """Write the spec and the custom code of a study into a new folder.

    The spec and the code come from the last run. Each earlier version of the code that
    computed stored trials has a separate folder. The spec of a renamed study has the
    new name. Raises OutputError for a folder that exists or cannot be written, and
    StoreError for code that no run has stored.
    """
    check_new(folder)
    spec_folder = PurePosixPath()
    current = study.provenance.get("own", {}).get("sha")
    steps = PurePosixPath()
    if current:
        steps = PurePosixPath(os.path.normpath(stored_folder(study.store, current)))
        spec_folder = _spec_folder(study, steps)
    code_folder = PurePosixPath(os.path.normpath(spec_folder / steps))
    texts = [(spec_folder / SPEC, _spec(study))]
    for sha, files in study.own_code.items():
        home = code_folder if sha == current else PurePosixPath(f"version-{sha[:12]}")
        texts += [(home / name, text) for name, text in files.items()]
    names = [name for name, _ in texts]
    if len({str(name).casefold() for name in names}) < len(names):
        raise StoreError("two files of the custom code have one name", study.name)
    folder.mkdir(parents=True)
    for name, text in texts:
        with unfinished(folder / name, folder) as file:
            file.write(text.encode(errors="replace"))
    code_from = folder / code_folder if code_folder != spec_folder else None
    return LaidOut(tuple(folder / name for name in names), code_from)


def _spec_folder(study: StoredStudy, steps: PurePosixPath) -> PurePosixPath:
    """Return the folder of the spec, relative to the new folder.

    `steps` leads up and down from the folder of the spec to the folder of the code,
    which must be in the new folder. Folders keep the names that they had during the
    run.
    """
    above = steps.parts.count("..")
    if steps.is_absolute() or above > MOST_ABOVE:
        raise StoreError(f'the custom code came from "{steps}"', study.name)
    then = PurePosixPath(str(study.provenance.get("spec_path", ""))).parent.parts
    names = then[len(then) - above :] if above <= len(then) else ()
    if not all(map(PLAIN.fullmatch, names)) or len(names) < above:
        names = ("study",) * above
    return PurePosixPath(*names)


def _spec(study: StoredStudy) -> str:
    """Return the text of the spec of a study, with the present name of the study."""
    launched_as = str(study.provenance.get("study", study.name))
    quoted = rf"([\"']?){re.escape(launched_as)}\1"
    line = re.compile(rf"^study:[ \t]*{quoted}(?=\s*(?:#|$))", re.MULTILINE)
    return line.sub(f"study: {study.name}", study.spec, count=1)
