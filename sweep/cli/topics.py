"""The topics of the guide in a form for a terminal: pages of the guide and of docs.

Parts for the site or a checkout only, such as figures and lists of pages, are left out.
A link between topics becomes the command that shows the linked topic.
"""

import re
from collections.abc import Callable, Iterator
from pathlib import Path, PurePosixPath
from posixpath import normpath
from typing import NamedTuple

from sweep.spec import DOCS

FENCE = "```"
GUIDE = "guide"
INDEX = "index.md"
FOLDERS = (GUIDE, "tutorials", "explanations")
"""Folders in docs with topics; further folders are for developers or the site."""
LISTED = re.compile(r"^- \[[^\]]*\]\(([\w-]+\.md)\)", re.MULTILINE)
ONCE = re.compile(r"^<!-- once: ([\w-]+) -->$", re.MULTILINE)
"""A former name of a page."""
FENCED = re.compile(r"(^(```+)[^`\n]*\n.*?^\2$\n?)", re.MULTILINE | re.DOTALL)
DIRECTIVE = re.compile(r"```\{(?P<name>\w+)\}[^\n]*\n(?P<text>.*?)^```", re.M | re.S)
NAMED = re.compile(r"^<!-- file: ([^>]*?) -->$", re.MULTILINE)
COMMENT = re.compile(r"<!--.*?-->\n?", re.DOTALL)
LINK = re.compile(
    r"(?P<picture>!?)\[(?P<words>[^\[\]]*)\]\((?![a-z]+:)(?P<place>[^()\s]*)\)"
)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)


class Topic(NamedTuple):
    """A text in Markdown, and the path of the document.

    The path starts at the root of the repository. Links of the text start at the path.
    """

    path: str
    text: str

    @property
    def title(self) -> str:
        """The first heading."""
        return self.text.partition("\n")[0].lstrip("# ")


class FoundLine(NamedTuple):
    """A line of a topic that matches a search, and the heading above the line."""

    topic: str
    heading: str
    line: str


def all_topics() -> dict[str, Topic]:
    """Return all topics by name, first the pages of the guide in their order.

    The name of a page is the name of the file. The name of a list of pages is the name
    of the folder.
    """
    pages = [
        DOCS / GUIDE / link for link in LISTED.findall(_read(DOCS / GUIDE / INDEX))
    ]
    pages += sorted(DOCS.glob("*.md"))
    for folder in FOLDERS:
        pages += sorted((DOCS / folder).glob("*.md"))
    topics = dict[str, Topic]()
    for page in pages:
        path = PurePosixPath("docs", page.relative_to(DOCS).as_posix())
        if path != PurePosixPath("docs", INDEX):
            name = path.parent.name if path.name == INDEX else path.stem
            topics.setdefault(name, Topic(str(path), _read(page)))
    return topics


def _read(page: Path) -> str:
    return page.read_text(encoding="utf-8")


def earlier_names(topics: dict[str, Topic]) -> dict[str, str]:
    """Return the names of topics by former names, which still work."""
    return {
        earlier: name
        for name, topic in topics.items()
        for earlier in ONCE.findall(topic.text)
    }


def slug(heading: str) -> str:
    """Return the name of a heading in links."""
    return re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")


def readable(name: str, topics: dict[str, Topic]) -> str:
    """Return the text of a topic for a terminal, with commands in place of links."""
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
    """Return the replacement of a directive of the site: the caption of a figure."""
    lines = directive["text"].splitlines()
    caption = " ".join(line for line in lines if line and not line.startswith(":"))
    return f"*(Figure: {caption})*" if directive["name"] == "figure" else ""


def _led_to(place: str, path: str, topics: dict[str, Topic]) -> str | None:
    """Return the topic to which a link in the document `path` leads, if any."""
    file, _, chapter = place.partition("#")
    document = normpath(PurePosixPath(path).parent / file) if file else path
    matches = [name for name, topic in topics.items() if topic.path == document]
    if len(matches) == 1:
        return matches[0]
    for name in matches:
        if chapter in map(slug, HEADING.findall(topics[name].text)):
            return name
    return None


def search(query: str, topics: dict[str, Topic]) -> Iterator[FoundLine]:
    """Find paragraphs with all words, and yield for each the line with the first word.

    A word may be the beginning of a word in the text. Capital letters do not matter,
    and `_` separates words.
    """
    patterns = [
        re.compile(r"(?<![^\W_])" + re.escape(word), re.IGNORECASE)
        for word in query.split()
    ]
    for name in topics:
        heading = ""
        for block in _blocks(readable(name, topics)):
            if title := HEADING.fullmatch(block):
                heading = title[1]
            if all(pattern.search(block) for pattern in patterns):
                first = patterns[0]
                hit = next(line for line in block.split("\n") if first.search(line))
                yield FoundLine(name, heading, hit.strip())


def _blocks(text: str) -> Iterator[str]:
    """Yield the headings, paragraphs and list items of a text.

    Each line of a table or of code is also a block.
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
