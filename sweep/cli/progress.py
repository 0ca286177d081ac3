"""The progress of a launch, on stderr.

A terminal shows a bar. Elsewhere a new line with the numbers appears at intervals.
"""

import json
import sys
import time
from types import TracebackType

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from sweep.campaigns import Progress
from sweep.cli.terminal import Terminal
from sweep.design import duration
from sweep.store import Location, Share
from sweep.text import guard_streams, so_many, unguarded

LINE_SECONDS = 10.0


class ProgressBar:
    """A context manager that shows the progress of a study, nothing if `quiet`.

    The progress is trials done, trials per second, remaining time and failures.
    """

    def __init__(self, name: str, *, quiet: bool = False) -> None:
        self.name = name
        self.quiet = quiet
        self.terminal = sys.stderr.isatty() and not quiet
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[pace]}", markup=False),
            TimeRemainingColumn(),
            TextColumn("{task.fields[notes]}"),
        )
        self.bar = Bar(
            *columns,
            console=Terminal(file=unguarded(sys.stderr)),
            disable=not self.terminal,
        )
        self.task = self.bar.add_task(name, total=None, pace="", notes="")
        self.began = time.monotonic()
        self.line_at = self.began
        self.paced_from: tuple[float, int] | None = None
        self.has_begun = False

    def __enter__(self) -> "ProgressBar":
        self.bar.start()
        # rich has replaced the two streams; the new streams print above the bar.
        guard_streams()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.bar.stop()

    def show(self, progress: Progress) -> None:
        """Show `progress`, outside a terminal only if the last line is old enough."""
        new = progress.statuses.total()
        if new == 0:
            self._first(progress)
        pace = ", ".join(filter(None, [self._pace(new), progress.note]))
        notes = [_settled(progress)] if progress.settled is not None else []
        notes += [f"[red]{progress.troubled} not done"] if progress.troubled else []
        self.bar.update(
            self.task,
            completed=progress.stored + new,
            total=progress.trials,
            pace=pace,
            notes=", ".join(notes),
        )
        if not self.terminal and time.monotonic() - self.line_at > LINE_SECONDS:
            self.line_at = time.monotonic()
            done = f"{progress.stored + new:,} of {so_many(progress.trials, 'trial')}"
            settled = _settled(progress) if progress.settled is not None else ""
            left = self._left(progress, new)
            self._line(", ".join(filter(None, [done, settled, pace, left])))

    def _pace(self, new: int) -> str:
        """Return trials per second, in words."""
        if new == 0:
            return "compiling"
        rate = self._rate(new)
        return f"{rate:.1f} trials/s" if rate else ""

    def _left(self, progress: Progress, new: int) -> str:
        """Return the remaining time of missing trials, in words."""
        rate = self._rate(new)
        left = progress.missing - new
        return f"about {duration(left / rate)} left" if rate and left else ""

    def _rate(self, new: int) -> float:
        """Return trials per second since the first results, 0 if unknown.

        Before the first results, time is spent on compiling and starting workers.
        """
        if new and self.paced_from is None:
            self.paced_from = time.monotonic(), new
        began, already = self.paced_from or (0.0, new)
        return (new - already) / max(time.monotonic() - began, 1e-3)

    def _first(self, progress: Progress) -> None:
        if progress.ahead:
            if not self.has_begun:
                self._line(
                    f"at most {progress.trials:,} trials;"
                    " stored trials do not run again"
                )
            self.has_begun = True
            return
        rule = progress.settled is not None
        settled = (
            f"{_settled(progress)}, at most {so_many(progress.most, 'trial')}; now "
            if rule
            else ""
        )
        self._line(
            f"{settled}{so_many(progress.trials, 'trial')},"
            f" {progress.stored:,} of them stored already"
        )
        if progress.continued:
            going = so_many(progress.continued, "trial")
            self._line(
                f"from last states of shorter trials: {going}, {_saved(progress)}"
            )
        if progress.apart:
            later = ", or not requested yet" if rule else ""
            self._line(
                f"{so_many(progress.apart, 'stored trial')} of another version of the"
                f" spec or of the code{later}: kept, but not in the tables"
            )

    def _line(self, text: str) -> None:
        if not self.quiet:
            self.bar.console.print(f"{self.name}: {text}", soft_wrap=True)

    @property
    def seconds(self) -> float:
        """Seconds since the bar was made."""
        return time.monotonic() - self.began

    def summary(self, progress: Progress, folder: Location) -> str:
        """Return the result of the launch in one line.

        Parameters
        ----------
        progress : Progress
            The last progress.
        folder : Location
            The folder of the study.
        """
        new = progress.statuses.total()
        counts = ", ".join(
            f"{count:,} {status}" for status, count in sorted(progress.statuses.items())
        )
        done = (
            f"{so_many(new, 'new trial')} ({counts}) in {self.seconds:.1f} s"
            if new
            else "nothing was missing"
        )
        settled = f", {_settled(progress)}" if progress.settled is not None else ""
        trials = so_many(progress.trials, "trial")
        cut_off = ""
        if progress.left:
            cut = so_many(progress.left, "trial")
            cut_off = f"; {cut} not run: an earlier link is not done"
        return f"{self.name}: {done}; {trials} in {folder}{settled}{cut_off}"


def launch_json(
    study: str,
    share: Share | None,
    folder: Location,
    progress: Progress,
    *,
    seconds: float,
) -> str:
    """Return the result of a launch as JSON.

    docs/json.md describes each key.

    Parameters
    ----------
    study : str
        The name of the study.
    share : Share or None
        The shard that ran; None for all trials.
    folder : Location
        The folder of the study.
    progress : Progress
        The last progress.
    seconds : float
        The duration of the launch.
    """
    return json.dumps(
        {
            "study": study,
            "share": str(share) if share else None,
            "folder": str(folder),
            "points": progress.points,
            "settled": progress.settled,
            "trials": progress.trials,
            "stored": progress.stored,
            "new": dict(progress.statuses),
            "apart": progress.apart,
            "continued": progress.continued,
            "steps_saved": progress.steps_saved,
            "seconds": round(seconds, 3),
        }
    )


def _saved(progress: Progress) -> str:
    return f"{so_many(progress.steps_saved, 'step')} less to run"


def _settled(progress: Progress) -> str:
    return f"points settled {progress.settled:,} of {progress.points:,}"
