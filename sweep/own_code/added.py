"""The code of a stored study with further files."""

import os
from collections.abc import Sequence
from pathlib import Path

from sweep.errors import CodeError
from sweep.own_code.catalogue import OwnCatalogue, OwnCode, loaded
from sweep.own_code.sources import Sources, gather


def with_files(
    code: OwnCode | None, spec: Path, files: Sequence[Path]
) -> tuple[OwnCatalogue, list[str]]:
    """Return a catalogue of stored code with further files. The code runs.

    Parameters
    ----------
    code : OwnCode or None
        Code of the study; None for a study without custom code.
    spec : Path
        File of the spec. The folder of the code is relative to its folder.
    files : sequence of Path
        Further files, within the folder of the code.

    Returns
    -------
    catalogue : OwnCatalogue
    names : list of str
        Path of each file from the folder of the code.

    Raises
    ------
    CodeError
        If a file is missing, is outside the folder, or is in the code with another
        text; or if the code cannot be used.
    """
    folder = spec.parent / (code.folder if code else ".")
    names = [_inside(folder, file) for file in files]
    texts = code.sources.texts if code else {}
    for file, text in (new := gather(folder, names)).files:
        if texts.get(file, text) != text:
            raise CodeError(
                f"{folder / file} has changed since the study was launched: write new"
                " metrics into a new file"
            )
    joined = Sources(tuple(sorted({**texts, **new.texts}.items())))
    named = dict.fromkeys(names) | (dict(code.named) if code else {})
    packages = code.packages if code else ()
    up = code.folder if code else "."
    return loaded(OwnCode(joined, tuple(named.items()), packages, up)), names


def _inside(folder: Path, file: Path) -> str:
    """Return the path of a file from the folder of the code."""
    absolute = Path(os.path.normpath(Path.cwd() / file))
    if not file.is_file():
        raise CodeError(f'there is no file "{file}"')
    if not absolute.is_relative_to(folder.resolve()):
        raise CodeError(
            f"{file} is outside {folder}, the folder of the spec and of the code: copy"
            " the file there, so that the spec can name it"
        )
    return absolute.relative_to(folder.resolve()).as_posix()
