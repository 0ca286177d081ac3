"""Who wrote what a publication tests, and when: what a citation needs of it."""

from dataclasses import dataclass
from functools import cache

from sweep.spec.built_in import EXPERIMENTS
from sweep.spec.document import Entry
from sweep.spec.strict_yaml import read_document

FILE = "published.yaml"
LATEST = 9999
BIBLIOGRAPHIC = ("title", "source", "authors", "year")
"""Keys of a published.yaml."""


@dataclass(frozen=True)
class Bibliography:
    """A document: its title, its authors and year where they are known, and in words
    where it comes from.
    """

    title: str
    source: str
    authors: tuple[str, ...]
    year: int | None


def bibliography(root: Entry) -> Bibliography:
    """What a published.yaml says of its document. Raises SpecError."""
    authors, year = root.get("authors"), root.get("year")
    return Bibliography(
        title=root.child("title").text(),
        source=root.child("source").text(),
        authors=tuple(one.text() for one in authors.entries()) if authors else (),
        year=year.whole(0, LATEST) if year else None,
    )


@cache
def bibliography_of(model: str) -> Bibliography | None:
    """The document behind a model: that of the publication of its name, if there is
    one. Raises SpecError for a damaged file.
    """
    file = EXPERIMENTS / model / FILE
    return bibliography(read_document(file)) if file.is_file() else None
