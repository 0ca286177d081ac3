"""Files of the claims on a study.

Only the owner of a claim writes and touches the file.
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
"""Most bytes of a claim that are read; a launch writes a hundredth of this size."""


class Claims(Protocol):
    """Interface of claims that `lock.py` uses; a claim is named by its token.

    The methods raise OSError or StoreError if the file system or server fails.
    """

    def create(self, token: str, text: str) -> None:
        """Write a claim as a whole, so that every later listing shows the claim.

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
        """Return the content of a claim; None if the claim is gone."""

    def update(self, token: str, text: str) -> bool:
        """Change the content of a claim of this process.

        Parameters
        ----------
        token : str
            Token of the claim.
        text : str
            New content, as long as the old content.

        Returns
        -------
        bool
            False if another process has deleted the claim.
        """

    def touch(self, token: str) -> bool:
        """Give a claim of this process the present time; False if it is deleted."""

    def touched(self, token: str) -> int | None:
        """Return when a claim was last touched, in ns by the location's clock.

        Returns None if the claim is gone.
        """

    def evict(self, token: str) -> None:
        """Delete the claim of a dead owner."""

    def withdraw(self, token: str) -> None:
        """Delete a claim of this process."""


def claim_text(path: Location) -> str | None:
    """Return the text of a claim; None if it is gone, "" if it cannot be read."""
    try:
        return read_whole(path, MOST_CLAIM).decode(errors="replace")
    except FileNotFoundError:
        return None
    except OSError:
        return ""


class LockFiles:
    """Claims as files of a folder.

    An owner never creates a deleted claim again.
    """

    def __init__(
        self, folder: Path, staging: Callable[[str], AbstractContextManager[Path]]
    ) -> None:
        self._folder = folder
        self._staging = staging

    def _file(self, token: str) -> Path:
        return self._folder / f"{token}.json"

    def create(self, token: str, text: str) -> None:
        """Write the claim under another name, then rename the file.

        So no process reads an incomplete claim.

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
                # The last owner to leave may just have removed the folder.
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
        """Return the content of a claim; None if the file does not exist."""
        return claim_text(self._file(token))

    def update(self, token: str, text: str) -> bool:
        """Write into the existing file: a rename could restore a deleted claim.

        Parameters
        ----------
        token : str
            Token of the claim.
        text : str
            New content, as long as the old content.

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

        Returns False if the file is gone: another launch has taken the study over.
        """
        try:
            os.utime(self._file(token))
        except FileNotFoundError:
            return False
        return True

    def touched(self, token: str) -> int | None:
        """Return when the file was last touched, in ns by the file system's clock.

        Returns None if the file is gone. The file is opened first: network file systems
        otherwise answer with an old time.
        """
        try:
            with open_regular(self._file(token)) as file:
                return os.fstat(file.fileno()).st_mtime_ns
        except FileNotFoundError:
            return None
        except OSError:  # not a regular file
            with suppress(FileNotFoundError):
                return self._file(token).lstat().st_mtime_ns
            return None

    def evict(self, token: str) -> None:
        """Delete the claim by its token.

        So the call cannot delete a newer claim.
        """
        self._file(token).unlink(missing_ok=True)

    def withdraw(self, token: str) -> None:
        """Delete the claim; remove the folder if no claim remains."""
        with suppress(OSError):
            self._file(token).unlink(missing_ok=True)
            self._folder.rmdir()
