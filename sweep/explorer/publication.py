"""What a supplement says of the publication that it belongs to: title, authors, DOI,
licence, caption. They are given one by one, or in a CITATION.cff.
"""

import re
from pathlib import Path
from typing import NamedTuple

from sweep.errors import ChoiceError
from sweep.sharing.citing import author_of
from sweep.sharing.stranger import NO_LICENCE
from sweep.spec.strict_yaml import read_document

DOI = re.compile(r"10\.\d{4,9}/[!-~]+")
RESOLVERS = re.compile(r"(https?://(dx\.)?doi\.org/|doi:)", re.IGNORECASE)
"""What people write before a DOI."""
CFF_KEYS = {
    "title": "title",
    "doi": "doi",
    "licence": "license",
    "caption": "abstract",
}
"""Of each text its key in a CITATION.cff."""


class PaperTexts(NamedTuple):
    """The texts of a supplement, "" where they are not stated."""

    title: str = ""
    authors: tuple[str, ...] = ()
    doi: str = ""
    licence: str = ""
    caption: str = ""

    def or_else(self, other: "PaperTexts") -> "PaperTexts":
        """These texts, and those of `other` where one is missing."""
        stated = {name: text for name, text in self._asdict().items() if text}
        return other._replace(**stated)

    @property
    def licence_said(self) -> str:
        """The licence, or that none is stated."""
        return self.licence or NO_LICENCE

    @property
    def reference(self) -> str:
        """One line for a list of references; "" where neither authors nor a DOI are
        stated.
        """
        if not (self.authors or self.doi):
            return ""
        who = f"{', '.join(self.authors)}: " if self.authors else ""
        where = f". https://doi.org/{self.doi}" if self.doi else ""
        return f"{who}{self.title}{where}"


def publication(
    title: str = "",
    authors: tuple[str, ...] = (),
    doi: str = "",
    licence: str = "",
    caption: str = "",
) -> PaperTexts:
    """The texts of a publication. Raises ChoiceError for a DOI that is none."""
    return PaperTexts(title, authors, _doi(doi), licence, caption)


def read_cff(path: Path) -> PaperTexts:
    """The texts of a CITATION.cff: its title, authors, doi, license and abstract; it
    may have other keys. Raises SpecError where it cannot be read, and ChoiceError for a
    DOI that is none.
    """
    root = read_document(path)
    _ = root.mapping()
    texts = {
        name: found.text() if (found := root.get(key)) else ""
        for name, key in CFF_KEYS.items()
    }
    authors = root.get("authors")
    names = tuple(author_of(one).name for one in authors.entries()) if authors else ()
    return publication(authors=names, **texts)


def _doi(text: str) -> str:
    found = RESOLVERS.sub("", text.strip(), count=1)
    if found and not DOI.fullmatch(found):
        raise ChoiceError(f'DOI "{text}" is none; allowed: as 10.1000/182')
    return found
