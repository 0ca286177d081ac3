"""What a store asks of the place where a study lives, be it a folder or below a prefix
of an object store.

Either keeps the same promises: a part is there whole or not at all, a small file is the
old one or the new one, and whoever is killed between any two steps has lost and doubled
nothing. `folders.py` and `buckets.py` say how.
"""

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Protocol

from sweep.store.buckets import Bucket
from sweep.store.folders import Folder
from sweep.store.locations import Location, ObjectPath
from sweep.store.lock_files import Claims


class StudyPlace(Protocol):
    """Where a study lives. Raises StoreError where it cannot be read or written."""

    @property
    def root(self) -> Location:
        """All of it is below this."""

    @property
    def lock(self) -> Claims:
        """Who is launching the study."""

    def staging(self, name: str) -> AbstractContextManager[Path]:
        """A new local folder for making a part or a file; deleted afterwards."""

    def parts(self) -> list[Location]:
        """All parts, oldest first."""

    def commit(self, staged: Path, name: str) -> Location:
        """Make a folder in staging a part, at once and whole, and return its place."""

    def put(self, staged: Path) -> None:
        """Make a file in staging that of the same name in the study, in one step."""

    def remove(self, name: str) -> None:
        """Delete a file of the study, if it is there."""

    def fetched(self, parts: list[Location]) -> AbstractContextManager[list[Location]]:
        """The parts where they can be read often and fast."""

    def discard(self, part: Location) -> None:
        """Delete a part; it is gone at once and whole."""

    def set_aside(self, part: Location) -> Location | None:
        """Move a part below damaged/. Returns its new place; None if it is gone."""

    def tidy(self, *, whole: bool) -> None:
        """Delete what dead processes were writing; with `whole`, nobody else is at work
        on the study.
        """


def place_of(root: Location, results: Location) -> StudyPlace:
    """The place of a study below `results`, which the user has named."""
    if isinstance(root, ObjectPath):
        return Bucket(root)
    assert isinstance(results, Path)
    return Folder(root, results)
