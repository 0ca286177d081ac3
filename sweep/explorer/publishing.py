"""The publication that a supplement belongs to: title, authors, DOI, licence, caption.

The texts are options of a command, or come from a CITATION.cff.
"""

import re
from pathlib import Path
from typing import NamedTuple

from sweep.errors import ChoiceError
from sweep.sharing import NO_LICENCE, author_of
from sweep.spec import read_document

DOI = re.compile(r"10\.\d{4,9}/[!-~]+")
RESOLVERS = re.compile(r"(https?://(dx\.)?doi\.org/|doi:)", re.IGNORECASE)
"""Prefixes that people write before a DOI."""
CFF_KEYS = {
    "title": "title",
    "doi": "doi",
    "licence": "license",
    "caption": "abstract",
}
"""Keys of a CITATION.cff, by the names of the texts."""


class PaperTexts(NamedTuple):
    """The texts of a supplement, "" if they are not stated."""

    title: str = ""
    authors: tuple[str, ...] = ()
    doi: str = ""
    licence: str = ""
    caption: str = ""

    def or_else(self, other: "PaperTexts") -> "PaperTexts":
        """Return these texts, with the texts of `other` in place of missing texts."""
        stated = {name: text for name, text in self._asdict().items() if text}
        return other._replace(**stated)

    @property
    def licence_said(self) -> str:
        """The licence, or the sentence about a missing licence."""
        return self.licence or NO_LICENCE

    @property
    def reference(self) -> str:
        """A line for a list of references; "" without authors and DOI."""
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
    """Return the texts of a publication.

    Parameters
    ----------
    title : str, optional
    authors : tuple of str, optional
    doi : str, optional
        A DOI such as 10.1000/182, also with the address of a resolver before it.
    licence : str, optional
    caption : str, optional

    Raises
    ------
    ChoiceError
        If the DOI is not valid.
    """
    return PaperTexts(title, authors, _doi(doi), licence=licence, caption=caption)


def read_cff(path: Path) -> PaperTexts:
    """Return the texts of a CITATION.cff.

    The texts are title, authors, doi, license and abstract. The file may have further
    keys. Raises SpecError if the file cannot be read, and ChoiceError for a DOI that is
    not valid.
    """
    root = read_document(path)
    _ = root.mapping()
    texts = {
        name: node.text() if (node := root.get(key)) else ""
        for name, key in CFF_KEYS.items()
    }
    authors = root.get("authors")
    names = (
        tuple(author_of(author).name for author in authors.entries()) if authors else ()
    )
    return publication(authors=names, **texts)


def _doi(text: str) -> str:
    doi = RESOLVERS.sub("", text.strip(), count=1)
    if doi and not DOI.fullmatch(doi):
        raise ChoiceError(f'"{text}" is not a DOI; allowed: such as 10.1000/182')
    return doi
