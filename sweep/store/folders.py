"""A study in a folder of a file system.

New files are written into a folder of their process, flushed to the disk and renamed.

    <study>/parts/<part id>/                a part
    <study>/writing/<here>~<pid>~<name>/    unfinished files of a process
    <study>/damaged/<part id>/              a part that could not be read

A rename within a file system happens whole or not at all, even in a crash. With a flush
before and after, a rename also survives a loss of power.

Below the results folder that the user has named, the store does not write through
symbolic links. The check runs before each write. So the check does not protect against
a process that changes these folders at the same moment.
"""

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import accumulate
from pathlib import Path

from sweep.errors import StoreError
from sweep.spec import (
    DAMAGED,
    LOCK,
    PART_NAME,
    PARTS,
    PLAN,
    STORED,
    WRITING,
    is_own,
    studies_below,
)
from sweep.store.durable import flush_to_disk, make_folders, move_durably
from sweep.store.locations import Location
from sweep.store.lock_files import LockFiles
from sweep.store.processes import here, started

STAGED_NAME = re.compile(r"[^~]+~[0-9]+~.+")
LEFTOVER_SECONDS = 3600.0
"""Age, by the clock of the file system or server, of unfinished files to delete."""


class Folder:
    """Place of a study in the folder `root`, which the first write makes if needed.

    `results` is the folder above `root` that the user has named.
    """

    def __init__(self, root: Path, results: Path) -> None:
        self.root = root
        self._results = results
        self._parts = root / PARTS
        self._writing = root / WRITING
        self.lock = LockFiles(root / LOCK, self.staging)

    @contextmanager
    def staging(self, name: str) -> Iterator[Path]:
        """Make a new folder in writing/, which is deleted afterwards.

        Raises StoreError if writing fails.
        """
        staging = self._writing / f"{here()}~{os.getpid()}~{name}"
        refuse_links(self.root, self._results)
        try:
            make_folders(self._parts)
            make_folders(self._writing)
            staging.mkdir()
            yield staging
        except OSError as error:
            raise self._unwritable(error) from error
        finally:
            shutil.rmtree(staging, ignore_errors=True)

    def _flush(self, folder: Path) -> None:
        try:
            flush_to_disk(folder)
        except OSError as error:
            raise self._unwritable(error) from error

    def _unwritable(self, error: OSError) -> StoreError:
        return StoreError(
            f"{self.root}: cannot write ({error}); what was stored is intact"
        )

    def parts(self) -> list[Location]:
        """Return the folders of all parts, oldest first.

        Raises StoreError for a link.
        """
        return [*_folders(self._parts, PART_NAME)]

    def commit(self, staged: Path, name: str) -> Location:
        """Turn a staged folder into a part, in one step, and return its location.

        Parameters
        ----------
        staged : Path
            Folder of the files of the part.
        name : str
            Id of the part.

        Returns
        -------
        Location
        """
        part = self._parts / name
        move_durably(staged, part)
        return part

    def put(self, staged: Path) -> None:
        """Move a staged file into the study, in one step, and replace an older file."""
        move_durably(staged, self.root / staged.name)

    def remove(self, name: str) -> None:
        """Delete a file of the study, if it exists, and flush the folder."""
        try:
            (self.root / name).unlink()
            flush_to_disk(self.root)
        except FileNotFoundError:
            return
        except OSError as error:
            raise StoreError(
                f"{self.root / name}: cannot be deleted ({error.strerror})"
            ) from error

    @contextmanager
    def fetched(self, parts: list[Location]) -> Iterator[list[Location]]:
        """Yield the parts themselves: reads of a file system are fast."""
        yield parts

    def discard(self, part: Location) -> None:
        """Delete a part, in one step."""
        with (
            self.staging(f"{part.name}-discarded") as staging,
            suppress(FileNotFoundError),
        ):
            (self._parts / part.name).rename(staging / part.name)

    def set_aside(self, part: Location) -> Location | None:
        """Move a part below damaged/.

        Returns the new location; None if the part is gone.
        """
        refuse_links(self.root, self._results)
        source = self._parts / part.name
        place = self.root / DAMAGED / part.name
        try:
            make_folders(place.parent)
            source.rename(place)
        except OSError as error:
            if not source.exists():
                return None
            raise StoreError(
                f"{part}: is damaged, and cannot be set aside as {place} ({error})"
            ) from error
        self._flush(place.parent)
        return place

    def tidy(self, *, alone: bool) -> None:
        """Delete unfinished files of dead processes, and flush their stored parts.

        A process of this machine is dead if it has ended. Files of another machine, or
        of this machine before a restart, are deleted after LEFTOVER_SECONDS, and only
        if this launch works `alone` on the study. A process may have died before the
        last part was flushed: this call flushes the part.
        """
        if self._parts.is_dir():
            self._flush(self._parts)
        for folder in _folders(self._writing, STAGED_NAME):
            owner, process = folder.name.split("~")[:2]
            dead = (
                started(int(process)) is None
                if owner == here()
                else alone and self._is_old(folder)
            )
            if dead:
                shutil.rmtree(folder, ignore_errors=True)

    def content(self) -> dict[str, int]:
        """Return the bytes of the study by name in its folder, without the lock."""
        if self.root.is_symlink() or not self.root.is_dir():
            return {}
        with os.scandir(self.root) as entries:
            names = {entry.name for entry in entries if is_own(entry.name)} - {LOCK}
        return {name: _bytes(self.root / name) for name in sorted(names)}

    def rename(self, target: Path) -> None:
        """Move the whole folder to `target`, which may not exist, in one step.

        All files in the folder move, including files of the user. Raises StoreError,
        also if the folder contains another study.
        """
        for path in (self.root, target):
            refuse_links(path, self._results)
        if target.exists():
            raise StoreError(f"{target}: exists already; choose another name")
        if self.root in target.parents:
            raise StoreError(f"{target}: is inside {self.root}; choose another name")
        if inner := studies_below(self.root, "*/**/"):
            raise StoreError(
                f"{self.root / inner[0]}: is another study, inside {self.root};"
                " rename that study first"
            )
        try:
            make_folders(target.parent)
            self.root.rename(target)
        except OSError as error:
            raise StoreError(
                f"{self.root}: cannot be renamed to {target}"
                f" ({error.strerror or error}); nothing has changed"
            ) from error
        self._flush(target.parent)
        self._flush(self.root.parent)
        self._without_empty_folders()

    def delete(self) -> None:
        """Delete the study, its plan first and each part in one step.

        The lock, and files that are not part of the study, stay. Raises StoreError.
        """
        refuse_links(self.root, self._results)
        self.remove(PLAN)
        for part in self.parts():
            self.discard(part)
        for name in self.content():
            path = self.root / name
            try:
                if path.is_dir() and not path.is_symlink():
                    shutil.rmtree(path)
                else:
                    path.unlink(missing_ok=True)
            except OSError as error:
                raise StoreError(
                    f"{path}: cannot be deleted ({error.strerror or error});"
                    " fix the cause, then remove the study again"
                ) from error

    def left(self) -> list[str]:
        """Return the names in the folder; remove an empty folder.

        Parents that are empty afterwards are removed too.
        """
        self._without_empty_folders()
        if not self.root.is_dir():
            return []
        return sorted(path.name for path in self.root.iterdir())

    def _without_empty_folders(self) -> None:
        above = self.root.parents
        for folder in (self.root, *above[: [*above].index(self._results)]):
            with suppress(OSError):  # the folder is not empty, or does not exist
                folder.rmdir()

    def _is_old(self, folder: Path) -> bool:
        """Return whether a folder has had no new name for LEFTOVER_SECONDS.

        The clock of the file system counts.
        """
        with self.staging("clock") as fresh:
            try:
                return fresh.stat().st_mtime - folder.stat().st_mtime > LEFTOVER_SECONDS
            except FileNotFoundError:  # its owner has just finished
                return False


def refuse_links(folder: Path, results: Path) -> None:
    """Raise StoreError if a study's folder, or a file to be written in it, is a link.

    Folders between `results` and the study may not be links. `results` may be a link.
    """
    way = (
        results / Path(*names)
        for names in accumulate(zip(folder.relative_to(results).parts))
    )
    for path in (*way, *(folder / name for name in STORED)):
        if path.is_symlink():
            raise _not_followed(path)


def _bytes(path: Path) -> int:
    """Return the bytes of a file, or of all files below a folder; 0 for a link."""
    total = 0
    for file in () if path.is_symlink() else (path, *path.rglob("*")):
        with suppress(FileNotFoundError):  # a launch has just deleted the file
            total += file.lstat().st_size if file.is_file() else 0
    return total


def _not_followed(path: Path) -> StoreError:
    way_out = (
        "put the folder itself there,"
        " or link the whole results folder and give that link as --results"
    )
    return StoreError(
        f"{path}: is a symbolic link;"
        f" nothing is read or written outside of the results: {way_out}"
    )


def _folders(folder: Path, names: re.Pattern[str]) -> list[Path]:
    """Return the sub-folders whose names match `names`, sorted by name.

    Raises StoreError for a link.
    """
    if folder.is_symlink():
        raise _not_followed(folder)
    if not folder.is_dir():
        return []
    with os.scandir(folder) as entries:
        named = [entry for entry in entries if names.fullmatch(entry.name)]
        for entry in named:
            if entry.is_symlink():
                raise _not_followed(folder / entry.name)
        return sorted(folder / entry.name for entry in named if entry.is_dir())
