"""Text for people shows its control characters and never sends them: it may quote a file from anyone.

A command guards its two streams once, log records pass one filter, and tables go through `sweep.terminal`.
"""

import json
import logging
import sys
from typing import Any, TextIO


def harmless(text: str) -> str:
    r"""`text` with every sign that cannot be printed as JSON writes it, as \u001b; lines and tabs stay.

    Those are control characters, what turns the direction of writing, separators of lines and lone surrogates. JSON
    stays the same JSON, since such signs stand only within its strings.
    """
    return "\n".join(map(_shown, text.split("\n")))


def _shown(line: str) -> str:
    if line.isprintable():
        return line
    signs = (sign if sign.isprintable() or sign == "\t" else json.dumps(sign)[1:-1] for sign in line)
    return "".join(signs)


class Harmless:
    """A text stream that writes to `stream` what `harmless` leaves.

    `rich_proxied_file` is where rich writes, whose styles are escapes: what it prints goes through
    `sweep.terminal`.
    """

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write `text`; the number of its signs."""
        self.rich_proxied_file.write(harmless(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)


def guard_streams() -> None:
    """From now on whatever this process prints, its tracebacks too, is harmless."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if not isinstance(stream, Harmless | None):  # a closed one is none
            setattr(sys, name, Harmless(stream))


def unguarded(stream: Any) -> Any:
    """The stream below a guard, for what is to steer the terminal: a bar, the beginning of a line."""
    return getattr(stream, "rich_proxied_file", stream)


def make_harmless(record: logging.LogRecord) -> bool:
    """A filter of log records, which lets all of them through with a harmless message."""
    record.msg, record.args = harmless(record.getMessage()), None
    return True
