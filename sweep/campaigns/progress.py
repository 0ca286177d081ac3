"""How far a campaign is, and what shows it."""

from collections import Counter
from dataclasses import dataclass, field
from types import TracebackType
from typing import Protocol

from sweep.store.locations import Location


@dataclass
class Progress:
    """How far a launch is.

    `trials` counts the trials of the plan; of a launch of a share, only those in it.
    `stored` of them were stored before, and `statuses` counts the new ones. `apart` are
    stored trials that the plan does not list. Of the new trials `continued` go on from
    the last states of others, whose steps are `steps_saved` together. The plan grows to
    `most` trials at most. Where a rule decides how many trials a point gets, `settled`
    of the `points` have had their last one; `settled` is None where the number is
    fixed.
    """

    points: int = 0
    most: int = 0
    settled: int | None = None
    trials: int = 0
    stored: int = 0
    apart: int = 0
    continued: int = 0
    steps_saved: int = 0
    statuses: Counter[str] = field(default_factory=Counter)

    def count(self, trials: int, stored: int, /) -> None:
        """Count trials that are asked for now, and those of them that are stored."""
        self.trials += trials
        self.stored += stored

    @property
    def missing(self) -> int:
        return self.trials - self.stored

    @property
    def left(self) -> int:
        """Missing trials that have not run. When a launch has ended, these are links of
        chains after one that did not come to its end.
        """
        return self.missing - self.statuses.total()

    @property
    def troubled(self) -> int:
        """New trials that did not come to their end."""
        return sum(count for status, count in self.statuses.items() if status != "done")


@dataclass
class SearchProgress(Progress):
    """How far a search is.

    Until it ends, `trials` is the most that it can come to. `best_so_far` describes the
    best candidate in words.
    """

    best_so_far: str = ""

    def count(self, _trials: int, stored: int, /) -> None:
        """Count those that are stored; `trials` counts all from the beginning."""
        self.stored += stored


class Display(Protocol):
    """What shows the progress of one study to a user, as a context manager."""

    def __enter__(self) -> "Display": ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def show(self, progress: Progress) -> None:
        """Show how far it is now."""

    def summary(self, progress: Progress, folder: Location) -> str:
        """What became of it, in one line."""
