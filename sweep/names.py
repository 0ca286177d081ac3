"""What to say about a name that does not exist."""

from collections.abc import Iterable
from difflib import get_close_matches

SHORT_LIST = 24


def unknown(kind: str, given: object, allowed: Iterable[str]) -> str:
    """A sentence such as `unknown metric "polarisation"; did you mean "polarization"? Allowed: ...`.

    The allowed names are listed where they are few.
    """
    names = list(allowed)
    close = get_close_matches(str(given), names, n=1)
    sentence = f'unknown {kind} "{given}"'
    if close:
        sentence += f'; did you mean "{close[0]}"?'
    if not names:
        return sentence + ": there is none"
    if len(names) <= SHORT_LIST:
        sentence += ("" if close else ".") + f" Allowed: {', '.join(names)}"
    return sentence
