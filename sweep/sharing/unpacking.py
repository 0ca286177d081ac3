"""A study again from its packed file, of which everything was checked before."""

import hashlib
import secrets
from dataclasses import dataclass
from pathlib import Path

from sweep.errors import ChoiceError, StoreError, UserError
from sweep.sharing.packed_file import CRATE, MOST_CRATE, STUDY, PackedFile
from sweep.spec.study_folder import PARTS, PLAN, WRITING, why_no_name
from sweep.store.locations import Location
from sweep.store.lock import Lock
from sweep.store.manifest import MANIFEST, damage
from sweep.store.new_files import create
from sweep.store.places import StudyPlace, place_of
from sweep.store.regular import open_stored, parsed
from sweep.store.stored_code import codes_of
from sweep.tables.stored_study import StoredStudy
from sweep.tables.stored_trials import origins


@dataclass(frozen=True)
class LoadedFile:
    """A study that was loaded: its name, its place, the name under which its spec was
    launched, and whether trials of it were computed by code of its own.
    """

    study: str
    place: Location
    launched_as: str
    own_code: bool


def unpack(path: Path, results: Location, name: str | None = None) -> LoadedFile:
    """Make a study of a file that `pack` has written, below `results`, as `name` or as
    it was called when it was packed.

    Its parts, code, spec and plan are those that were packed, to the byte. Nothing is
    written before every checksum of the file is right, and nothing counts before all is
    there: the plan comes last. Where this was killed, the same call goes on. No code of
    it runs. Raises StoreError for a file that is
    none of these, that is damaged, or whose study no launch writes, and where there is
    such a study already; ChoiceError for what is no name of a study.
    """
    with PackedFile(path) as packed:
        study = name or _packed_name(packed)
        if why := why_no_name(study):
            raise ChoiceError(f"{why}; --as gives it another one")
        place = place_of(results / study, results)
        _refuse_others(place, study, packed)
        try:
            with Lock(place):
                place.tidy(whole=True)
                # Somebody may have launched it, and ended, while we waited.
                _refuse_others(place, study, packed)
                about = _fill(place, packed)
        except BaseException:
            place.left()
            raise
    return LoadedFile(study, place.root, *about)


def _packed_name(packed: PackedFile) -> str:
    """The name of the study when it was packed. Raises StoreError."""
    try:
        graph = parsed(packed.read(CRATE, MOST_CRATE), {"@graph": [{}]})["@graph"]
        (name,) = (one["name"] for one in graph if one.get("@id") == "./")
        if not isinstance(name, str):
            raise ValueError("a name is a text")
    except (ValueError, KeyError):
        raise packed.error(f"{CRATE} does not say what the study is called") from None
    return name


def _refuse_others(place: StudyPlace, study: str, packed: PackedFile) -> None:
    """Raise StoreError where something is in the place that is not in the file: what is
    in both was loaded by a process that was killed.
    """
    content = place.content()
    if PLAN in content:
        raise StoreError(
            f"{place.root}: exists already; --as NAME loads it under another name"
        )
    names = [name for name in content if name not in (PARTS, WRITING)]
    names += [f"{PARTS}/{part.name}/{MANIFEST}" for part in place.parts()]
    if not all(_is_packed(place.root / name, name, packed) for name in names):
        raise StoreError(
            f"{place.root}: holds what is left of a study without a plan;"
            f' "sweep rm {study}" removes it, --as NAME loads under another name'
        )


def _is_packed(place: Location, name: str, packed: PackedFile) -> bool:
    """Whether a stored file is in the packed one too, with the same content."""
    member = f"{STUDY}/{name}"
    if member not in packed.sums:
        return False
    try:
        with open_stored(place) as file:
            found = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError:  # it is a folder, or none of ours
        return False
    return found == packed.sums[member]


def _fill(place: StudyPlace, packed: PackedFile) -> tuple[str, bool]:
    """Store the study of a file in a place that has nothing, or a part of it. Returns
    the name under which it was launched, and whether it has code of its own. After an
    error the place is empty if it was so before.
    """
    there = {part.name for part in place.parts()}
    try:
        with place.staging(f"packed-{secrets.token_hex(6)}") as staging:
            staged = staging / STUDY
            (staged / PARTS).mkdir(parents=True)
            for name in packed.names():
                (staged / name).parent.mkdir(exist_ok=True)
                with create(staged / name) as file:
                    packed.copy(f"{STUDY}/{name}", file)
            about = _checked(staging, packed)
            for part in sorted((staged / PARTS).iterdir()):
                if part.name not in there:
                    place.commit(part, part.name)
            files = [one for one in sorted(staged.iterdir()) if one.is_file()]
            for file_of in sorted(files, key=lambda one: one.name == PLAN):
                place.put(file_of)
            return about
    except BaseException:
        if not there:
            place.delete()
        raise


def _checked(staging: Path, packed: PackedFile) -> tuple[str, bool]:
    """The same of the study in a folder, which a launch could have written. Raises
    StoreError where it could not.
    """
    try:
        study = StoredStudy(STUDY, staging)
        for part in study.store.all_parts():
            if what := damage(part):
                raise StoreError(f"{part}: {what}")
        study.store.read_asked()
        trials = [*study.store.trial_ids()]
        used = [study.provenance, *(about for about, _ in origins(study.store, trials))]
        return str(study.provenance.get("study", "")), bool(codes_of(used))
    except UserError as error:
        said = str(error).replace(f"{staging}/", "")
        raise packed.error(f"holds no study that a launch writes: {said}") from error
