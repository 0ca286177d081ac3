"""The Markdown files of the repository, as pages of the site.

A link from one document to another leads to its page, and one to any other file of the
repository to a copy of it. So documents read well on the site, in a checkout and in a
terminal, and no text stands twice.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from posixpath import normpath, relpath

ROOT = Path(__file__).parents[2]
COPIES = "_files"
"""The folder of copies in the sources of the site."""

WHOLE_FOLDER = "\n```{toctree}\n:hidden:\n:glob:\n*\n```\n"
"""For the list of the pages of a folder."""

FENCED = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)
LINK = re.compile(
    r"(?P<image>!?)\[(?P<text>[^\]]*)\]"
    r"\((?![a-z]+:)(?P<path>[^)#\s]*)(?P<chapter>#[^)\s]*)?\)"
)
NAMED = re.compile(
    r"^<!-- file: (?P<name>[^>]*) -->\n^(?P<fence>```+)(?P<language>\w+)$",
    re.MULTILINE,
)
ALSO = re.compile(r"^Also called: (?P<terms>[^.]*)\.$", re.MULTILINE)
"""The last paragraph of a page: the words by which readers search for the page."""
TAKEN = re.compile(r"^<!-- from: (?P<file>[^,>]+?)(?:, (?P<chapter>[^>]+))? -->$", re.M)


def read(path: str) -> str:
    """A document, by its path from the root of the repository."""
    return (ROOT / path).read_text(encoding="utf-8")


def chapters(text: str) -> dict[str, str]:
    """The text of each heading of the second level; of "" what stands before it."""
    first, *parts = re.split(r"^## (.*)\n", text, flags=re.MULTILINE)
    return {"": first} | dict(zip(parts[::2], parts[1::2], strict=True))


def pages_of_documents() -> dict[str, str]:
    """The page of each document: its path in the repository, and the name of its page.

    The README and GUIDE.md, which lists the guide, have none of their own. `from` in a
    comment takes a chapter of a document into a page.
    """
    within = {
        path.relative_to(ROOT).as_posix(): _page_in_docs(path)
        for path in sorted((ROOT / "docs").rglob("*.md"))
    }
    studies = {
        path.relative_to(ROOT).as_posix(): f"studies/{path.parent.name}"
        for path in sorted(ROOT.glob("experiments/*/README.md"))
    }
    return (
        within
        | studies
        | {
            "README.md": "index",
            "GUIDE.md": "guide/index",
            "examples/README.md": "examples",
            "CHANGELOG.md": "changes",
            "CONTRIBUTING.md": "contributing",
            "DEVELOPING.md": "developing",
            "SUPPORT.md": "support",
            "SECURITY.md": "security",
            "CODE_OF_CONDUCT.md": "conduct",
            "RELEASING.md": "releasing",
        }
    )


def _page_in_docs(path: Path) -> str:
    name = path.relative_to(ROOT / "docs").with_suffix("").as_posix()
    return name.removesuffix("README") + "index" if name.endswith("README") else name


def _indexed(also: re.Match[str]) -> str:
    """Return the paragraph of other names, with main entries of the index."""
    terms = " ".join(also["terms"].split()).split(", ")
    entries = ", ".join(f"!{term}" for term in terms)
    return f"```{{index}} {entries}\n```\n\n{also[0]}"


@dataclass
class Documents:
    """Documents as pages; `copies` are the files of the repository that they lead to,
    by the path of their copy.
    """

    pages: Mapping[str, str] = field(default_factory=pages_of_documents)
    copies: dict[str, Path] = field(default_factory=dict)

    def written(self) -> Iterator[tuple[str, str]]:
        """The name and the text of each page."""
        for path, page in self.pages.items():
            if path not in ("README.md", "GUIDE.md"):
                text = self.adapted(read(path), path, page)
                folder = PurePosixPath(path).match("docs/*/README.md")
                yield page, text + WHOLE_FOLDER * folder

    def adapted(self, text: str, path: str, page: str) -> str:
        """The text of the document `path` for its page: chapters of others are taken
        in, links lead within the site, blocks that are files bear their names, and the
        search of the site knows the page by its other names.
        """
        parts = FENCED.split(text)
        parts[::2] = [
            LINK.sub(lambda found: self._link(found, path, page), part)
            for part in parts[::2]
        ]
        caption = r"\g<fence>{code-block} \g<language>\n:caption: \g<name>"
        text = ALSO.sub(_indexed, NAMED.sub(caption, "".join(parts)))
        return self.with_chapters(text, page)

    def with_chapters(self, text: str, page: str) -> str:
        """The text of a page, with the chapters of documents that it takes in."""
        return TAKEN.sub(lambda found: self._taken(found, page), text)

    def _taken(self, found: re.Match[str], page: str) -> str:
        path, chapter = found["file"], found["chapter"] or ""
        text = chapters(read(path))[chapter]
        return self.adapted(text, path, page)

    def _link(self, found: re.Match[str], path: str, page: str) -> str:
        image, text, chapter = found["image"], found["text"], found["chapter"] or ""
        target = normpath(PurePosixPath(path).parent / found["path"])
        if not found["path"]:
            target = path
        if (ROOT / target / "README.md").is_file():
            target = normpath(f"{target}/README.md")
        if target in self.pages:
            place = self.pages[target]
            chapter = chapter if target != "README.md" else ""
            name = relpath(place, PurePosixPath(page).parent) + ".md"
            here = place == page and chapter
            return f"[{text}]({chapter if here else name + chapter})"
        file = ROOT / target
        if not file.is_file():
            return text
        self.copies[f"{COPIES}/{target}"] = file
        return f"{image}[{text}](/{COPIES}/{target})"
