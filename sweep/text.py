"""Words for people: names that do not exist, numbers of things, and signs that a
terminal would obey.

Text for people shows its control characters and never sends them: it may quote a file
from anyone. A command guards its two streams once, log records pass one filter, and
tables go through `sweep.cli.terminal`.
"""

import json
import logging
import sys
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, TextIO

SHORT_LIST = 24
MOST_COMPARED = 20_000
"""Names: among more of them, looking for a similar one would take seconds."""
MOST_SENTENCE = 2000
"""Characters of an error."""
MOST_SHOWN = 200
"""Characters of what was given, which may come from anyone."""


def shortened(text: str) -> str:
    """What was given, as far as anybody wants to read it."""
    return text if len(text) <= MOST_SHOWN else text[:MOST_SHOWN] + "..."


def abridged(sentence: str) -> str:
    """A sentence that quotes what may be very long: its beginning and its end."""
    if len(sentence) <= MOST_SENTENCE:
        return sentence
    half = MOST_SENTENCE // 2
    return f"{sentence[:half]} ... {sentence[-half:]}"


def similar(given: str, names: list[str]) -> str:
    """The question that follows a name which does not exist, such as `; did you mean
    "polarization"?`, or nothing.
    """
    few = len(names) <= MOST_COMPARED and len(given) <= MOST_SHOWN
    close = get_close_matches(given, names, n=1) if few else []
    return f'; did you mean "{close[0]}"?' if close else ""


def unknown(kind: str, given: object, allowed: Iterable[str]) -> str:
    """A sentence such as `unknown metric "polarisation"; did you mean "polarization"?
    Allowed: ...`.

    The allowed names are listed where they are few. A registry says also why an entry
    of another package cannot be used.
    """
    names = list(allowed)
    text = str(given)
    if why := getattr(allowed, "refused", {}).get(text):
        return f'{kind} "{shortened(text)}" cannot be used: {why}'
    return f'unknown {kind} "{shortened(text)}"{choices(text, names)}'


def choices(given: str, names: list[str], called: str = "Allowed") -> str:
    """What follows a name that does not exist: which there are where they are few, and
    what they are called, after the question whether a similar one is meant.
    """
    if not names:
        return ": there is none"
    close = similar(given, names)
    if len(names) > SHORT_LIST:
        return close
    return close + ("" if close else ".") + f" {called}: {', '.join(names)}"


def installing(extra: str) -> str:
    """The command that installs the packages of an extra.

    pip reads from the boidsweep that is installed which they are. So this works too
    where that came from a file, and no registry has it.
    """
    return f'pip install "boidsweep[{extra}]"'


def so_many(number: int, what: str) -> str:
    """A number of things in words, such as `1 trial` or `2,000 trials`."""
    return f"{number:,} {what}" + "s" * (number != 1)


def numbered(what: str, number: int, count: int) -> str:
    """Which one of `count` things, as data number them: replicate 1 (of 0 to 399)."""
    return f"{what} {number:,} (of 0 to {count - 1:,})"


def harmless(text: str) -> str:
    r"""`text` with every sign that cannot be printed as JSON writes it, as \u001b;
    lines and tabs stay.

    Those are control characters, what turns the direction of writing, separators of
    lines and lone surrogates. JSON stays the same JSON, since such signs stand only
    within its strings.
    """
    return "\n".join(map(_shown, text.split("\n")))


def _shown(line: str) -> str:
    if line.isprintable():
        return line
    signs = (
        sign if sign.isprintable() or sign == "\t" else json.dumps(sign)[1:-1]
        for sign in line
    )
    return "".join(signs)


class Harmless:
    """A text stream that writes to `stream` what `harmless` leaves.

    `rich_proxied_file` is where rich writes, whose styles are escapes: what it prints
    goes through `sweep.cli.terminal`.
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
    """The stream below a guard, for what steers the terminal, such as a bar."""
    return getattr(stream, "rich_proxied_file", stream)


def make_harmless(record: logging.LogRecord) -> bool:
    """A filter of log records that makes their messages harmless and keeps them all."""
    record.msg, record.args = harmless(record.getMessage()), None
    return True
