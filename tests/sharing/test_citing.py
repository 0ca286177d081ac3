"""What to cite: the program, the work behind a model, and a study."""

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

import sweep as package
from kernels.models import MODELS
from sweep.errors import ChoiceError
from sweep.published.bibliography import bibliography_of
from sweep.sharing.citing import Author, Work, behind_model, cite, program
from sweep.spec.strict_yaml import read_document
from sweep.tables.stored_study import StoredStudy
from tests import ROOT
from tests.commands import sweep
from tests.studies import OWN_SMALL, SMALL, launched

CITATION = read_document(ROOT / "CITATION.cff").value
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))[
    "project"
]
ENTRY = re.compile(r"@misc\{(\S+),\n((?:  \w+ = \{.*\},\n)+)\}")


def test_the_description_for_machines_is_that_of_the_program() -> None:
    """codemeta.json, CITATION.cff and pyproject.toml say the same."""
    meta = json.loads((ROOT / "codemeta.json").read_text(encoding="utf-8"))
    expected = {
        "@context": "https://w3id.org/codemeta/3.0",
        "@type": "SoftwareSourceCode",
        **{key: PROJECT[key] for key in ("name", "description", "version", "keywords")},
        "datePublished": CITATION["date-released"],
        "author": [
            {"@type": "Organization", "name": one["name"]}
            for one in CITATION["authors"]
        ],
        "license": f"https://spdx.org/licenses/{PROJECT['license']}",
        "programmingLanguage": "Python",
        "runtimePlatform": f"Python {PROJECT['requires-python']}",
        "softwareRequirements": PROJECT["dependencies"],
    }
    assert meta == expected
    for key in ("version", "license", "keywords"):
        assert CITATION[key] == PROJECT[key]


def test_the_program_is_cited_as_its_file_says() -> None:
    work = program()
    assert (work.title, work.version) == (CITATION["title"], CITATION["version"])
    assert work.authors == (Author("The boidsweep authors", group=True),)
    assert str(work.year) == CITATION["date-released"][:4]
    assert cite().works == (work,)


@pytest.mark.parametrize("model", MODELS)
def test_every_built_in_model_has_a_document_with_a_title(model: str) -> None:
    about = bibliography_of(model)
    assert about is not None
    assert about.title
    assert bool(about.authors) == (about.year is not None)
    assert all(name in about.source for name in about.authors[:1])


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    results = tmp_path_factory.mktemp("cited") / "results"
    launched(SMALL, results)
    launched(OWN_SMALL.replace("study: small", "study: own_one"), results)
    return results


def test_a_study_is_cited_with_its_model_and_its_content(results: Path) -> None:
    software, model, study = cite(StoredStudy("small", results)).works
    assert software == program()
    assert (model.authors, model.year) == ((Author("Q. C. Nguyen"),), 2024)
    assert re.fullmatch("Content sha256:[0-9a-f]{64}", study.note)
    assert study.title == "Study small: 6 trials of the model nguyen2024"
    assert study.not_stated == ["authors"]
    assert study.as_text() == (
        f"{study.title} ({study.year}). {study.note}. [not stated: authors]"
    )


def test_of_an_own_model_only_its_source_is_known(results: Path) -> None:
    work = behind_model(StoredStudy("own_one", results))
    assert (work.title, work.note) == ("The model drawn", "")
    assert work.as_text() == "The model drawn. [not stated: authors, year, source]"
    stated = replace(work, note="A. Nobody, in a letter")
    assert stated.not_stated == ["authors", "year"]


def test_the_formats_say_the_same(results: Path) -> None:
    found = package.cite(package.load("own_one", results))
    assert package.cite("own_one", results) == found
    assert package.cite(StoredStudy("own_one", results)) == found
    entries = ENTRY.findall(found.as_bibtex())
    csl = json.loads(found.as_json())
    assert [key for key, _ in entries] == [one["id"] for one in csl]
    assert [one["type"] for one in csl] == ["software", "report", "dataset"]
    assert "author = {{The boidsweep authors}}" in entries[0][1]
    assert r"title = {{Study own\_one: 6 trials" in entries[2][1]
    assert "author" not in entries[1][1]
    assert csl[0]["author"] == [{"literal": "The boidsweep authors"}]
    assert csl[0]["issued"] == {"date-parts": [[2026]]}
    text = found.as_text()
    assert text.count("not stated: authors") == 2
    assert found.works[2].note in text


def test_signs_of_tex_are_escaped() -> None:
    work = Work("k", "model", r"50 % of {a}_b \ ~^", (), None, "", "$x$ & #1")
    lines = work.as_bibtex().splitlines()
    assert lines[1] == (
        r"  title = {{50 \% of \{a\}\_b \textbackslash{}"
        r" \textasciitilde{}\textasciicircum{}}},"
    )
    assert lines[2] == r"  note = {\$x\$ \& \#1},"


def test_the_command_prints_one_format(results: Path, tmp_path: Path) -> None:
    there = f"--results={results}"
    text = sweep(tmp_path, "cite", "small", there)
    assert text.returncode == 0
    assert text.stdout.count("Q. C. Nguyen") == 1
    assert "model     Q. C. Nguyen (2024), report" in text.stdout
    assert (
        "@misc{nguyen2024,"
        in sweep(tmp_path, "cite", "small", "--bibtex", there).stdout
    )
    assert len(json.loads(sweep(tmp_path, "cite", "--json").stdout)) == 1
    assert sweep(tmp_path, "cite").stdout.startswith("software  The boidsweep authors")
    both = sweep(tmp_path, "cite", "--json", "--bibtex")
    assert (both.returncode, both.stdout) == (2, "")
    unknown = sweep(tmp_path, "cite", "smal", there)
    assert unknown.returncode == 2
    assert 'did you mean "small"' in unknown.stderr


def test_a_study_without_trials_cannot_be_cited(tmp_path: Path) -> None:
    study = launched(SMALL, tmp_path)
    for part in study.store.current_parts():
        study.store.discard(part)
    with pytest.raises(ChoiceError, match="no trials are stored"):
        cite(StoredStudy("small", tmp_path))
