"""The checkpoints of a study, and the deletion of unneeded checkpoints.

The coordinator deletes the checkpoint of a trial when the trial is stored. The
coordinator knows the names of the files, and need not list the folder. Some checkpoints
remain: the coordinator may be killed between the two steps, and a worker that has lost
the coordinator may still write a checkpoint. So a launch lists the folder twice. At the
beginning the launch deletes the checkpoints that it will not need. At the end it
deletes all remaining checkpoints, even if nothing had to run.

A launch deletes only checkpoints of trials in its shard. A trial of another shard may
be running now. Files without the name of a checkpoint are left alone.
"""

import os
import re
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from sweep.spec import CHECKPOINTS
from sweep.store import Location, Share

STATES = ("state", "tried-1", "tried-2")
FRAMES = "frames"
"""Extensions of the files of a checkpoint.

The state has one of three extensions: see `sweep.workers.checkpoint`.
"""
NAME = re.compile(rf"([0-9a-f]{{24}})\.({'|'.join(STATES)}|{FRAMES}|(state-.*))")


class _File(NamedTuple):
    """A file of the checkpoint of a trial; `unfinished` during the writing."""

    trial: str
    unfinished: bool
    path: Path


def state_files(folder: Path, trial: str) -> list[Path]:
    """Return the paths of a state: as written, on the first and on the second try."""
    return [folder / f"{trial}.{ending}" for ending in STATES]


def frames_file(folder: Path, trial: str) -> Path:
    """Return the path of the frames of a trial."""
    return folder / f"{trial}.{FRAMES}"


def delete_files(folder: Path, trial: str) -> None:
    """Delete the checkpoint of a trial, if there is one."""
    for path in (*state_files(folder, trial), frames_file(folder, trial)):
        with suppress(OSError):
            path.unlink()


@dataclass(frozen=True)
class Checkpoints:
    """The checkpoints in `folder` of a launch's trials.

    With `share`, only trials of that shard count, otherwise all trials. Without a
    folder, as in an object store, there are no checkpoints.
    """

    folder: Path | None
    share: Share | None = None

    @classmethod
    def of(cls, study: Location, share: Share | None = None) -> "Checkpoints":
        """Return the checkpoints of a study.

        Parameters
        ----------
        study : Location
            Folder of the study, or its location in an object store.
        share : Share, optional
            Shard of the launch; by default all trials.
        """
        folder = study.absolute() / CHECKPOINTS if isinstance(study, Path) else None
        return cls(folder, share)

    def trials(self) -> set[str]:
        """Return the trials of this launch with files of a checkpoint."""
        return {file.trial for file in self._files()}

    def size(self) -> int:
        """Return the size of all checkpoints, in bytes."""
        total = 0
        for file in self._files():
            with suppress(OSError):
                total += file.path.lstat().st_size
        return total

    def discard(self, trials: Collection[str]) -> None:
        """Delete the checkpoints of trials, and the folder if it is empty then.

        Unfinished files of a worker remain until `keep_only` deletes them.
        """
        if self.folder is None or self.folder.is_symlink():
            return
        for trial in trials:
            delete_files(self.folder, trial)
        self._delete_if_empty()

    def keep_only(self, trials: Collection[str]) -> None:
        """Delete unfinished files, and all checkpoints except those of `trials`.

        No trial of this launch may be running.
        """
        for file in self._files():
            if file.unfinished or file.trial not in trials:
                with suppress(OSError):
                    file.path.unlink()
        self._delete_if_empty()

    def _delete_if_empty(self) -> None:
        if self.folder and not self.folder.is_symlink():
            with suppress(OSError):  # it is not empty, or not there
                self.folder.rmdir()

    def _files(self) -> list[_File]:
        if self.folder is None or self.folder.is_symlink():
            return []
        try:
            with os.scandir(self.folder) as entries:
                paths = [Path(entry) for entry in entries]
        except OSError:
            return []
        names = [(NAME.fullmatch(path.name), path) for path in paths]
        files = [_File(name[1], bool(name[3]), path) for name, path in names if name]
        return [file for file in files if self._is_ours(file.trial)]

    def _is_ours(self, trial: str) -> bool:
        return self.share is None or bool(self.share.has([trial])[0])
