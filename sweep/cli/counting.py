"""How far a piece of work is, on stderr: a line that grows in a terminal, a line now
and then elsewhere.
"""

import sys
import time

from sweep.text import unguarded

LINE_SECONDS = 10.0


class Counter:
    """Says `<what>: 12 of 400 <things>` when it is told so; no more often than is
    readable.
    """

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
