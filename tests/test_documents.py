"""Documents lead to what is there: by links, by names of files, by lists of pages."""

import re
from pathlib import Path

import pytest

from tests import ROOT

DECISIONS = ROOT / "docs" / "decisions"
PAGES = sorted(set(DECISIONS.glob("*.md")) - {DECISIONS / "README.md"})
FOR_DEVELOPERS = [
    ROOT / "CONTRIBUTING.md",
    ROOT / "DEVELOPING.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
STUDIES = [*ROOT.glob("experiments/*/*.md"), *ROOT.glob("examples/*.md")]
DOCUMENTS = sorted({*FOR_DEVELOPERS, *ROOT.glob("*.md"), *STUDIES})
LINK = re.compile(r"\]\((?![a-z]+:)(?P<file>[^)#\s]*)(?:#(?P<chapter>[^)\s]*))?\)")
FOLDERS = "kernels|sweep|examples|experiments|docs|tests"
PLACE = re.compile(rf"\b(?:{FOLDERS})/(?:[\w-]+/)*(?:[\w-]+\.\w+)?")
TEST = re.compile(r"`(test_\w+\.py)`")
LISTED = re.compile(r"^- \[(.*)\]\((.*)\)$", re.MULTILINE)
ROW = re.compile(r"^\| ([^|]+?) \|", re.MULTILINE)
CHAPTERS = [
    "What we do",
    "Why",
    "What was measured",
    "What else was tried",
    "When to think again",
]


def name(path: Path) -> str:
    return path.relative_to(ROOT).as_posix()


def text(path: Path) -> str:
    return path.read_text(encoding="utf-8")


def anchors(path: Path) -> set[str]:
    """What the headings of a document can be linked by, as GitHub makes it."""
    headings = re.findall(r"^#+ (.*)$", text(path), re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


@pytest.mark.parametrize("path", DOCUMENTS, ids=name)
def test_links_lead_somewhere(path: Path) -> None:
    wrong = []
    for link in LINK.finditer(text(path)):
        target = path.parent / link["file"] if link["file"] else path
        chapter = link["chapter"]
        if not target.exists() or (chapter and chapter not in anchors(target)):
            wrong.append(link[0])
    assert wrong == []


def test_the_main_documents_have_links() -> None:
    """Else the pattern of a link has become one that finds none."""
    for path in (ROOT / "README.md", ROOT / "GUIDE.md", *FOR_DEVELOPERS[:2]):
        assert LINK.search(text(path))


@pytest.mark.parametrize("path", FOR_DEVELOPERS, ids=name)
def test_files_that_are_named_exist(path: Path) -> None:
    places, tests = PLACE.findall(text(path)), TEST.findall(text(path))
    assert [place for place in places if not (ROOT / place).exists()] == []
    assert [test for test in tests if not list(ROOT.glob(f"tests/**/{test}"))] == []


def test_each_decision_is_listed_once_by_its_title() -> None:
    listed = LISTED.findall(text(DECISIONS / "README.md"))
    titles = [(text(page).splitlines()[0], page.name) for page in PAGES]
    assert PAGES
    assert sorted((f"# {title}", page) for title, page in listed) == sorted(titles)


@pytest.mark.parametrize("path", PAGES, ids=name)
def test_a_decision_has_its_chapters_and_none_is_empty(path: Path) -> None:
    parts = re.split(r"^## (.*)$", text(path), flags=re.MULTILINE)
    assert parts[1::2] == CHAPTERS
    assert all(part.strip() for part in parts[2::2])


def test_a_word_has_one_row() -> None:
    rows = ROW.findall(text(ROOT / "docs" / "words.md"))
    words = [word for row in rows for word in row.split(", ") if word != "word"]
    assert len(words) > 20
    assert sorted(words) == sorted(set(words))
