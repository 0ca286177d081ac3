"""Persons and addresses are entered once, in pyproject.toml."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from docs.building.publisher import GROUP, WRITERS, Publisher, read_publisher
from sweep.sharing.citing import Author, author_of
from sweep.spec.strict_yaml import read_document
from tests import ROOT

PUBLISHER = read_publisher()
ENTERED = {
    "released": "2027-02-03",
    "repository": "https://example.org/boidsweep",
    "contact": "help@example.org",
    "funding": "none",
    "users": "none",
    "ai-usage": "none",
    "authors": [
        {
            "given-names": "Ada",
            "family-names": "Example",
            "affiliation": "University of Examples, Utopia",
            "orcid": "0000-0001-2345-6789",
        },
        {
            "given-names": "Ben",
            "family-names": "Test",
            "affiliation": "University of Examples, Utopia",
            "orcid": "<ORCID of the author>",
        },
    ],
}
FILLED = Publisher({**PUBLISHER.project, "version": "9.8.7"}, ENTERED)


def written(name: str, publisher: Publisher = FILLED) -> str:
    present = (ROOT / name).read_text(encoding="utf-8")
    return WRITERS[name](publisher, present)


@pytest.mark.parametrize("name", WRITERS)
def test_a_document_states_what_pyproject_states(name: str) -> None:
    """Else `make documents` was not run."""
    assert written(name, PUBLISHER) == (ROOT / name).read_text(encoding="utf-8")


@pytest.mark.parametrize("name", WRITERS)
def test_writing_again_changes_nothing(name: str) -> None:
    once = written(name)
    assert WRITERS[name](FILLED, once) == once
    for fact in PUBLISHER.facts.values():
        assert not (isinstance(fact, str) and fact.startswith("<") and fact in once)


def test_each_fact_that_is_to_be_entered_has_a_document() -> None:
    texts = "".join(written(name) for name in WRITERS)
    assert ENTERED.keys() == PUBLISHER.facts.keys()
    for fact in ("repository", "contact"):
        assert str(ENTERED[fact]) in texts
    for fact in ("users", "funding", "ai-usage"):
        assert f"<!-- {fact} -->none<!-- end of {fact} -->" in texts


def test_entered_authors_are_cited(tmp_path: Path) -> None:
    file = tmp_path / "CITATION.cff"
    file.write_text(written("CITATION.cff"), encoding="utf-8")
    root = read_document(file)
    authors = [author_of(entry) for entry in root.child("authors").entries()]
    assert authors == [Author("Ada Example"), Author("Ben Test")]
    assert root.value["authors"][0]["orcid"].endswith("/0000-0001-2345-6789")
    assert "orcid" not in root.value["authors"][1]
    assert root.value["version"] == "9.8.7"
    assert root.value["repository-code"] == ENTERED["repository"]
    meta = json.loads(written("codemeta.json"))
    assert [one["familyName"] for one in meta["author"]] == ["Example", "Test"]
    assert meta["codeRepository"] == ENTERED["repository"]
    assert meta["author"][0]["affiliation"]["name"] in written("paper/paper.md")


def test_an_affiliation_is_listed_once_in_the_paper() -> None:
    front = written("paper/paper.md").split("---\n")[1]
    assert front.count("University of Examples") == 1
    assert front.count("affiliation: 1") == 2
    assert "date: 3 February 2027" in front
    assert '"0000-0001-2345-6789"' in front


def test_a_package_names_only_what_was_entered() -> None:
    assert PUBLISHER.metadata() == {"authors": [{"name": GROUP}], "urls": {}}
    assert FILLED.metadata() == {
        "authors": [{"name": "Ada Example"}, {"name": "Ben Test"}],
        "urls": {"Repository": "https://example.org/boidsweep"},
    }


def test_a_person_without_a_name_is_no_author() -> None:
    nameless = [{"given-names": "Ada", "family-names": "<family name>"}]
    assert replace(FILLED, facts={**ENTERED, "authors": nameless}).authors == []


def test_a_placeholder_says_what_to_enter_and_stands_under_a_comment() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    above = text.partition("\n[tool.boidsweep]\n")[0]
    assert above.endswith("writes all documents that name them.")
    facts = tomllib.loads(text)["tool"]["boidsweep"]
    missing = [key for key in facts if key not in PUBLISHER.known]
    assert all(len(str(facts[key]).split()) > 2 for key in missing)
