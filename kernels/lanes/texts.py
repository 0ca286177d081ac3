"""Functions from texts, because numba compiles functions only.

The texts consist of sources of functions that are loaded already, and of names of
arguments and of fields of tuples. So each text comes from code of the program or of a
model, and never from data.
"""

import linecache
from textwrap import dedent
from typing import Any


def function_of(text: str, names: dict[str, Any]) -> Any:
    """Return the function that a text defines.

    `names` are the globals that the function sees. Tracebacks show the text.
    """
    text = dedent(text).lstrip()
    name = text.removeprefix("def ").partition("(")[0]
    place = f"<{name} as made>"
    scope = dict(names)
    linecache.cache[place] = len(text), None, text.splitlines(True), place
    exec(compile(text, place, "exec"), scope)
    return scope[name]
