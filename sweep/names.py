"""What to say about a name that does not exist."""

from collections.abc import Iterable
from difflib import get_close_matches

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
    """The question that follows a name which does not exist, such as `; did you mean "polarization"?`, or nothing."""
    few = len(names) <= MOST_COMPARED and len(given) <= MOST_SHOWN
    close = get_close_matches(given, names, n=1) if few else []
    return f'; did you mean "{close[0]}"?' if close else ""


def unknown(kind: str, given: object, allowed: Iterable[str]) -> str:
    """A sentence such as `unknown metric "polarisation"; did you mean "polarization"? Allowed: ...`.

    The allowed names are listed where they are few.
    """
    names = list(allowed)
    text = str(given)
    close = similar(text, names)
    sentence = f'unknown {kind} "{shortened(text)}"{close}'
    if not names:
        return sentence + ": there is none"
    if len(names) <= SHORT_LIST:
        sentence += ("" if close else ".") + f" Allowed: {', '.join(names)}"
    return sentence
