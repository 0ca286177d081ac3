"""Text for people: unknown names, counts, and output that is safe in a terminal.

Text for people escapes control characters, because text may quote an untrusted file. A
command guards stdout and stderr once, log records pass a filter, and tables pass
through `sweep.cli.terminal`.
"""

import inspect
import json
import logging
import re
import sys
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any, TextIO

SHORT_LIST = 24
MOST_COMPARED = 20_000
"""Names in a search for a similar one; more would take seconds."""
MOST_SENTENCE = 2000
"""Characters of an error."""
MOST_SHOWN = 200
"""Characters of a quoted value, which may be untrusted."""
SECTION = re.compile(r"\n\n[A-Z][\w ]*\n-{3,}\n")
"""The beginning of a section of a docstring, such as Parameters."""


def shortened(text: str) -> str:
    """Return the first MOST_SHOWN characters of a quoted value."""
    return text if len(text) <= MOST_SHOWN else text[:MOST_SHOWN] + "..."


def abridged(sentence: str) -> str:
    """Return a sentence, or the beginning and the end of a very long one."""
    if len(sentence) <= MOST_SENTENCE:
        return sentence
    half = MOST_SENTENCE // 2
    return f"{sentence[:half]} ... {sentence[-half:]}"


def closest(name: object, allowed: Iterable[str]) -> str:
    """Return the most similar of the allowed names, or "" without a similar name."""
    names = list(map(str, allowed))
    few = len(names) <= MOST_COMPARED and len(str(name)) <= MOST_SHOWN
    close = get_close_matches(str(name), names, n=1) if few else []
    return close[0] if close else ""


def similar(name: str, names: list[str]) -> str:
    """Return a question with a similar name, or "" without a similar name.

    An example is `; did you mean "polarization"?`, which follows an unknown name.
    """
    close = closest(name, names)
    return f'; did you mean "{close}"?' if close else ""


def unknown(kind: str, name: object, allowed: Iterable[str]) -> str:
    """Return the sentence that reports an unknown name.

    An example is `unknown metric "polarisation"; did you mean "polarization"? Allowed:
    ...`.

    Parameters
    ----------
    kind : str
        The kind of thing, such as "metric".
    name : object
        The unknown name.
    allowed : iterable of str
        All names, listed if there are at most SHORT_LIST. A registry also knows why an
        entry of a package cannot be used; then the sentence is this reason.
    """
    names = list(allowed)
    text = str(name)
    if why := getattr(allowed, "refused", {}).get(text):
        return f'{kind} "{shortened(text)}" cannot be used: {why}'
    return f'unknown {kind} "{shortened(text)}"{choices(text, names)}'


def choices(name: str, names: list[str], called: str = "Allowed") -> str:
    """Return the text that follows an unknown name: a similar name, and all names.

    Parameters
    ----------
    name : str
        The unknown name.
    names : list of str
        The names that exist, listed if there are at most SHORT_LIST.
    called : str, default "Allowed"
        The word before the list.
    """
    if not names:
        return ": there is none"
    close = similar(name, names)
    if len(names) > SHORT_LIST:
        return close
    return close + ("" if close else ".") + f" {called}: {', '.join(names)}"


def installing(extra: str) -> str:
    """Return the command that installs the packages of an extra.

    pip reads the list of packages from the installed boidsweep. So the command also
    works for a boidsweep that was installed from a file and is in no registry.
    """
    return f'pip install "boidsweep[{extra}]"'


def so_many(number: int, noun: str) -> str:
    """Return a count with a noun, such as `1 trial` or `2,000 trials`."""
    return f"{number:,} {noun}" + "s" * (number != 1)


def numbered(noun: str, number: int, count: int) -> str:
    """Return a number with its range, such as `replicate 1 (of 0 to 399)`.

    Parameters
    ----------
    noun : str
        The kind of thing.
    number : int
        The number of the thing, from 0.
    count : int
        The total number of things.
    """
    return f"{noun} {number:,} (of 0 to {count - 1:,})"


def description_of(documented: Any) -> str:
    """Return the docstring of an object up to the first section; "" without one."""
    return SECTION.split(inspect.getdoc(documented) or "", maxsplit=1)[0]


def harmless(text: str) -> str:
    r"""Return `text` with each unprintable character as JSON writes it, such as \u001b.

    Ends of lines and tabs stay. Unprintable characters are control characters, marks
    that change the direction of writing, line separators and lone surrogates. The
    value of a JSON text does not change, because only strings contain such characters.
    """
    return "\n".join(map(_shown, text.split("\n")))


def _shown(line: str) -> str:
    if line.isprintable():
        return line
    characters = (
        character
        if character.isprintable() or character == "\t"
        else json.dumps(character)[1:-1]
        for character in line
    )
    return "".join(characters)


class Harmless:
    """A text stream that writes harmless text to `stream`.

    rich writes to `rich_proxied_file` without this guard, because styles are escape
    sequences. `sweep.cli.terminal` makes the text of rich harmless.
    """

    def __init__(self, stream: TextIO) -> None:
        self.rich_proxied_file = stream

    def write(self, text: str) -> int:
        """Write `text` and return the number of its characters."""
        self.rich_proxied_file.write(harmless(text))
        return len(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.rich_proxied_file, name)


def guard_streams() -> None:
    """Make all later output of this process harmless, tracebacks too."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if not isinstance(stream, Harmless | None):  # None: it is closed
            setattr(sys, name, Harmless(stream))


def unguarded(stream: Any) -> Any:
    """Return the stream below a guard, for output that steers the terminal.

    A progress bar is an example.
    """
    return getattr(stream, "rich_proxied_file", stream)


def make_harmless(record: logging.LogRecord) -> bool:
    """Make the message of a log record harmless, as a filter that keeps all records."""
    record.msg = harmless(record.getMessage())
    record.args = None
    return True
