"""The topics of the guide: its chapters, and the pages that it leads to."""

import re

from sweep.spec.built_in import DOCS, GUIDE

FENCE = "```"


def all_topics() -> dict[str, str]:
    """The text of each topic, in Markdown, by its name: the chapters of the guide as
    their headings are linked to, then the pages below docs by their files.
    """
    found = {
        slug(title(text)): text for text in chapters(GUIDE.read_text(encoding="utf-8"))
    }
    pages = sorted(DOCS.glob("*.md"))
    return found | {page.stem: page.read_text(encoding="utf-8") for page in pages}


def chapters(text: str) -> list[str]:
    """The chapters of a page, each from its heading `## ` on. A line in a block of code
    is no heading.
    """
    found: list[list[str]] = []
    in_code = False
    for line in text.splitlines(keepends=True):
        in_code ^= line.startswith(FENCE)
        if line.startswith("## ") and not in_code:
            found.append([])
        if found:
            found[-1].append(line)
    return ["".join(lines).rstrip() + "\n" for lines in found]


def title(text: str) -> str:
    """The first heading of a text."""
    return text.partition("\n")[0].lstrip("# ")


def slug(heading: str) -> str:
    """A heading as links name it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
