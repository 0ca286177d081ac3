"""What to say about a name that does not exist."""

from collections.abc import Iterable
from difflib import get_close_matches

SHORT_LIST = 24
MOST_COMPARED = 20_000
"""Names: among more of them, looking for a similar one would take seconds."""
MOST_SHOWN = 200
"""Characters of what was given, which may come from anyone."""


def unknown(kind: str, given: object, allowed: Iterable[str]) -> str:
    """A sentence such as `unknown metric "polarisation"; did you mean "polarization"? Allowed: ...`.

    The allowed names are listed where they are few.
    """
    names = list(allowed)
    text = str(given)
    few = len(names) <= MOST_COMPARED and len(text) <= MOST_SHOWN
    close = get_close_matches(text, names, n=1) if few else []
    sentence = f'unknown {kind} "{text[:MOST_SHOWN]}"'
    if close:
        sentence += f'; did you mean "{close[0]}"?'
    if not names:
        return sentence + ": there is none"
    if len(names) <= SHORT_LIST:
        sentence += ("" if close else ".") + f" Allowed: {', '.join(names)}"
    return sentence
