"""Interface of the place of a study: a folder, or a prefix of an object store.

Each place keeps three promises, which `folders.py` and `buckets.py` describe:

- A part exists as a whole or not at all.
- A small file has the old content or the new content.
- A process that is killed between any two steps loses no trial and doubles no trial.
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

    The methods raise StoreError if the place cannot be read or written.
    """

    @property
    def root(self) -> Location:
        """Folder or prefix of all files of the study."""

    @property
    def lock(self) -> Claims:
        """Claims of the launches of the study."""

    def staging(self, name: str) -> AbstractContextManager[Path]:
        """Make a new local folder for a part or a file; deleted afterwards."""

    def parts(self) -> list[Location]:
        """Return all parts, oldest first."""

    def commit(self, staged: Path, name: str) -> Location:
        """Turn a staged folder into a part, in one step, and return its location.

        Parameters
        ----------
        staged : Path
            Folder of the files of the part.
        name : str
            Id of the part.
        """

    def put(self, staged: Path) -> None:
        """Move a staged file into the study, in one step, and replace an older file."""

    def remove(self, name: str) -> None:
        """Delete a file of the study, if it exists."""

    def fetched(self, parts: list[Location]) -> AbstractContextManager[list[Location]]:
        """Yield copies or originals of the parts, where reads are fast."""

    def discard(self, part: Location) -> None:
        """Delete a part, in one step."""

    def set_aside(self, part: Location) -> Location | None:
        """Move a part below damaged/.

        Returns the new location; None if the part is gone.
        """

    def tidy(self, *, alone: bool) -> None:
        """Delete unfinished files of dead processes.

        If `alone`, no other launch works on the study.
        """

    def content(self) -> dict[str, int]:
        """Return the bytes of the study by name, without the lock."""

    def rename(self, target: Any) -> None:
        """Move the study to the location `target`, of the same kind.

        At any time a whole study exists at the old or the new location. Raises
        StoreError if `target` exists already.
        """

    def delete(self) -> None:
        """Delete the study, its plan first; the lock and further files stay."""

    def left(self) -> list[str]:
        """Return the names that remain after deletion of the study and its lock."""


def place_of(root: Location, results: Location) -> StudyPlace:
    """Return the place of a study below `results`, which the user has named."""
    if isinstance(root, ObjectPath):
        return Bucket(root)
    assert isinstance(results, Path)
    return Folder(root, results)
