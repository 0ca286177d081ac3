"""Title, authors, year and source of a publication, for citations."""

from dataclasses import dataclass
from functools import cache

from sweep.spec import EXPERIMENTS, Entry, read_document

FILE = "published.yaml"
LATEST = 9999
BIBLIOGRAPHIC = ("title", "source", "authors", "year")
"""Keys of a published.yaml."""


@dataclass(frozen=True)
class Bibliography:
    """Title and source of a publication, and the authors and year if known.

    `source` is the place of publication in words.
    """

    title: str
    source: str
    authors: tuple[str, ...]
    year: int | None


def bibliography(root: Entry) -> Bibliography:
    """Return the bibliography of a published.yaml.

    Raises SpecError.
    """
    authors = root.get("authors")
    year = root.get("year")
    return Bibliography(
        title=root.child("title").text(),
        source=root.child("source").text(),
        authors=tuple(author.text() for author in authors.entries()) if authors else (),
        year=year.whole(0, LATEST) if year else None,
    )


@cache
def bibliography_of(model: str) -> Bibliography | None:
    """Return the bibliography of the publication that has the name of a model.

    Return None without such a publication. Raises SpecError for a damaged file.
    """
    file = EXPERIMENTS / model / FILE
    return bibliography(read_document(file)) if file.is_file() else None
