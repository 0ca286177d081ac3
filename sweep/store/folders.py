"""A study in a folder of a file system.

New files are written next to their place, flushed to the disk and renamed.

    <study>/parts/<part id>/                a part
    <study>/writing/<here>~<pid>~<name>/    what a process is writing, or left behind
    <study>/damaged/<part id>/              a part that could not be read

A rename within a file system happens whole or not at all, whatever crashes. With a
flush before and after, it also survives a loss of power. Below the results, the folder
that the user has named, nothing is written through symbolic links. This is checked
before each write, so it does not help against somebody who changes these folders at the
same moment.
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
"""Age, by the clock of the place, from which nobody resumes an unfinished file."""


class Folder:
    """Place of a study in the folder `root`, which may be made by the first write.

    `results` is the folder above it that the user has named.
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
        """Turn a staged folder into a part, in one step, and return its place.

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
        """Turn a staged file into that of the same name in the study, in one step."""
        move_durably(staged, self.root / staged.name)

    def remove(self, name: str) -> None:
        """Delete a file of the study, if it exists; the disk holds that it is gone."""
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
        """Give the parts where they can be read often and fast: where they are."""
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

        Returns its new place; None if it is gone.
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
        """Delete what dead processes were writing, and flush what they had stored.

        On this machine a process that has ended is dead. Files of another machine, or
        of this one before it was restarted, are deleted after LEFTOVER_SECONDS, and
        only if this launch works `alone` on the study. A process may have died before
        it flushed the last part that it stored: this part is flushed now.
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
        """Return the bytes of the study in its folder, by name, without its lock."""
        if self.root.is_symlink() or not self.root.is_dir():
            return {}
        with os.scandir(self.root) as entries:
            names = {entry.name for entry in entries if is_own(entry.name)} - {LOCK}
        return {name: _bytes(self.root / name) for name in sorted(names)}

    def rename(self, target: Path) -> None:
        """Move the whole folder to `target`, which may not exist, in one step.

        Everything else in the folder moves with it. Raises StoreError, also if another
        study is within.
        """
        for path in (self.root, target):
            refuse_links(path, self._results)
        if target.exists():
            raise StoreError(f"{target}: exists already; choose another name")
        if self.root in target.parents:
            raise StoreError(f"{target}: lies within {self.root}; choose another name")
        if inner := studies_below(self.root, "*/**/"):
            raise StoreError(
                f"{self.root / inner[0]}: is another study, within {self.root};"
                " rename that first"
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

        Its lock and everything else in the folder stay. Raises StoreError.
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
                    " mend that, and remove the study again"
                ) from error

    def left(self) -> list[str]:
        """Return the names in the folder, which is removed if it is empty.

        Folders above it that held nothing else are removed too.
        """
        self._without_empty_folders()
        if not self.root.is_dir():
            return []
        return sorted(path.name for path in self.root.iterdir())

    def _without_empty_folders(self) -> None:
        above = self.root.parents
        for folder in (self.root, *above[: [*above].index(self._results)]):
            with suppress(OSError):  # it is not empty, or not there
                folder.rmdir()

    def _is_old(self, folder: Path) -> bool:
        """Return whether nothing has appeared in a folder for LEFTOVER_SECONDS.

        Time is that of the clock of the place.
        """
        with self.staging("clock") as fresh:
            try:
                return fresh.stat().st_mtime - folder.stat().st_mtime > LEFTOVER_SECONDS
            except FileNotFoundError:  # its owner has just finished
                return False


def refuse_links(folder: Path, results: Path) -> None:
    """Raise StoreError if a study's folder, or anything we write in it, is a link.

    That holds for the folders between it and `results` too, and not for `results`.
    """
    way = (
        results / Path(*names)
        for names in accumulate(zip(folder.relative_to(results).parts))
    )
    for path in (*way, *(folder / name for name in STORED)):
        if path.is_symlink():
            raise _not_followed(path)


def _bytes(path: Path) -> int:
    """Return the bytes of a file, or of all files below a folder; none of a link."""
    total = 0
    for file in () if path.is_symlink() else (path, *path.rglob("*")):
        with suppress(FileNotFoundError):  # a launch has just deleted it
            total += file.lstat().st_size if file.is_file() else 0
    return total


def _not_followed(path: Path) -> StoreError:
    way_out = (
        "put the folder itself there,"
        " or link the whole results folder and name that by --results"
    )
    return StoreError(
        f"{path}: is a symbolic link;"
        f" nothing is read or written outside of the results: {way_out}"
    )


def _folders(folder: Path, names: re.Pattern[str]) -> list[Path]:
    """Return our own sub-folders, by name; anything else in the folder is left alone.

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
