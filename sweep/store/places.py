"""Interface of the place of a study: a folder, or a prefix of an object store.

Both keep the same promises: a part exists whole or not at all, a small file is the old
one or the new one, and a process that is killed between any two steps loses and doubles
nothing. `folders.py` and `buckets.py` say how.
"""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any, Protocol

from sweep.store.buckets import Bucket
from sweep.store.folders import Folder
from sweep.store.locations import Location, ObjectPath
from sweep.store.lock_files import Claims


class StudyPlace(Protocol):
    """Place of a study.

    Its methods raise StoreError if it cannot be read or written.
    """

    @property
    def root(self) -> Location:
        """Folder or prefix of everything of the study."""

    @property
    def lock(self) -> Claims:
        """Claims of those who are launching the study."""

    def staging(self, name: str) -> AbstractContextManager[Path]:
        """Make a new local folder for making a part or a file; deleted afterwards."""

    def parts(self) -> list[Location]:
        """Return all parts, oldest first."""

    def commit(self, staged: Path, name: str) -> Location:
        """Turn a staged folder into a part, in one step, and return its place.

        Parameters
        ----------
        staged : Path
            Folder of the files of the part.
        name : str
            Id of the part.
        """

    def put(self, staged: Path) -> None:
        """Turn a staged file into that of the same name in the study, in one step."""

    def remove(self, name: str) -> None:
        """Delete a file of the study, if it exists."""

    def fetched(self, parts: list[Location]) -> AbstractContextManager[list[Location]]:
        """Give the parts where they can be read often and fast."""

    def discard(self, part: Location) -> None:
        """Delete a part, in one step."""

    def set_aside(self, part: Location) -> Location | None:
        """Move a part below damaged/.

        Returns its new place; None if it is gone.
        """

    def tidy(self, *, alone: bool) -> None:
        """Delete what dead processes were writing.

        If `alone`, nobody else is at work on the study.
        """

    def content(self) -> dict[str, int]:
        """Return the bytes of the study, by name; not of its lock."""

    def rename(self, target: Any) -> None:
        """Make it the study in the place `target`, of the same kind.

        At no moment is there half a study, and it is never in neither place. Raises
        StoreError if something is there already.
        """

    def delete(self) -> None:
        """Delete the study, its plan first; its lock and everything else stay."""

    def left(self) -> list[str]:
        """Return the names that remain, once the study is gone and its lock."""


def place_of(root: Location, results: Location) -> StudyPlace:
    """Return the place of a study below `results`, which the user has named."""
    if isinstance(root, ObjectPath):
        return Bucket(root)
    assert isinstance(results, Path)
    return Folder(root, results)
