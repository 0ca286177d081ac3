"""The progress of a launch, on stderr: a bar in a terminal; elsewhere a new line now
and then.
"""

import sys
import time
from types import TracebackType

from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

from sweep.campaigns.progress import Progress
from sweep.cli.terminal import Terminal
from sweep.store.locations import Location
from sweep.text import guard_streams, unguarded

LINE_SECONDS = 10.0


class ProgressBar:
    """Shows the trials of a study: done, a second, time to go, failed. A context
    manager.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.terminal = sys.stderr.isatty()
        self.bar = Bar(
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[pace]}", markup=False),
            TimeRemainingColumn(),
            TextColumn("{task.fields[notes]}"),
            console=Terminal(file=unguarded(sys.stderr)),
            disable=not self.terminal,
        )
        self.task = self.bar.add_task(name, total=None, pace="", notes="")
        self.began = time.monotonic()
        self.line_at = self.began
        self.paced_from: tuple[float, int] | None = None

    def __enter__(self) -> "ProgressBar":
        self.bar.start()
        # rich has replaced both streams with its own, which print above the bar.
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
        """Show `progress`: at once in a terminal; elsewhere only if the last line is
        old enough.
        """
        new = progress.statuses.total()
        if new == 0:
            self._first(progress)
        pace = self._pace(new)
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
            settled = f", {_settled(progress)}" if progress.settled is not None else ""
            self._line(
                f"{progress.stored + new:,} of {progress.trials:,} trials{settled}"
                + (f", {pace}" if pace else "")
            )

    def _pace(self, new: int) -> str:
        """Trials a second since the first ones came back. The time before is for
        compiling and starting workers.
        """
        if new == 0:
            return "compiling"
        if self.paced_from is None:
            self.paced_from = time.monotonic(), new
        began, already = self.paced_from
        return (
            f"{(new - already) / max(time.monotonic() - began, 1e-3):.1f} trials/s"
            if new > already
            else ""
        )

    def _first(self, progress: Progress) -> None:
        rule = progress.settled is not None
        settled = (
            f"{_settled(progress)}, at most {progress.most:,} trials; now "
            if rule
            else ""
        )
        self._line(
            f"{settled}{progress.trials:,} trials,"
            f" {progress.stored:,} of them stored already"
        )
        if progress.apart:
            later = ", or are not asked for yet" if rule else ""
            self._line(
                f"{progress.apart:,} stored trials belong to another version of the"
                f" spec or of the kernels{later}: they are kept,"
                " and stay out of the tables"
            )

    def _line(self, text: str) -> None:
        self.bar.console.print(f"{self.name}: {text}", soft_wrap=True)

    def summary(self, progress: Progress, folder: Location) -> str:
        """The result of the launch, in one line."""
        new = progress.statuses.total()
        counts = ", ".join(
            f"{count:,} {status}" for status, count in sorted(progress.statuses.items())
        )
        seconds = time.monotonic() - self.began
        done = (
            f"{new:,} new trials ({counts}) in {seconds:.1f} s"
            if new
            else "nothing was missing"
        )
        settled = f", {_settled(progress)}" if progress.settled is not None else ""
        return f"{self.name}: {done}; {progress.trials:,} trials in {folder}{settled}"


def _settled(progress: Progress) -> str:
    return f"points settled {progress.settled:,} of {progress.points:,}"
