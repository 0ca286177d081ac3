"""Pages of the Python interface, from signatures and docstrings."""

import inspect
import re
from collections.abc import Iterator
from types import ModuleType
from typing import Any

import sweep
import sweep.analysis
import sweep.errors
import sweep.figures
import sweep.testing
from sweep.loaded import LoadedStudy

MODULES = {
    sweep: "Functions that do the work of the commands.",
    sweep.analysis: "Estimates with confidence intervals, from tables.",
    sweep.figures: "Figures from tables.",
    sweep.testing: "Checks for the tests of a custom model.",
    sweep.errors: "Errors that a user can fix.",
}
PLACES = re.compile(r"\b(?:[a-z_]\w*\.)+(?=[A-Za-z_]\w*)")
"""Modules before the names of types."""
QUOTED = re.compile(r"(: |-> )'([^']*)'")
"""Types that were written as texts."""
SECTION = re.compile(r"^([A-Z][\w ]*)\n-{3,}\n", re.MULTILINE)
"""The heading of a section of a docstring."""
TEXT_BELOW = re.compile(r"^(- .*)\n(?=  )", re.MULTILINE)
"""A line of a list, and the end of the line before its text."""
LISTS = {"Attributes", "Parameters", "Raises", "Returns", "Warns", "Yields"}
"""Sections that are lists of names, each with its type and an indented text."""


def api_pages() -> Iterator[tuple[str, str]]:
    """The name and the text of each page."""
    names = [_file(module) for module in MODULES]
    rows = "".join(
        f"| [{module.__name__}]({_file(module)}.md) | {text} |\n"
        for module, text in MODULES.items()
    )
    yield (
        "reference/python/index",
        "# Python\n\nThese pages show the docstrings of the public interface. All other"
        " names can change without notice.\n\n| module | purpose |\n| --- | --- |"
        f"\n{rows}\n```{{toctree}}\n:hidden:\n" + "\n".join(names) + "\n```\n",
    )
    for module, text in MODULES.items():
        yield f"reference/python/{_file(module)}", _page(module, text)


def _file(module: ModuleType) -> str:
    return module.__name__.replace(".", "-")


def _page(module: ModuleType, text: str) -> str:
    name = module.__name__
    parts = [f"# {name}\n\n{text}\n\n:::{{py:currentmodule}} {name}\n:::\n"]
    functions = {
        name: one
        for name, one in public(module).items()
        if inspect.isfunction(one) or inspect.isclass(one)
    }
    for name, one in functions.items():
        parts.append(_described(name, one))
    return "\n".join(parts)


def public(module: ModuleType) -> dict[str, Any]:
    """The public entries of a module, by name; of `sweep` also the study that
    `sweep.load` returns.
    """
    names = getattr(module, "__all__", None) or [
        name for name in vars(module) if not name.startswith("_")
    ]
    entries = {
        name: getattr(module, name)
        for name in sorted(names)
        if getattr(getattr(module, name), "__module__", "").startswith("sweep")
    }
    return entries | ({"LoadedStudy": LoadedStudy} if module is sweep else {})


def _described(name: str, one: Any) -> str:
    return _class(name, one) if inspect.isclass(one) else _function(name, one)


def _function(name: str, one: Any, kind: str = "function") -> str:
    return _directive(kind, name + _signature(one), docstring_text(one))


def _class(name: str, one: type) -> str:
    members = []
    for member, value in inspect.getmembers(one):
        found = inspect.unwrap(getattr(value, "func", value))
        if member.startswith("_") or not (text := docstring_text(value)):
            continue
        if not getattr(found, "__module__", None) and not isinstance(value, property):
            continue
        if inspect.isfunction(value) and value.__module__.startswith("sweep"):
            members.append(_function(member, value, "method"))
        elif isinstance(value, property) or hasattr(value, "func"):
            members.append(_directive("attribute", member, text))
    return _directive("class", name, "\n\n".join([docstring_text(one), *members]))


def docstring_text(one: Any) -> str:
    """A docstring in Markdown: a section has no heading, which a directive may not
    have, and an example is code.
    """
    summary, *sections = SECTION.split(inspect.getdoc(one) or "")
    parts = [summary.rstrip()]
    for title, body in zip(sections[::2], sections[1::2], strict=True):
        text = body.rstrip()
        if title == "Examples":
            text = f"```text\n{text}\n```"
        elif title in LISTS:
            lines = "\n".join(map(_list_line, text.splitlines()))
            text = TEXT_BELOW.sub(r"\1\\\n", lines)
        parts.append(f"**{title}**\n\n{text}")
    return "\n\n".join(parts)


def _list_line(line: str) -> str:
    if not line or line.startswith(" "):
        return line.removeprefix("  ")
    name, colon, type_ = line.partition(" : ")
    return f"- `{name}`{colon}{type_}"


def _signature(one: Any) -> str:
    return PLACES.sub("", QUOTED.sub(r"\1\2", str(inspect.signature(one))))


def _directive(kind: str, head: str, text: str) -> str:
    fence = ":" * (7 if kind == "class" else 5)
    return f"{fence}{{py:{kind}}} {head}\n\n{text}\n{fence}\n"
