"""Prose that readers of a second language follow: limits of the style sheet.

They hold for documents, for docstrings, and for texts in code: help and messages.
`python -m tests.house.prose FILE...` prints what a document or a module has.
"""

import ast
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from tests.house.sources import Checkout, Document, Finding, Module

DOCUMENTS = (
    "README.md",
    "CHANGELOG.md",
    "CODE_OF_CONDUCT.md",
    "RELEASING.md",
    "SECURITY.md",
    "SUPPORT.md",
    "CONTRIBUTING.md",
    "DEVELOPING.md",
    "docs/*.md",
    "docs/guide/*.md",
    "docs/tutorials/*.md",
    "docs/explanations/*.md",
    "experiments/*/README.md",
    "paper/paper.md",
)
MOST_PRONOUNS = 35
"""Per 1,000 words. Guides of uv, xarray, Mesa and FLAME GPU have 23 to 27."""
LONGEST = 30
"""Words of a sentence."""
FEWEST_WORDS = 100
"""A shorter text has no density of pronouns."""
PRONOUNS = re.compile(
    r"\b(it|its|itself|they|them|their|theirs|themselves|what|whatever|who|whoever|whom"
    r"|whose|such(?! as)|(?:that|those) of|these|those|this(?= (?:is|was|has))|others?"
    r"|ones?(?= )|the same|none|nothing|nobody|everybody|so is|likewise|alike|both)\b",
    re.IGNORECASE,
)
BANNED = {
    r"fl(?:y|ies|own|ew|ights?)": "run, trial",
    r"the same bits|every bit|to the (?:last )?bit": "bitwise identical",
    r"go(?:es)? on": "resume, continue",
    r"anew": "again",
    r"of (?:your|our|their|its) own|of ours|of yours": "custom, built-in",
    r"whole numbers?": "integer",
    r"hold together": "simultaneous",
    r"mends?|mended": "fix",
    r"way out": "fix",
    r"stands?|lies": "is",
    r"is said|are said|says so": "is reported",
    r"refuse[sd]?": "rejects",
    r"\w+, as (?:in )?CODE": "such as",
}
"""Words of the house, and those of the field."""
NOT_PROSE = re.compile(
    r"^(?P<fence>`{3,}).*?^(?P=fence)`*[ \t]*$|<!--.*?-->|^[|#:][^\n]*$",
    re.MULTILINE | re.DOTALL,
)
LINK = re.compile(r"!?\[([^\]]*)\]\([^)]*\)")
CODE = re.compile(r"``?[^`]*``?|\bNone\b(?! of)|\$\$.*?\$\$|\$[^$\n]*\$", re.DOTALL)
"""Code, None of Python, and formulas."""
ITEM = re.compile(r"^\s*(?:[-*]|\d+\.) ", re.MULTILINE)
END = re.compile(r"(?<=[.!?:])[\"')*]*\s+(?=[\"'(*`A-Z0-9])|\n\s*\n")
WORD = re.compile(r"[A-Za-z][\w'-]*|\d[\d,.]*")
NOT_SAID = re.compile(
    r"^ *[*\w, ]+ : [^\n]*$|^ *[A-Z]\w+$|^ *\w+ {2,}|^ *[A-Z][\w ]+\n *-{3,}$"
    r"|^ *>>> .*?(?:\n\s*\n|\Z)|^[^\n]*\S {3,}\d[^\n]*$|;$|; ",
    re.MULTILINE | re.DOTALL,
)
"""Of a docstring: names with types, types, names in a list, headings, examples, tables.

A semicolon ends an item of a list, such as the columns of a table.
"""
IN_IDS = "kernels/"
"""Texts in kernels are part of ids of trials, and so are not measured."""
FEWEST_OF_A_TEXT = 4
"""Words. A shorter text in code is a name or a piece of a sentence."""


class Measured(NamedTuple):
    """What a text has: words, pronouns per 1,000, long sentences, and banned words with
    the terms in their place.
    """

    words: int
    pronouns: float
    long: list[str]
    banned: list[tuple[str, str]]


def prose(text: str) -> str:
    """The sentences of a page, without code, tables, headings and addresses."""
    kept = NOT_PROSE.sub("", text)
    return ITEM.sub("\n\n", LINK.sub(r"\1", CODE.sub("CODE", kept)))


def sentences(text: str) -> Iterator[str]:
    for sentence in END.split(prose(text)):
        if words := " ".join(sentence.split()):
            yield words


def measured(text: str) -> Measured:
    whole = prose(text)
    words = len(WORD.findall(whole))
    pronouns = 1000 * len(PRONOUNS.findall(whole)) / max(words, 1)
    long = [one for one in sentences(text) if len(WORD.findall(one)) > LONGEST]
    banned = [
        (hit[0], instead)
        for pattern, instead in BANNED.items()
        for hit in re.finditer(rf"\b(?:{pattern})(?!\w)", whole, re.IGNORECASE)
        if not hit[0].isupper()  # a name
    ]
    return Measured(words, pronouns, long, banned)


def documents_are_easy_to_read(checkout: Checkout) -> Iterator[Finding]:
    """Also for readers who learnt English as a second language."""
    for name in checkout.files(*DOCUMENTS):
        yield from _of_document(checkout.document(name))


def _of_document(document: Document) -> Iterator[Finding]:
    found = measured(document.text)
    if what := _too_dense(found):
        yield document.finding(0, what)
    for word, what in _single(found):
        yield document.finding(document.text.find(word), what)


def docstrings(module: Module) -> dict[str, int]:
    """The docstrings, also those of constants and fields, and their first lines."""
    return {
        NOT_SAID.sub("\n\n", node.value.value): node.lineno
        for node in module.nodes
        if isinstance(node, ast.Expr)
        and isinstance(node.value, ast.Constant)
        and isinstance(node.value.value, str)
    }


def messages(module: Module) -> dict[str, int]:
    """The texts of code that have several words, and their first lines."""
    return {
        text: line
        for text, line in module.texts.items()
        if sum(map(str.isalpha, text.split())) >= FEWEST_OF_A_TEXT
    }


def code_is_easy_to_read(checkout: Checkout) -> Iterator[Finding]:
    """Its docstrings, its help and its messages, as the documents are."""
    for module in checkout.modules.values():
        yield from _of_module(module)


def _of_module(module: Module) -> Iterator[Finding]:
    kinds = {"docstrings": docstrings(module)}
    if not module.name.startswith(IN_IDS):
        kinds["texts"] = messages(module)
    for kind, texts in kinds.items():
        if what := _too_dense(measured("\n\n".join(texts)), f" of its {kind}"):
            yield module.finding(1, what)
        for text, line in texts.items():
            for _, what in _single(measured(text)):
                yield module.finding(line, what)


def _too_dense(found: Measured, of: str = "") -> str:
    if found.words < FEWEST_WORDS or found.pronouns <= MOST_PRONOUNS:
        return ""
    return f"{found.pronouns:.0f} pronouns per 1,000 words{of}; at most {MOST_PRONOUNS}"


def _single(found: Measured) -> Iterator[tuple[str, str]]:
    """The first word of each place, and what is wrong there."""
    for sentence in found.long:
        yield sentence.split()[0], f"a long sentence: {sentence}"
    for word, instead in found.banned:
        yield word, f'"{word}" is no term of the field: {instead}'


def main() -> None:
    here = Checkout(Path())
    for name in sys.argv[1:]:
        if name.endswith(".py"):
            found = measured("\n\n".join(docstrings(here.module(name))))
            findings = _of_module(here.module(name))
        else:
            found = measured(here.document(name).text)
            findings = _of_document(here.document(name))
        print(f"{name}: {found.words} words, {found.pronouns:.0f} pronouns per 1,000")
        for finding in findings:
            print(f"    {finding}")


RULES = (documents_are_easy_to_read, code_is_easy_to_read)

if __name__ == "__main__":
    main()
