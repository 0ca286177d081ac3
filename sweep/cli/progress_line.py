"""The progress of further work, on stderr.

A terminal shows one line, which is updated. Elsewhere a new line appears at intervals.
"""

import sys
import time

from sweep.text import unguarded

LINE_SECONDS = 10.0


class ProgressLine:
    """A line `<subject>: 12 of 400 <nouns>`, at a readable rate."""

    def __init__(self, subject: str, nouns: str) -> None:
        self.subject = subject
        self.nouns = nouns
        self.terminal = sys.stderr.isatty()
        self.line_at = time.monotonic()

    def show(self, done: int, total: int) -> None:
        """Show the progress.

        Parameters
        ----------
        done : int
            The number of things that are done.
        total : int
            The number of all things.
        """
        text = f"{self.subject}: {done:,} of {total:,} {self.nouns}"
        if self.terminal:
            unguarded(sys.stderr).write("\r")
            print(text, end="\n" if done == total else "", file=sys.stderr, flush=True)
        elif done == 0 or time.monotonic() - self.line_at > LINE_SECONDS:
            self.line_at = time.monotonic()
            print(text, file=sys.stderr, flush=True)
