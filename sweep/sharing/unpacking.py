"""A stored study from a packed file, after a complete check of the file."""

import hashlib
import secrets
from dataclasses import dataclass
from pathlib import Path

from sweep.errors import ChoiceError, StoreError, UserError
from sweep.sharing.packed_file import CRATE, MOST_CRATE, STUDY, PackedFile
from sweep.spec import PARTS, PLAN, WRITING, why_no_name
from sweep.store import (
    MANIFEST,
    Location,
    Lock,
    StudyPlace,
    codes_of,
    create,
    damage,
    open_stored,
    parsed,
    place_of,
)
from sweep.tables import StoredStudy, origins


@dataclass(frozen=True)
class LoadedFile:
    """A study that was loaded from a file.

    `place` is the folder of the study, `launched_as` the name of the study in the run.
    `own_code` is True if custom code computed trials of the study.
    """

    study: str
    place: Location
    launched_as: str
    own_code: bool


def unpack(path: Path, results: Location, name: str | None = None) -> LoadedFile:
    """Store the study of a packed file.

    Parts, code, spec and plan are identical to the packed study. Nothing is written
    before all checksums of the file are verified. The plan is written last, so that an
    incomplete study is not listed. A killed call can be repeated. No code of the study
    runs.

    Parameters
    ----------
    path : Path
        File written by `pack`.
    results : Location
        Folder of stored studies.
    name : str, optional
        Name of the study; by default the name in the packed file.

    Returns
    -------
    LoadedFile

    Raises
    ------
    StoreError
        If the file is not a packed study, is damaged, has a study that no run writes,
        or if the study exists already.
    ChoiceError
        If the name is not valid.

    Examples
    --------
    >>> from sweep.store.locations import location
    >>> unpack(Path("my-first.zip"), location("results"), "my/copy").study
    'my/copy'
    """
    with PackedFile(path) as packed:
        study = name or _packed_name(packed)
        if why := why_no_name(study):
            raise ChoiceError(f"{why}; --as NAME loads the study under another name")
        place = place_of(results / study, results)
        _refuse_others(place, study, packed)
        try:
            with Lock(place):
                place.tidy(alone=True)
                # A run may have begun and ended during the wait for the lock.
                _refuse_others(place, study, packed)
                launched_as, own_code = _fill(place, packed)
        except BaseException:
            place.left()
            raise
    return LoadedFile(study, place.root, launched_as, own_code)


def _packed_name(packed: PackedFile) -> str:
    """Return the name of the study in the packed file. Raises StoreError."""
    try:
        graph = parsed(packed.read(CRATE, MOST_CRATE), {"@graph": [{}]})["@graph"]
        (name,) = (entity["name"] for entity in graph if entity.get("@id") == "./")
        if not isinstance(name, str):
            raise ValueError("a name is a string")
    except (ValueError, KeyError):
        raise packed.error(f"{CRATE} has no name of the study") from None
    return name


def _refuse_others(place: StudyPlace, study: str, packed: PackedFile) -> None:
    """Raise StoreError if the place has files that are not in the packed file.

    Files that also are in the packed file come from an earlier, killed process.
    """
    content = place.content()
    if PLAN in content:
        raise StoreError(
            f"{place.root}: exists already; --as NAME loads the study under another"
            " name"
        )
    names = [name for name in content if name not in (PARTS, WRITING)]
    names += [f"{PARTS}/{part.name}/{MANIFEST}" for part in place.parts()]
    if not all(_is_packed(place.root / name, name, packed) for name in names):
        raise StoreError(
            f"{place.root}: has remains of a study without a plan;"
            f' "sweep rm {study}" deletes the remains; --as NAME loads the study under'
            " another name"
        )


def _is_packed(place: Location, name: str, packed: PackedFile) -> bool:
    """Return whether a stored file is in the packed file, with equal content."""
    member = f"{STUDY}/{name}"
    if member not in packed.sums:
        return False
    try:
        with open_stored(place) as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:  # a folder, or a foreign file
        return False
    return digest == packed.sums[member]


def _fill(place: StudyPlace, packed: PackedFile) -> tuple[str, bool]:
    """Store the study of a file in a place that is empty or has some of the files.

    Return the name of the study in the run, and whether custom code computed trials.
    After an error the place is empty if the place had no parts before.
    """
    parts_before = {part.name for part in place.parts()}
    try:
        with place.staging(f"packed-{secrets.token_hex(6)}") as staging:
            staged = staging / STUDY
            (staged / PARTS).mkdir(parents=True)
            for name in packed.names():
                (staged / name).parent.mkdir(exist_ok=True)
                with create(staged / name) as file:
                    packed.copy(f"{STUDY}/{name}", file)
            origin = _checked(staging, packed)
            for part in sorted((staged / PARTS).iterdir()):
                if part.name not in parts_before:
                    place.commit(part, part.name)
            files = [path for path in sorted(staged.iterdir()) if path.is_file()]
            # The plan is last: a study without a plan is not listed.
            for path in sorted(files, key=lambda path: path.name == PLAN):
                place.put(path)
            return origin
    except BaseException:
        if not parts_before:
            place.delete()
        raise


def _checked(staging: Path, packed: PackedFile) -> tuple[str, bool]:
    """Check a staged study, and return the two results of `_fill`.

    Raises StoreError if a run could not have written the files.
    """
    try:
        study = StoredStudy(STUDY, staging)
        for part in study.store.all_parts():
            if fault := damage(part):
                raise StoreError(f"{part}: {fault}")
        study.store.read_asked()
        trials = [*study.store.trial_ids()]
        earlier = [provenance for provenance, _ in origins(study.store, trials)]
        codes = codes_of([study.provenance, *earlier])
        return str(study.provenance.get("study", "")), bool(codes)
    except UserError as error:
        fault = str(error).replace(f"{staging}/", "")
        raise packed.error(f"has a study that no launch writes: {fault}") from error
