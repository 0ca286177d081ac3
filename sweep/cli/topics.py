"""The topics of the guide: its chapters, and the pages below docs, as a terminal can
show them and search them.

What only the site or a checkout has, as pictures and lists of pages, is left out, and
a link between topics becomes the command that shows the other one.
"""

import re
from collections.abc import Callable, Iterator
from pathlib import PurePosixPath
from posixpath import normpath
from typing import NamedTuple

from sweep.spec.built_in import DOCS, GUIDE

FENCE = "```"
FOLDERS = ("tutorials", "explanations")
"""Below docs: those whose pages are topics. The others are for developers, or belong
to the site."""
FENCED = re.compile(r"(^(```+)[^`\n]*\n.*?^\2$\n?)", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r"```\{(?P<name>\w+)\}[^\n]*\n(?P<text>.*?)^```", re.M | re.S)
NAMED = re.compile(r"^<!-- file: ([^>]*?) -->$", re.MULTILINE)
COMMENT = re.compile(r"<!--.*?-->\n?", re.DOTALL)
LINK = re.compile(
    r"(?P<picture>!?)\[(?P<words>[^\[\]]*)\]\((?![a-z]+:)(?P<place>[^()\s]*)\)"
)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)


class Topic(NamedTuple):
    """A text in Markdown, and the path of its document from the root of the
    repository, from which its links lead.
    """

    path: str
    text: str

    @property
    def title(self) -> str:
        """Its first heading."""
        return self.text.partition("\n")[0].lstrip("# ")


class FoundLine(NamedTuple):
    """A line of a topic that was searched for, and the heading that it stands under."""

    topic: str
    heading: str
    line: str


def all_topics() -> dict[str, Topic]:
    """Each topic by its name: the chapters of the guide as their headings are linked
    to, then the pages below docs by their files, and a list of pages by its folder.
    """
    guide = GUIDE.read_text(encoding="utf-8")
    found = {
        slug(chapter.title): chapter
        for chapter in (Topic("GUIDE.md", text) for text in chapters(guide))
    }
    pages = sorted(DOCS.glob("*.md"))
    for folder in FOLDERS:
        pages += sorted((DOCS / folder).glob("*.md"))
    for page in pages:
        path = PurePosixPath("docs", page.relative_to(DOCS).as_posix())
        if path != PurePosixPath("docs/index.md"):
            name = path.parent.name if path.stem == "index" else path.stem
            found[name] = Topic(str(path), page.read_text(encoding="utf-8"))
    return found


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


def slug(heading: str) -> str:
    """A heading as links name it."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def readable(name: str, topics: dict[str, Topic]) -> str:
    """The text of a topic without what a terminal cannot show or follow."""
    path, text = topics[name]
    text = DIRECTIVE.sub(_caption, NAMED.sub(r"`\1`:\n", text))

    def in_words(link: re.Match[str]) -> str:
        if link["picture"]:
            return f"*(Figure: {link['words']}.)*"
        leads = _led_to(link["place"], path, topics)
        if leads in (None, name):
            return link["words"]
        return f"{link['words']} (`sweep guide {leads}`)"

    return _outside_of_code(
        text, lambda prose: LINK.sub(in_words, COMMENT.sub("", prose))
    )


def _outside_of_code(text: str, change: Callable[[str], str]) -> str:
    parts = FENCED.split(text)
    parts[::3] = map(change, parts[::3])
    return "".join(part for i, part in enumerate(parts) if i % 3 != 2)


def _caption(directive: re.Match[str]) -> str:
    """What stands in the place of a directive of the site: the caption of a figure."""
    lines = directive["text"].splitlines()
    caption = " ".join(line for line in lines if line and not line.startswith(":"))
    return f"*(Figure: {caption})*" if directive["name"] == "figure" else ""


def _led_to(place: str, path: str, topics: dict[str, Topic]) -> str | None:
    """The topic to which a link of the document `path` leads, if it leads to one."""
    file, _, chapter = place.partition("#")
    document = normpath(PurePosixPath(path).parent / file) if file else path
    found = [name for name, topic in topics.items() if topic.path == document]
    if len(found) == 1:
        return found[0]
    for name in found:
        if chapter in map(slug, HEADING.findall(topics[name].text)):
            return name
    return None


def search(words: str, topics: dict[str, Topic]) -> Iterator[FoundLine]:
    """Find the paragraphs that have all these words, or words that begin so, whatever
    their capital letters; of each the line with the first of them. `_` parts words.
    """
    wanted = [
        re.compile(r"(?<![^\W_])" + re.escape(word), re.IGNORECASE)
        for word in words.split()
    ]
    for name in topics:
        heading = ""
        for block in _blocks(readable(name, topics)):
            if title := HEADING.fullmatch(block):
                heading = title[1]
            if all(word.search(block) for word in wanted):
                hit = next(line for line in block.split("\n") if wanted[0].search(line))
                yield FoundLine(name, heading, hit.strip())


def _blocks(text: str) -> Iterator[str]:
    """The headings, paragraphs and items of lists of a text, and each line of its
    tables and of its code.
    """
    lines: list[str] = []
    in_code = False
    for line in text.splitlines():
        in_code ^= line.startswith(FENCE)
        alone = in_code or line.startswith(("|", "#", FENCE))
        if lines and (alone or not line.strip() or line.startswith("- ")):
            yield "\n".join(lines)
            lines = []
        if alone:
            yield line
        elif line.strip():
            lines.append(line)
    if lines:
        yield "\n".join(lines)
