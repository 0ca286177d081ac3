"""Which checkpoints a study has, and which are deleted: those that no trial will go on
from.

A checkpoint is deleted when its trial is stored. Whoever stored the trial may be killed
between the two, and a worker that has lost its coordinator may write one later. So each
launch begins by deleting those that it will not need, and deletes all when it comes to
its end, even if it had nothing to run.

A launch answers for its own trials, those of its share. A trial of another share may be
running now, so its files are never touched. Files without the name of a checkpoint are
left alone.
"""

import os
import re
from collections.abc import Callable, Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from sweep.spec.layout import CHECKPOINTS
from sweep.store.locations import Location
from sweep.store.shares import Share

NAME = re.compile(r"([0-9a-f]{24})\.(state|tried-[12]|frames|(state-.*))")


class _File(NamedTuple):
    """A file of the checkpoint of a trial; `unfinished` while it is being written."""

    trial: str
    unfinished: bool
    path: Path


@dataclass(frozen=True)
class Checkpoints:
    """The checkpoints in `folder` of a launch's trials: those in its `share`, or all.

    Without a folder, as in an object store, there are none.
    """

    folder: Path | None
    share: Share | None = None

    @classmethod
    def of(cls, study: Location, share: Share | None = None) -> "Checkpoints":
        """The checkpoints of the study in this place."""
        folder = study.absolute() / CHECKPOINTS if isinstance(study, Path) else None
        return cls(folder, share)

    def trials(self) -> set[str]:
        """The trials of this launch that have a checkpoint, or a piece of one."""
        return {file.trial for file in self._files()}

    def size(self) -> int:
        """The bytes of all these checkpoints."""
        total = 0
        for file in self._files():
            with suppress(OSError):
                total += file.path.lstat().st_size
        return total

    def discard(self, trials: Collection[str]) -> None:
        """Delete the checkpoints of trials, and the folder with the last of them."""
        self._delete(lambda file: file.trial in trials)

    def keep_only(self, trials: Collection[str]) -> None:
        """Delete the checkpoints of all other trials, and what no worker has finished.

        Nobody may be running trials of this launch.
        """
        self._delete(lambda file: file.unfinished or file.trial not in trials)

    def _delete(self, goes: Callable[[_File], bool]) -> None:
        for file in filter(goes, self._files()):
            with suppress(OSError):
                file.path.unlink()
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
