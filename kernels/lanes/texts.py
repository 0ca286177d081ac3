"""Functions that are made of texts, since numba compiles functions and nothing else.

The texts come from the sources of functions that are loaded already, and from the names
of their arguments and of the fields of tuples: from code that runs anyway, and never
from data.
"""

import linecache
from textwrap import dedent
from typing import Any


def function_of(text: str, names: dict[str, Any]) -> Any:
    """The function that a text defines; `names` are the globals that it sees.
    Tracebacks show the text.
    """
    text = dedent(text).lstrip()
    name = text.removeprefix("def ").partition("(")[0]
    place, scope = f"<{name} as made>", dict(names)
    linecache.cache[place] = len(text), None, text.splitlines(True), place
    exec(compile(text, place, "exec"), scope)
    return scope[name]
