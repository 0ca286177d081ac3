"""Facts about the publisher: pyproject.toml -> the documents that state them.

The persons and addresses are in the table tool.boidsweep. A text in angle brackets
states what to enter, and remains in the documents until somebody enters a value.
`python -m docs.building.publisher` writes the documents. Only the standard library is
imported, because hatch_build.py loads this module before any package is installed.
"""

import json
import re
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
GROUP = "The boidsweep authors"
"""Author of the program until a person is entered."""
PLACEHOLDER = re.compile(r"<[^<>@]+>")
MARKED = re.compile(r"<!-- (?P<key>[a-z-]+) -->.*?<!-- end of (?P=key) -->", re.DOTALL)
CLONE = re.compile(r"(?<=git clone ).+?(?= boidsweep)")
RECIPE = re.compile(r'(?<=^  version: ").*(?="$)', re.MULTILINE)
FRONT = re.compile(r"\A---\n.*?^---\n", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Publisher:
    """The tables of pyproject.toml that name the package, its persons and addresses.

    Attributes
    ----------
    project : mapping
        The table `project`.
    facts : mapping
        The table `tool.boidsweep`.
    """

    project: Mapping[str, Any]
    facts: Mapping[str, Any]

    @property
    def released(self) -> date:
        """Date of the version."""
        return date.fromisoformat(self.facts["released"])

    @property
    def authors(self) -> list[dict[str, str]]:
        """The entered fields of each author with an entered name."""
        entered = [_entered(author) for author in self.facts["authors"]]
        names = {"given-names", "family-names"}
        return [author for author in entered if names <= author.keys()]

    @property
    def known(self) -> dict[str, Any]:
        """The facts that somebody has entered."""
        return _entered(self.facts)

    def metadata(self) -> dict[str, Any]:
        """Return the fields of a package that depend on entered facts."""
        authors = [{"name": _name(author)} for author in self.authors]
        urls = {"Repository": self.known.get("repository")}
        return {
            "authors": authors or [{"name": GROUP}],
            "urls": {name: url for name, url in urls.items() if url},
        }


def read_publisher(path: Path = ROOT / "pyproject.toml") -> Publisher:
    """Return the facts of a pyproject.toml."""
    tables = tomllib.loads(path.read_text(encoding="utf-8"))
    return Publisher(tables["project"], tables["tool"]["boidsweep"])


def _entered(facts: Mapping[str, Any]) -> dict[str, Any]:
    return {
        key: fact
        for key, fact in facts.items()
        if not (isinstance(fact, str) and PLACEHOLDER.fullmatch(fact))
    }


def _name(author: Mapping[str, str]) -> str:
    return f"{author['given-names']} {author['family-names']}"


def citation(publisher: Publisher, _: str) -> str:
    """Return CITATION.cff."""
    project = publisher.project
    keywords = ", ".join(project["keywords"])
    lines = [
        "cff-version: 1.2.0",
        f'title: "{project["name"]}: {project["description"]}"',
        'message: "If you use boidsweep in your research, please cite it, and the study'
        ' whose model you ran."',
        "type: software",
        "authors:",
        *(_author_of_citation(publisher.authors) or [f'  - name: "{GROUP}"']),
        f"version: {project['version']}",
        f"date-released: {publisher.released}",
        f"license: {project['license']}",
        f"keywords: [{keywords}]",
    ]
    if address := publisher.known.get("repository"):
        lines.append(f'repository-code: "{address}"')
    return "\n".join(lines) + "\n"


def _author_of_citation(authors: list[dict[str, str]]) -> list[str]:
    lines = []
    for author in authors:
        fields = dict(author)
        if "orcid" in fields:
            fields["orcid"] = f"https://orcid.org/{fields['orcid']}"
        first, *others = [f'{key}: "{text}"' for key, text in fields.items()]
        lines += [f"  - {first}", *(f"    {line}" for line in others)]
    return lines


def codemeta(publisher: Publisher, _: str) -> str:
    """Return codemeta.json."""
    project = publisher.project
    persons = [_person(author) for author in publisher.authors]
    described = {
        "@context": "https://w3id.org/codemeta/3.0",
        "@type": "SoftwareSourceCode",
        **{key: project[key] for key in ("name", "description", "version")},
        "datePublished": publisher.facts["released"],
        "author": persons or [{"@type": "Organization", "name": GROUP}],
        "license": f"https://spdx.org/licenses/{project['license']}",
        "keywords": project["keywords"],
        "programmingLanguage": "Python",
        "runtimePlatform": f"Python {project['requires-python']}",
        "softwareRequirements": project["dependencies"],
    }
    if address := publisher.known.get("repository"):
        described["codeRepository"] = address
    return json.dumps(described, indent=2, ensure_ascii=False) + "\n"


def _person(author: Mapping[str, str]) -> dict[str, Any]:
    person: dict[str, Any] = {
        "@type": "Person",
        "givenName": author["given-names"],
        "familyName": author["family-names"],
    }
    if "orcid" in author:
        person["@id"] = f"https://orcid.org/{author['orcid']}"
    if "affiliation" in author:
        person["affiliation"] = {
            "@type": "Organization",
            "name": author["affiliation"],
        }
    return person


def paper(publisher: Publisher, text: str) -> str:
    """Return the paper with the front matter that JOSS requires."""
    project = publisher.project
    authors: list[dict[str, str]] = publisher.facts["authors"]
    places = list(dict.fromkeys(author["affiliation"] for author in authors))
    lines = [
        "---",
        f"title: 'boidsweep: {project['description']}'",
        "tags:",
        *(f"  - {tag}" for tag in ("Python", *project["keywords"])),
        "authors:",
    ]
    for author in authors:
        lines.append(f'  - name: "{_name(author)}"')
        if "orcid" in author:
            lines.append(f'    orcid: "{author["orcid"]}"')
        lines.append(f"    affiliation: {places.index(author['affiliation']) + 1}")
    lines.append("affiliations:")
    for number, place in enumerate(places, 1):
        lines += [f'  - name: "{place}"', f"    index: {number}"]
    day = publisher.released
    lines += [f"date: {day.day} {day:%B %Y}", "bibliography: paper.bib", "---", ""]
    return marked(publisher, FRONT.sub(lambda _: "\n".join(lines), text))


def marked(publisher: Publisher, text: str) -> str:
    """Return a document with the present facts between its marks.

    A mark is a comment with the key of a fact. A placeholder is shown as code, because
    Markdown hides a text in angle brackets.
    """

    def fact(mark: "re.Match[str]") -> str:
        key = mark["key"]
        if key not in publisher.facts:
            return mark[0]
        value = publisher.facts[key]
        shown = f"`{value}`" if PLACEHOLDER.fullmatch(value) else value
        return f"<!-- {key} -->{shown}<!-- end of {key} -->"

    address = publisher.facts["repository"]
    return MARKED.sub(fact, CLONE.sub(lambda _: address, text))


def recipe(publisher: Publisher, text: str) -> str:
    """Return the conda recipe with the version."""
    return RECIPE.sub(publisher.project["version"], text)


WRITERS: Mapping[str, Callable[[Publisher, str], str]] = {
    "CITATION.cff": citation,
    "codemeta.json": codemeta,
    "docs/conda/recipe.yaml": recipe,
    "paper/paper.md": paper,
    **dict.fromkeys(
        (
            "CODE_OF_CONDUCT.md",
            "README.md",
            "SECURITY.md",
            "SUPPORT.md",
            "docs/help.md",
            "docs/install.md",
        ),
        marked,
    ),
}
"""The documents with facts about the publisher: facts, present text -> text."""


def main() -> None:
    """Write the documents."""
    publisher = read_publisher()
    for name, write in WRITERS.items():
        path = ROOT / name
        present = path.read_text(encoding="utf-8")
        path.write_text(write(publisher, present), encoding="utf-8")


if __name__ == "__main__":
    main()
