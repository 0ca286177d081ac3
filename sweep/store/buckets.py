"""A study in an object store.

An object store cannot rename an object, so a part exists once its manifest exists.

    parts/<part id>/trials.parquet, ...  uploaded first, in any state

    parts/<part id>/manifest.json        uploaded last: completes the part

    damaged/<part id>/                   copies of a part that could not be read

The store relies on two properties of the server (Amazon since 2020, MinIO, Ceph). An
upload replaces an object whole or not at all. Reads and listings after the end of an
upload show the new object. Then a crash between any two requests loses no stored trial.

- Tables without a manifest are orphans; their trials count as not run.
- A merged part lists the parts that it replaces. The list is uploaded before the
  manifest. Once the manifest exists, replaced parts are ignored, deleted or not.
- Deletion of a part starts with the manifest, so that its tables become orphans.
- A part that is set aside is copied first and then deleted.
- A manifest may exist although the upload was not confirmed. Then trials are stored
  twice, and the later part counts.
- A launch of the whole study deletes orphans one hour after the upload, by the clock
  of the server. By then no process can still be about to upload the manifest.

Parts are made in a local folder. One upload replaces a small file as a whole.
"""

import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pyarrow as pa

from sweep.errors import StoreError
from sweep.spec import DAMAGED, LOCK, PART_NAME, PARTS, PLAN, is_own
from sweep.store.folders import LEFTOVER_SECONDS
from sweep.store.locations import ListedObject, Location, ObjectPath, patiently
from sweep.store.lock_files import claim_text
from sweep.store.manifest import MANIFEST, READ_BYTES
from sweep.store.new_files import create

GRAVE_SECONDS = 48 * 3600.0
GRAVE = ".ended"


class Bucket:
    """Place of a study below the prefix `root` of an object store."""

    def __init__(self, root: ObjectPath) -> None:
        self.root = root
        self._parts = root / PARTS
        self.lock = LockObjects(root / LOCK)

    @contextmanager
    def staging(self, name: str) -> Iterator[Path]:
        """Make a new local folder, which is deleted afterwards.

        Raises StoreError if writing fails.
        """
        try:
            with tempfile.TemporaryDirectory(
                prefix=f"boidsweep-{name}-", ignore_cleanup_errors=True
            ) as folder:
                yield Path(folder)
        except OSError as error:
            raise StoreError(
                f"{self.root}: cannot write ({error}); what was stored is intact"
            ) from error

    def parts(self) -> list[Location]:
        """Return all parts that have a manifest, oldest first, with their objects.

        One request lists all parts.
        """
        listed = patiently(self._parts.listed)
        parts = [
            part
            for part in listed.iterdir()
            if PART_NAME.fullmatch(part.name) and (part / MANIFEST).exists()
        ]
        return [*sorted(parts, key=lambda part: part.name)]

    def commit(self, staged: Path, name: str) -> Location:
        """Upload a staged folder as a part, its manifest last.

        Parameters
        ----------
        staged : Path
            Local folder of the files of the part.
        name : str
            Id of the part.

        Returns
        -------
        Location
            Location of the part, with its objects as a listing returns them.
        """
        files = sorted(
            staged.iterdir(), key=lambda file: (file.name == MANIFEST, file.name)
        )
        for file in files:
            _upload(file, self._parts / name / file.name)
        now = time.time_ns()
        objects = {file.name: ListedObject(file.stat().st_size, now) for file in files}
        return ObjectPath(self.root.server, f"{self._parts.key}/{name}", objects)

    def put(self, staged: Path) -> None:
        """Upload a staged file, which replaces the file of this name in the study."""
        _upload(staged, self.root / staged.name)

    def remove(self, name: str) -> None:
        """Delete an object of the study, if it exists."""
        _delete(self.root / name)

    @contextmanager
    def fetched(self, parts: list[Location]) -> Iterator[list[Location]]:
        """Download parts into a local folder, where reads are fast, for the context."""
        with self.staging("fetched") as folder:
            for part in parts:
                (folder / part.name).mkdir()
                for source in part.iterdir():
                    _download(source, folder / part.name / source.name)
            yield [folder / part.name for part in parts]

    def discard(self, part: Location) -> None:
        """Delete a part: first the manifest, which ends the part, then the tables."""
        place = self._parts / part.name
        _delete(place / MANIFEST)
        _delete_below(place)

    def set_aside(self, part: Location) -> Location | None:
        """Copy a part below damaged/, then delete the original.

        Returns the new location; None if the part is gone.
        """
        place = self.root / DAMAGED / part.name
        sources: list[Location] = [*part.iterdir()]
        # Deletion of a part begins with its manifest: then no object is copied.
        sources.sort(key=lambda file: file.name != MANIFEST)
        try:
            for source in sources:
                _copy(source, place / source.name)
        except FileNotFoundError:
            return None
        self.discard(part)
        return place

    def tidy(self, *, alone: bool) -> None:
        """Delete old tables without a manifest and old graves of claims.

        Does nothing unless this launch works `alone` on the study.
        """
        if not alone:
            return
        study = patiently(self.root.listed)
        objects = study.objects or {}
        now = max((listed.st_mtime_ns for listed in objects.values()), default=0)
        for part in (study / PARTS).iterdir():
            is_part = (part / MANIFEST).exists() or not PART_NAME.fullmatch(part.name)
            if not is_part and _age(part.objects, now) > LEFTOVER_SECONDS:
                _delete_below(part)
        for grave in (study / LOCK).glob(f"*{GRAVE}"):
            if _age(grave.objects, now) > GRAVE_SECONDS:
                _delete(grave)

    def content(self) -> dict[str, int]:
        """Return the bytes of the study, without the lock, by first name below it."""
        sizes = Counter[str]()
        for key, listed in self._own().items():
            sizes[key.partition("/")[0]] += listed.st_size
        return dict(sorted(sizes.items()))

    def rename(self, target: ObjectPath) -> None:
        """Copy the study below the prefix `target`, its plan last, then delete it here.

        A study exists only with a plan. So at any time at least one of the two copies
        is a study. After a crash a repeated call resumes. Raises StoreError if further
        objects exist below `target`.
        """
        objects = self._own()
        foreign = [
            key
            for key, listed in Bucket(target)._own().items()
            if key not in objects or listed.st_size != objects[key].st_size
        ]
        if foreign:
            raise StoreError(f"{target}: exists already; choose another name")
        for key in sorted(objects, key=_place, reverse=True):
            path = ObjectPath(self.root.server, f"{self.root.key}/{key}")
            _copy(path, ObjectPath(target.server, f"{target.key}/{key}"))
        self.delete()

    def delete(self) -> None:
        """Delete the study, its plan first.

        The manifest of each part is deleted before the tables. The lock, and objects
        below the prefix that are not part of the study, stay.
        """
        for key in sorted(self._own(), key=_place):
            _delete(ObjectPath(self.root.server, f"{self.root.key}/{key}"))

    def left(self) -> list[str]:
        """Return the names below the prefix, without the lock.

        A prefix without objects does not exist.
        """
        listed = patiently(self.root.listed)
        return sorted(path.name for path in listed.iterdir() if path.name != LOCK)

    def _own(self) -> dict[str, ListedObject]:
        """Return the objects of the study by key below its prefix, without the lock."""
        objects = patiently(self.root.listed).objects or {}
        first = {key: key.partition("/")[0] for key in objects}
        return {
            key: listed
            for key, listed in objects.items()
            if is_own(first[key]) and first[key] != LOCK
        }


class LockObjects:
    """Claims as objects.

    An object store has no update that requires an existing object. So a process that
    deletes a claim first uploads a mark, the grave. A claim with a grave is void, even
    if a late upload creates the claim again. The owner of a claim checks for a grave
    after each of its changes.
    """

    def __init__(self, folder: ObjectPath) -> None:
        self._folder = folder
        self._text_written = ""

    def create(self, token: str, text: str) -> None:
        """Write a claim, by one upload.

        Parameters
        ----------
        token : str
            Token of the claim.
        text : str
            Content of the claim.
        """
        self._text_written = text
        _write(self._folder / f"{token}.json", text.encode())

    def _listed(self) -> tuple[set[str], set[str]]:
        """Return the tokens of claims, and the tokens of graves."""
        names = [path.name for path in self._folder.iterdir()]
        claims = {
            name.removesuffix(".json") for name in names if name.endswith(".json")
        }
        return claims, {
            name.removesuffix(GRAVE) for name in names if name.endswith(GRAVE)
        }

    def tokens(self) -> list[str]:
        """Return the tokens of claims without a grave, sorted."""
        claims, graves = self._listed()
        return sorted(claims - graves)

    def text(self, token: str) -> str | None:
        """Return the text of a claim; None if the object is gone."""
        return claim_text(self._folder / f"{token}.json")

    def update(self, token: str, text: str) -> bool:
        """Write the claim first, then check for a grave.

        So this call notices every grave that existed before the write.

        Parameters
        ----------
        token : str
            Token of the claim of this process.
        text : str
            New content of the claim.

        Returns
        -------
        bool
            False if the claim has a grave.
        """
        self.create(token, text)
        return token not in self._listed()[1]

    def touch(self, token: str) -> bool:
        """Write the claim again; return False if the claim is gone."""
        if token not in self.tokens():
            return False
        _write(self._folder / f"{token}.json", self._text_written.encode())
        return True

    def touched(self, token: str) -> int | None:
        """Return when the claim was last written, in ns by the server's clock.

        Returns None if the claim is gone.
        """
        try:
            return (self._folder / f"{token}.json").stat().st_mtime_ns
        except FileNotFoundError:
            return None

    def evict(self, token: str) -> None:
        """Upload a grave, which stays valid after later writes; delete the claim."""
        _write(self._folder / f"{token}{GRAVE}", b"")
        _delete(self._folder / f"{token}.json")

    def withdraw(self, token: str) -> None:
        """Delete the claim of this process.

        If the server does not answer, the claim stays. Other processes notice that the
        owner is dead, or that the claim is no longer touched.
        """
        with suppress(StoreError, FileNotFoundError):
            path = self._folder / f"{token}.json"
            path.server.ask(path, lambda files: files.delete_file(path.key))


def _place(key: str) -> tuple[bool, bool, str]:
    """Return the sort key of an object of a study.

    The plan is first, then come manifests, then tables.
    """
    return key != PLAN, key.rpartition("/")[2] != MANIFEST, key


def _age(objects: Mapping[str, ListedObject] | None, now: int) -> float:
    """Return the seconds since the newest object was written."""
    times = (listed.st_mtime_ns for listed in (objects or {}).values())
    return (now - max(times, default=now)) / 1e9


def _upload(file: Path, path: ObjectPath) -> None:
    with pa.memory_map(str(file)) as content:
        data = content.read_buffer()
        patiently(lambda: _write(path, data))


def _write(path: ObjectPath, data: Any) -> None:
    def write(files: Any) -> None:
        with files.open_output_stream(path.key) as stream:
            stream.write(data)

    path.server.ask(path, write)


def _download(path: ObjectPath | Path, file: Path) -> None:
    assert isinstance(path, ObjectPath)
    size = path.stat().st_size
    content = patiently(
        lambda: path.server.ask(
            path, lambda files: _read(files.open_input_stream(path.key), size + 1)
        )
    )
    if len(content) != size:
        raise StoreError(
            f"{path}: does not have the {size:,} bytes that the server listed;"
            " the object is not used"
        )
    with create(file) as new:
        new.write(content)


def _read(stream: Any, most: int) -> bytes:
    """Return the bytes of a stream, at most `most` bytes.

    Memory is allocated as bytes arrive, not for the announced size.
    """
    content = bytearray()
    while arrived := stream.read(min(READ_BYTES, most - len(content))):
        content += arrived
    return bytes(content)


def _copy(path: Location, target: ObjectPath) -> None:
    assert isinstance(path, ObjectPath)
    key = path.key
    patiently(
        lambda: target.server.ask(
            target, lambda files: files.copy_file(key, target.key)
        )
    )


def _delete(path: ObjectPath) -> None:
    with suppress(FileNotFoundError):
        patiently(
            lambda: path.server.ask(path, lambda files: files.delete_file(path.key))
        )


def _delete_below(path: ObjectPath) -> None:
    with suppress(FileNotFoundError):
        patiently(
            lambda: path.server.ask(path, lambda files: files.delete_dir(path.key))
        )
