"""Files of the claims on a study.

Each is written by its owner alone, who touches it as a sign of life.
"""

import os
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from pathlib import Path
from typing import Protocol

from sweep.store.locations import Location
from sweep.store.new_files import create
from sweep.store.regular import open_regular, read_whole

MOST_CLAIM = 100_000
"""Most bytes of a claim that are read; one of ours has a hundredth of that."""


class Claims(Protocol):
    """Calls that `lock.py` makes of a place, with claims by their token.

    They raise OSError or StoreError if the place fails.
    """

    def create(self, token: str, text: str) -> None:
        """Write a claim, whole; whoever lists the claims from now on sees it.

        Parameters
        ----------
        token : str
            Token of the claim.
        text : str
            Content of the claim.
        """

    def tokens(self) -> list[str]:
        """Return the tokens of all claims."""

    def text(self, token: str) -> str | None:
        """Return the content of a claim; None if it is gone."""

    def update(self, token: str, text: str) -> bool:
        """Change the content of one's own claim.

        Parameters
        ----------
        token : str
            Token of the own claim.
        text : str
            New content, as long as the old one.

        Returns
        -------
        bool
            False if somebody has taken the claim away.
        """

    def touch(self, token: str) -> bool:
        """Give the own claim the present time; False if somebody has deleted it."""

    def touched(self, token: str) -> int | None:
        """Return when a claim was last touched, in ns by the place's clock.

        None if it is gone.
        """

    def evict(self, token: str) -> None:
        """Take a dead owner's claim away."""

    def withdraw(self, token: str) -> None:
        """Take one's own claim away."""


def claim_text(path: Location) -> str | None:
    """Return the text of a claim; None if it is gone, "" if it is no file of ours."""
    try:
        return read_whole(path, MOST_CLAIM).decode(errors="replace")
    except FileNotFoundError:
        return None
    except OSError:
        return ""


class LockFiles:
    """Claims as files of a folder.

    An owner never creates its claim again after it was deleted.
    """

    def __init__(
        self, folder: Path, staging: Callable[[str], AbstractContextManager[Path]]
    ) -> None:
        self._folder = folder
        self._staging = staging

    def _file(self, token: str) -> Path:
        return self._folder / f"{token}.json"

    def create(self, token: str, text: str) -> None:
        """Write the claim under another name and rename it.

        So it is never seen half written.

        Parameters
        ----------
        token : str
            Token of the claim.
        text : str
            Content of the claim.
        """
        with self._staging(f"lock-{token}") as staging:
            new = staging / self._file(token).name
            with create(new) as file:
                file.write(text.encode())
            while new.exists():
                self._folder.mkdir(exist_ok=True)
                # Whoever was the last to leave may just have removed the folder.
                with suppress(FileNotFoundError):
                    new.rename(self._file(token))

    def tokens(self) -> list[str]:
        """Return the tokens of all claims, sorted."""
        try:
            return sorted(
                file.stem for file in self._folder.iterdir() if file.suffix == ".json"
            )
        except FileNotFoundError:
            return []

    def text(self, token: str) -> str | None:
        """Return the content of a claim; None if the file is gone."""
        return claim_text(self._file(token))

    def update(self, token: str, text: str) -> bool:
        """Write into the existing file: a rename could bring back a deleted one.

        Parameters
        ----------
        token : str
            Token of the own claim.
        text : str
            New content, as long as the old one.

        Returns
        -------
        bool
            False if the file is gone.
        """
        try:
            with open_regular(self._file(token), os.O_RDWR) as file:
                file.write(text.encode())
        except FileNotFoundError:
            return False
        return self._file(token).exists()

    def touch(self, token: str) -> bool:
        """Give the file the present time.

        Returns False if it is gone: who deleted it has taken the study over.
        """
        try:
            os.utime(self._file(token))
        except FileNotFoundError:
            return False
        return True

    def touched(self, token: str) -> int | None:
        """Return when the file was last touched, in ns by the place's clock.

        None if it is gone. The file is opened first: network file systems otherwise
        answer with an old time.
        """
        try:
            with open_regular(self._file(token)) as file:
                return os.fstat(file.fileno()).st_mtime_ns
        except FileNotFoundError:
            return None
        except OSError:  # no file of ours
            with suppress(FileNotFoundError):
                return self._file(token).lstat().st_mtime_ns
            return None

    def evict(self, token: str) -> None:
        """Delete the claim by its own name.

        So it is never the claim of somebody who was quicker.
        """
        self._file(token).unlink(missing_ok=True)

    def withdraw(self, token: str) -> None:
        """Delete the own claim; the last to leave removes the folder."""
        with suppress(OSError):
            self._file(token).unlink(missing_ok=True)
            self._folder.rmdir()
