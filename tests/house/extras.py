"""Which extras there are: what code and documents say of them."""

import ast
import re
import tomllib
from collections.abc import Iterator

from tests.house.sources import Checkout, Finding, called

PROJECT, TEXT, INSTALL = "pyproject.toml", "sweep/text.py", "docs/install.md"
OF_CLONES = ("README.md", INSTALL)
"""They say how a clone is installed."""
DOCUMENTS = ("*.md", "docs/*.md", "notebooks/*.*")
NAMED = re.compile(r"boidsweep\[([a-z,]+)\]")
OF_A_CLONE = re.compile(r"pip install \\?[\"']?\.\[")
ROW = re.compile(r"^\| (`.*?`) \|", re.MULTILINE)


def extras_of(checkout: Checkout) -> set[str]:
    """Those that the project has."""
    project = tomllib.loads(checkout.document(PROJECT).text).get("project", {})
    return set(project.get("optional-dependencies", {}))


def code_names_extras_that_there_are(checkout: Checkout) -> Iterator[Finding]:
    extras, asked = extras_of(checkout), False
    for module in checkout.modules.values():
        for node in module.nodes:
            if isinstance(node, ast.Call) and called(node) == "installing":
                name, asked = ast.literal_eval(node.args[0]), True
                if name not in extras:
                    yield module.finding(node, f"there is no extra {name}")
    if not asked:
        yield Finding(TEXT, 1, "nobody calls installing")


def how_an_extra_is_installed_is_said_once(checkout: Checkout) -> Iterator[Finding]:
    """By `installing`."""
    said = {
        module.name: line
        for module in checkout.modules.values()
        for text, line in module.texts.items()
        if "boidsweep[" in text
    }
    if said.pop(TEXT, None) is None:
        yield Finding(TEXT, 1, "does not say how an extra is installed")
    for name, line in said.items():
        yield Finding(name, line, f"installing of {TEXT} says it")


def documents_name_extras_that_there_are(checkout: Checkout) -> Iterator[Finding]:
    """In a form that holds for all: a path such as `.` is a clone's alone."""
    extras = extras_of(checkout)
    for document in map(checkout.document, checkout.files(*DOCUMENTS)):
        for found in NAMED.finditer(document.text):
            for name in set(found[1].split(",")) - extras:
                yield document.finding(found.start(), f"there is no extra {name}")
        if document.name in OF_CLONES:
            continue
        for found in OF_A_CLONE.finditer(document.text):
            yield document.finding(found.start(), "installs from the folder of a clone")


def every_extra_has_a_row(checkout: Checkout) -> Iterator[Finding]:
    document = checkout.document(INSTALL)
    rows = " ".join(ROW.findall(document.text))
    listed = set(re.findall(r"`(\w+)`", rows))
    for name in extras_of(checkout) ^ listed:
        yield document.finding(0, f"{name} is no extra, or has no row")


RULES = (
    code_names_extras_that_there_are,
    how_an_extra_is_installed_is_said_once,
    documents_name_extras_that_there_are,
    every_extra_has_a_row,
)
