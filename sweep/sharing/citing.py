"""Works to cite with a study: the program, the work behind the model, and the study.

CITATION.cff describes the program. The published.yaml of a publication describes a
built-in model. The stated source describes any other model.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, NamedTuple

from kernels.catalogue import Catalogue
from sweep.errors import ChoiceError
from sweep.published import bibliography_of
from sweep.sharing.content import content_hash
from sweep.spec import CITATION, Entry, read_document
from sweep.tables import StoredStudy

PROGRAM = "boidsweep"
TYPES = {
    "software": "software",
    "model": "report",
    "data": "dataset",
    "study": "dataset",
}
"""Type in CSL, the citation style language, of each kind of work."""
ESCAPED = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}
"""LaTeX for characters with a meaning in LaTeX."""


class Author(NamedTuple):
    """A person, or a group, whose name has no parts."""

    name: str
    group: bool = False


@dataclass(frozen=True)
class Work:
    """A work to cite.

    Attributes
    ----------
    key : str
        Key in a bibliography.
    kind : str
        One of TYPES.
    title : str
    authors : tuple of Author
        Empty if no authors are stated.
    year : int or None
        None if no year is stated.
    version : str
        "" without a version.
    note : str
        A further identification of the work: a source, a licence or a hash.
    """

    key: str
    kind: str
    title: str
    authors: tuple[Author, ...]
    year: int | None
    version: str
    note: str

    @property
    def not_stated(self) -> list[str]:
        """Names of the parts of the citation that are missing."""
        is_data = self.kind == "data"  # the source has authors and year
        missing = {
            "authors": not (self.authors or is_data),
            "year": self.year is None and not is_data,
            "source": self.kind in ("model", "data") and not self.note,
        }
        return [name for name, lacks in missing.items() if lacks]

    def as_text(self) -> str:
        """Return one sentence for a list of references, with the missing parts."""
        year = f" ({self.year})" if self.year is not None else ""
        version = f", version {self.version}" if self.version else ""
        note = f". {self.note}" if self.note else ""
        work = (
            f"{_listed(self.authors)}{year}: {self.title}{version}"
            if self.authors
            else f"{self.title}{version}{year}"
        )
        if self.authors and self.kind == "model":  # the note has authors and year
            work = f"{self.note}: {self.title}"
            note = ""
        missing = ", ".join(self.not_stated)
        return f"{work}{note}." + (f" [not stated: {missing}]" if missing else "")

    def as_bibtex(self) -> str:
        """Return an entry for BibTeX.

        The type is @misc, the only type that every style has.
        """
        fields = {
            "title": f"{{{_tex(self.title)}}}",
            "author": " and ".join(map(_tex_name, self.authors)),
            "year": "" if self.year is None else str(self.year),
            "version": _tex(self.version),
            "note": _tex(self.note),
        }
        lines = [f"  {name} = {{{text}}}," for name, text in fields.items() if text]
        return "\n".join([f"@misc{{{self.key},", *lines, "}"])

    def as_csl(self) -> dict[str, Any]:
        """Return an item for CSL, the citation style language, ready for JSON."""
        item: dict[str, Any] = {
            "id": self.key,
            "type": TYPES[self.kind],
            "title": self.title,
        }
        if self.authors:
            item["author"] = [{"literal": author.name} for author in self.authors]
        if self.year is not None:
            item["issued"] = {"date-parts": [[self.year]]}
        optional = {"version": self.version, "note": self.note}
        return item | {name: text for name, text in optional.items() if text}


@dataclass(frozen=True)
class Citation:
    """The works to cite, the program first."""

    works: tuple[Work, ...]

    def as_text(self) -> str:
        """Return one line per work, with the missing parts of the work."""
        return "\n".join(f"{work.kind:<9} {work.as_text()}" for work in self.works)

    def as_bibtex(self) -> str:
        """Return one BibTeX entry per work."""
        return "\n\n".join(work.as_bibtex() for work in self.works)

    def as_json(self) -> str:
        """Return the works as JSON for CSL, the citation style language."""
        works = [work.as_csl() for work in self.works]
        return json.dumps(works, indent=2, ensure_ascii=False)


def cite(study: StoredStudy | None = None) -> Citation:
    """Return the works to cite with a stored study, or for the program alone.

    The hash of the content identifies the study.

    Parameters
    ----------
    study : StoredStudy, optional
        Without a study, the program alone.

    Returns
    -------
    Citation

    Raises
    ------
    StoreError
        If the study cannot be read.
    ChoiceError
        If no trials of the study are stored.

    Examples
    --------
    >>> [work.kind for work in cite().works]
    ['software']
    """
    if study is None:
        return Citation((program(),))
    if not study.store.current_parts():
        raise ChoiceError("no trials are stored", study.name)
    return Citation((program(), behind_model(study), itself(study)))


def program() -> Work:
    """Return the program as a work to cite, from CITATION.cff."""
    root = read_document(CITATION)
    authors = tuple(map(author_of, root.child("authors").entries()))
    released = root.child("date-released").text()
    licence = root.child("license").text()
    return Work(
        key=PROGRAM,
        kind="software",
        title=root.child("title").text(),
        authors=authors,
        year=int(released[:4]),
        version=root.child("version").text(),
        note=f"Licence: {licence}",
    )


def behind_model(study: StoredStudy) -> Work:
    """Return the work behind the model of a study."""
    return behind(str(study.trials["model"].iloc[0]), study.known)


def behind(name: str, catalogue: Catalogue) -> Work:
    """Return the work behind a model of a catalogue, or the data of a recording."""
    if catalogue.models[name].events:
        return Work(
            key=_key(name),
            kind="data",
            title="Recorded data",
            authors=(),
            year=None,
            version="",
            note=catalogue.models[name].source,
        )
    paper = bibliography_of(name)
    return Work(
        key=_key(name),
        kind="model",
        title=paper.title if paper else f"The model {name}",
        authors=tuple(map(Author, paper.authors)) if paper else (),
        year=paper.year if paper else None,
        version="",
        note=paper.source if paper else catalogue.models[name].source,
    )


def itself(study: StoredStudy) -> Work:
    """Return the stored study as a work, with the hash of its results.

    The year of the work is the year of the newest stored part.
    """
    stored = sum(count for name, count in study.statuses().items() if name != "missing")
    return Work(
        key=_key(study.name),
        kind="study",
        title=f"Study {study.name}: {stored:,} trials of {origin_of(study)}",
        authors=(),
        year=stored_at(study).year,
        version="",
        note=f"Content sha256:{content_hash(study)}",
    )


def origin_of(study: StoredStudy) -> str:
    """Return the origin of the trials of a study, in words: a model or a recording."""
    name = str(study.trials["model"].iloc[0])
    return "a recording" if study.known.models[name].events else f"the model {name}"


def stored_at(study: StoredStudy) -> datetime:
    """Return the time of the newest stored part of a study, in UTC."""
    newest = max(part.name for part in study.store.current_parts())
    return datetime.fromtimestamp(int(newest[:20]) // 10**9, UTC)


def author_of(entry: Entry) -> Author:
    """Return an author of a CITATION.cff: a person, or a group with a name.

    Raises SpecError for an author without a name.
    """
    if name := entry.get("name"):
        return Author(name.text(), group=True)
    parts = [entry.get(key) for key in ("given-names", "family-names")]
    if not any(parts):
        raise entry.error("an author needs a name, or given-names and family-names")
    return Author(" ".join(part.text() for part in parts if part))


def _listed(authors: Sequence[Author]) -> str:
    *first, last = [author.name for author in authors]
    return f"{', '.join(first)} and {last}" if first else last


def _key(name: str) -> str:
    return name.replace("/", "-")


def _tex(text: str) -> str:
    return "".join(ESCAPED.get(sign, sign) for sign in text)


def _tex_name(author: Author) -> str:
    """Return the name of an author, for a group in braces that prevent a split."""
    return f"{{{_tex(author.name)}}}" if author.group else _tex(author.name)
