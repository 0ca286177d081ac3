"""What to cite with a study: the program, the work behind its model, the study itself.

The program is described by CITATION.cff, a built-in model by the published.yaml of its
document, and any other model by what its author wrote as its source.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, NamedTuple

from kernels.catalogue import Catalogue
from sweep.errors import ChoiceError
from sweep.published.bibliography import bibliography_of
from sweep.sharing.content import content_hash
from sweep.spec.built_in import CITATION
from sweep.spec.document import Entry
from sweep.spec.strict_yaml import read_document
from sweep.tables.stored_study import StoredStudy

PROGRAM = "boidsweep"
TYPES = {"software": "software", "model": "report", "study": "dataset"}
"""Of what is cited: its type in CSL, the citation style language."""
ESCAPED = {
    **{sign: f"\\{sign}" for sign in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
}


class Author(NamedTuple):
    """A person, or a group, whose name has no parts."""

    name: str
    group: bool = False


@dataclass(frozen=True)
class Work:
    """Something to cite, and in words what is `not_stated` of it.

    key      its key in a bibliography
    kind     one of TYPES
    title    its title
    authors  its authors, none where they are not stated
    year     its year; None where it is not stated
    version  its version, "" where it has none
    note     what else tells it from others: where it comes from, or a hash
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
        """What a reader of the citation would look for in vain."""
        missing = {
            "authors": not self.authors,
            "year": self.year is None,
            "source": self.kind == "model" and not self.note,
        }
        return [name for name, lacks in missing.items() if lacks]

    def as_text(self) -> str:
        """One sentence for a list of references, and what it lacks."""
        year = f" ({self.year})" if self.year is not None else ""
        version = f", version {self.version}" if self.version else ""
        note = f". {self.note}" if self.note else ""
        work = (
            f"{_listed(self.authors)}{year}: {self.title}{version}"
            if self.authors
            else f"{self.title}{version}{year}"
        )
        missing = ", ".join(self.not_stated)
        return f"{work}{note}." + (f" [not stated: {missing}]" if missing else "")

    def as_bibtex(self) -> str:
        """An entry for BibTeX. @misc is the one type that every style has."""
        fields = {
            "title": f"{{{_tex(self.title)}}}",
            "author": " and ".join(_tex_name(one) for one in self.authors),
            "year": "" if self.year is None else str(self.year),
            "version": _tex(self.version),
            "note": _tex(self.note),
        }
        lines = [f"  {name} = {{{text}}}," for name, text in fields.items() if text]
        return "\n".join([f"@misc{{{self.key},", *lines, "}"])

    def as_csl(self) -> dict[str, Any]:
        """The same for CSL, the citation style language, ready for JSON."""
        said: dict[str, Any] = {
            "id": self.key,
            "type": TYPES[self.kind],
            "title": self.title,
        }
        if self.authors:
            said["author"] = [{"literal": one.name} for one in self.authors]
        if self.year is not None:
            said["issued"] = {"date-parts": [[self.year]]}
        others = {"version": self.version, "note": self.note}
        return said | {name: text for name, text in others.items() if text}


@dataclass(frozen=True)
class Citation:
    """The works to cite, the program first."""

    works: tuple[Work, ...]

    def as_text(self) -> str:
        """A line a work, and what of it is not stated."""
        return "\n".join(f"{work.kind:<9} {work.as_text()}" for work in self.works)

    def as_bibtex(self) -> str:
        """An entry a work."""
        return "\n\n".join(work.as_bibtex() for work in self.works)

    def as_json(self) -> str:
        """A list for CSL."""
        works = [work.as_csl() for work in self.works]
        return json.dumps(works, indent=2, ensure_ascii=False)


def cite(study: StoredStudy | None = None) -> Citation:
    """What to cite with a stored study, or for the program alone.

    The study is told from others by the hash of its content. Raises StoreError where
    it cannot be read, ChoiceError where nothing of it is stored.
    """
    if study is None:
        return Citation((program(),))
    if not study.store.current_parts():
        raise ChoiceError("no trials of it are stored", study.name)
    return Citation((program(), behind_model(study), itself(study)))


def program() -> Work:
    """This program, as CITATION.cff has it."""
    root = read_document(CITATION)
    authors = tuple(author_of(one) for one in root.child("authors").entries())
    released, licence = (root.child(key).text() for key in ("date-released", "license"))
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
    """The work behind the model of a study."""
    return behind(str(study.trials["model"].iloc[0]), study.known)


def behind(name: str, known: Catalogue) -> Work:
    """The work behind the model of this name."""
    about = bibliography_of(name)
    if about is None:
        title, source = f"The model {name}", known.models[name].source
        return Work(_key(name), "model", title, (), None, "", source)
    authors = tuple(map(Author, about.authors))
    return Work(_key(name), "model", about.title, authors, about.year, "", about.source)


def itself(study: StoredStudy) -> Work:
    """The stored study, with the hash of what it computed, and its last year."""
    stored = sum(count for name, count in study.statuses().items() if name != "missing")
    return Work(
        key=_key(study.name),
        kind="study",
        title=f"Study {study.name}: {stored:,} trials of the model"
        f" {study.trials['model'].iloc[0]}",
        authors=(),
        year=stored_at(study).year,
        version="",
        note=f"Content sha256:{content_hash(study)}",
    )


def stored_at(study: StoredStudy) -> datetime:
    """When the newest part of a study was stored."""
    newest = max(part.name for part in study.store.current_parts())
    return datetime.fromtimestamp(int(newest[:20]) // 10**9, UTC)


def author_of(entry: Entry) -> Author:
    """A person, or a group with a name, of a CITATION.cff. Raises SpecError for one
    without a name.
    """
    if name := entry.get("name"):
        return Author(name.text(), group=True)
    parts = [entry.get(key) for key in ("given-names", "family-names")]
    if not any(parts):
        raise entry.error("an author needs a name, or given-names and family-names")
    return Author(" ".join(part.text() for part in parts if part))


def _listed(authors: Sequence[Author]) -> str:
    *others, last = [one.name for one in authors]
    return f"{', '.join(others)} and {last}" if others else last


def _key(name: str) -> str:
    return name.replace("/", "-")


def _tex(text: str) -> str:
    return "".join(ESCAPED.get(sign, sign) for sign in text)


def _tex_name(author: Author) -> str:
    """The name of a group in braces, so that it is not taken apart."""
    return f"{{{_tex(author.name)}}}" if author.group else _tex(author.name)
