"""The progress of other work than a launch, on stderr. In a terminal one line is
written again and again; elsewhere a new line is written now and then.
"""

import sys
import time

from sweep.text import unguarded

LINE_SECONDS = 10.0


class ProgressLine:
    """Writes `<what>: 12 of 400 <things>`, but not more often than people can read."""

    def __init__(self, what: str, things: str) -> None:
        self.what, self.things = what, things
        self.terminal = sys.stderr.isatty()
        self.said_at = time.monotonic()

    def show(self, done: int, whole: int) -> None:
        """Show that `done` of `whole` things are done."""
        text = f"{self.what}: {done:,} of {whole:,} {self.things}"
        if self.terminal:
            unguarded(sys.stderr).write("\r")
            print(text, end="\n" if done == whole else "", file=sys.stderr, flush=True)
        elif done == 0 or time.monotonic() - self.said_at > LINE_SECONDS:
            self.said_at = time.monotonic()
            print(text, file=sys.stderr, flush=True)
