"""A study as one file, for a colleague, an archive or another machine.

The file has all stored files of the study, and descriptions for readers without
boidsweep.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sweep.errors import ChoiceError, UnreadableError
from sweep.sharing.citing import Citation, cite
from sweep.sharing.packed_file import CRATE, STUDY, Member, Sink, write_packed
from sweep.sharing.stranger import crate, readme
from sweep.spec import ASKED, PARTS, PLAN, SPEC, code_file
from sweep.store import Location, kept_code, open_stored, remedy_for
from sweep.tables import (
    StoredStudy,
    as_csv,
    check_output,
    origins_of,
    sha256,
    unfinished,
    write_rows,
)

READ_BYTES = 2**20
ENDINGS = (".zip",)


@dataclass(frozen=True)
class Packed:
    """A written file of a study: path, size and sha256.

    `apart` is the number of packed trials that do not belong to the spec of the last
    run.
    """

    path: Path
    size_bytes: int
    sha256: str
    apart: int


def packed_name(study: str) -> Path:
    """Return the default path of the packed file of a study."""
    return Path(f"{study.replace('/', '-')}.zip")


def pack(
    study: StoredStudy, path: Path | None = None, *, force: bool = False
) -> Packed:
    """Write all stored files of a study into one .zip file.

    `sweep.sharing.packed_file` describes the file. A study always gives identical
    bytes. A run of the study may continue meanwhile: the file has the trials that are
    stored at the time of the packing.

    Parameters
    ----------
    study : StoredStudy
        A whole study, without a restriction by `where`.
    path : Path, optional
        By default `packed_name` in the current folder.
    force : bool, default False
        Replace a file that exists.

    Returns
    -------
    Packed

    Raises
    ------
    OutputError
        If the file exists without `force`, or cannot be written.
    ChoiceError
        If no trials are stored, or `where` has restricted the study.
    StoreError
        If the study cannot be read.

    Examples
    --------
    >>> import sweep
    >>> pack(sweep.load("my/first")).path.name
    'my-first.zip'
    """
    path = path or packed_name(study.name)
    check_output(path, ENDINGS, force=force)
    if study.chosen:
        raise ChoiceError("only a whole study can be packed", study.name)
    citation = cite(study)
    with unfinished(path) as file:
        study.store.steadily(
            lambda parts: write_packed(file, dict(_members(study, citation, parts)))
        )
    return Packed(path, path.stat().st_size, sha256(path), study.apart())


def _members(
    study: StoredStudy, citation: Citation, parts: list[Location]
) -> Iterator[tuple[str, Member]]:
    code = {
        f"code/{sha[:12]}/{name}": text
        for sha, texts in study.own_code.items()
        for name, text in texts.items()
    }
    yield "README.md", _text(readme(study, citation))
    yield CRATE, _text(crate(study, citation, [*code]))
    yield "CITATION.bib", _text(citation.as_bibtex() + "\n")
    yield "provenance.json", _text(_provenance(study))
    for name, text in code.items():
        yield name, _text(text)
    yield "tables/columns.csv", _text(as_csv(study.columns))
    yield "tables/trials.csv", partial(_trials, study)
    for name in (SPEC, PLAN, ASKED, *map(code_file, sorted(kept_code(study.store)))):
        place = study.store.folder / name
        if name != ASKED or place.exists():
            yield f"{STUDY}/{name}", partial(_stored, place)
    for part in parts:
        files: list[Location] = [*part.iterdir()]
        for file in sorted(files, key=lambda file: file.name):
            yield f"{STUDY}/{PARTS}/{part.name}/{file.name}", partial(_stored, file)


def _text(text: str) -> Member:
    content = text.encode(errors="replace")

    def write(sink: Sink) -> None:
        sink.write(content)

    return write


def _trials(study: StoredStudy, sink: Sink) -> None:
    write_rows(study, "trials", ".csv", sink)


def _stored(place: Location, sink: Sink) -> None:
    """Copy a stored file."""
    try:
        with open_stored(place) as stream:
            while content := stream.read(READ_BYTES):
                sink.write(content)
    except FileNotFoundError:
        raise
    except OSError as error:
        remedy = remedy_for(place.parent)
        raise UnreadableError(place, f"cannot be read ({error})", remedy) from error


def _provenance(study: StoredStudy) -> str:
    listed = study.plan["trial_id"].to_pylist()
    record: dict[str, Any] = study.provenance | {"origins": origins_of(study, listed)}
    return json.dumps(record, indent=1, sort_keys=True)
