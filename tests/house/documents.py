"""Documents lead to what is there: by links, by names of files, by lists of pages."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache
from itertools import pairwise

from tests.house.sources import Checkout, Document, Finding

MAIN = ("README.md", "GUIDE.md", "CONTRIBUTING.md", "DEVELOPING.md")
FOR_DEVELOPERS = (
    "CONTRIBUTING.md",
    "DEVELOPING.md",
    "RELEASING.md",
    "docs/**/*.md",
)
DOCUMENTS = (
    "*.md",
    "docs/**/*.md",
    "experiments/*/*.md",
    "examples/*.md",
    "paper/*.md",
)
DECISIONS = "docs/decisions/README.md"
WORDS = "docs/words.md"
TRUST = "docs/trust.md"
LINK = re.compile(r"\]\((?![a-z]+:)(?P<file>[^)#\s]*)(?:#(?P<chapter>[^)\s]*))?\)")
FOLDERS = "kernels|sweep|examples|experiments|docs|tests"
PLACE = re.compile(rf"\b(?:{FOLDERS})/(?:[\w-]+/)*(?:[\w-]+\.\w+)?")
TEST = re.compile(r"`(test_\w+\.py)`")
LISTED = re.compile(r"^- \[(.*)\]\((.*)\)$", re.MULTILINE)
CHAPTER = re.compile(r"^## (.*)$", re.MULTILINE)
ROW = re.compile(r"^\| ([^|]+?) \|", re.MULTILINE)
BULLET = re.compile(r"^- (.*?)(?=^- |^## |\Z)", re.MULTILINE | re.DOTALL)
PARTS = re.compile(r"(?P<sentence>.*?\.)\n  <!-- (?P<proof>.*?) -->\n*", re.DOTALL)
PROOF = re.compile(r"(?P<file>tests/[a-z0-9_/]+\.py)::(?P<name>(?:test|no)_\w+)")
"""A test, or a rule of this linter that says what no module does."""
CHAPTERS = [
    "What we do",
    "Why",
    "What was measured",
    "What else was tried",
    "When to think again",
]
FEWEST_WORDS = 20


@cache
def _anchors(document: Document) -> set[str]:
    """What its headings can be linked by, as GitHub makes it."""
    headings = re.findall(r"^#+ (.*)$", document.text, re.MULTILINE)
    plain = (re.sub(r"[^\w\- ]", "", heading.lower()) for heading in headings)
    return {heading.replace(" ", "-") for heading in plain}


def _relative(checkout: Checkout, document: Document, file: str) -> str | None:
    """The file that a link leads to; None if there is none."""
    path = checkout.root / document.name
    target = path.parent / file if file else path
    return str(target) if target.exists() else None


def links_lead_somewhere(checkout: Checkout) -> Iterator[Finding]:
    for document in map(checkout.document, checkout.files(*DOCUMENTS)):
        for link in LINK.finditer(document.text):
            target = _relative(checkout, document, link["file"])
            chapter = link["chapter"]
            if target is None or (
                chapter and chapter not in _anchors(checkout.document(target))
            ):
                yield document.finding(link.start(), f"leads nowhere: {link[0][2:-1]}")


def the_main_documents_have_links(checkout: Checkout) -> Iterator[Finding]:
    """Else the pattern of a link has become one that finds none."""
    for document in map(checkout.document, MAIN):
        if not LINK.search(document.text):
            yield document.finding(0, "has no link")


def files_that_are_named_exist(checkout: Checkout) -> Iterator[Finding]:
    for document in map(checkout.document, checkout.files(*FOR_DEVELOPERS)):
        for place in PLACE.finditer(document.text):
            if not (checkout.root / place[0]).exists():
                yield document.finding(place.start(), f"there is no {place[0]}")
        for test in TEST.finditer(document.text):
            if not checkout.files(f"tests/**/{test[1]}"):
                yield document.finding(test.start(), f"there is no {test[1]}")


def _pages(checkout: Checkout) -> list[Document]:
    """The pages of decisions."""
    names = checkout.files("docs/decisions/*.md")
    return [checkout.document(name) for name in names if name != DECISIONS]


def each_decision_is_listed_once_by_its_title(checkout: Checkout) -> Iterator[Finding]:
    listing, pages = checkout.document(DECISIONS), _pages(checkout)
    missing = Counter(
        (page.text.partition("\n")[0], page.name.rpartition("/")[2]) for page in pages
    )
    for line in LISTED.finditer(listing.text):
        title, page = line.groups()
        entry = (f"# {title}", page)
        if missing[entry] == 0:
            what = f"{page} has another title, is no page or is listed twice"
            yield listing.finding(line.start(), what)
        missing[entry] -= 1
    for (title, page), count in missing.items():
        if count > 0:
            yield listing.finding(0, f"does not list {page} as {title[2:]}")
    if not pages:
        yield listing.finding(0, "there is no page of a decision")


def a_decision_has_its_chapters_and_none_is_empty(
    checkout: Checkout,
) -> Iterator[Finding]:
    for page in _pages(checkout):
        chapters = list(CHAPTER.finditer(page.text))
        if [chapter[1] for chapter in chapters] != CHAPTERS:
            yield page.finding(0, f"its chapters are not {', '.join(CHAPTERS)}")
        ends = [*(chapter.start() for chapter in chapters), len(page.text)]
        for chapter, (_, end) in zip(chapters, pairwise(ends), strict=True):
            if not page.text[chapter.end() : end].strip():
                yield page.finding(chapter.start(), f"{chapter[1]} is empty")


def a_word_has_one_row(checkout: Checkout) -> Iterator[Finding]:
    document = checkout.document(WORDS)
    seen = set()
    for row in ROW.finditer(document.text):
        for word in row[1].split(", "):
            if word in seen:
                yield document.finding(row.start(), f"{word} has another row")
            if word != "word":
                seen.add(word)
    if len(seen) <= FEWEST_WORDS:
        yield document.finding(0, "has no words")


def a_sentence_on_trust_has_its_tests(checkout: Checkout) -> Iterator[Finding]:
    """Which exist; or it says why it has none."""
    page = checkout.document(TRUST)
    for bullet in BULLET.finditer(page.text):
        parts = PARTS.fullmatch(bullet[1])
        if parts is None:
            yield page.finding(bullet.start(), "a sentence without a test")
        elif not parts["proof"].startswith("none: "):
            for proof in parts["proof"].split():
                if not _exists(checkout, proof):
                    yield page.finding(bullet.start(), f"there is no test {proof}")


def _exists(checkout: Checkout, proof: str) -> bool:
    """Whether a test does, as file::name."""
    found = PROOF.fullmatch(proof)
    return found is not None and any(
        isinstance(node, ast.FunctionDef) and node.name == found["name"]
        for node in checkout.module(found["file"]).tree.body
    )


def only_what_is_not_promised_has_no_test(checkout: Checkout) -> Iterator[Finding]:
    page = checkout.document(TRUST)
    promised, _, not_promised = page.text.partition("## Not promised")
    for none in re.finditer("<!-- none", promised):
        yield page.finding(none.start(), "a promise without a test")
    if not not_promised:
        yield page.finding(0, "does not say what is not promised")
    if not_promised.count("<!-- none: ") != not_promised.count("\n- "):
        what = "not each sentence says why it has no test"
        yield page.finding(len(promised), what)


def every_file_of_attacks_stands_behind_a_sentence(
    checkout: Checkout,
) -> Iterator[Finding]:
    named = {found["file"] for found in PROOF.finditer(checkout.document(TRUST).text)}
    for name in checkout.files("tests/attacks/test_*.py"):
        if name not in named:
            yield Finding(name, 1, f"stands behind no sentence of {TRUST}")


RULES = (
    links_lead_somewhere,
    the_main_documents_have_links,
    files_that_are_named_exist,
    each_decision_is_listed_once_by_its_title,
    a_decision_has_its_chapters_and_none_is_empty,
    a_word_has_one_row,
    a_sentence_on_trust_has_its_tests,
    only_what_is_not_promised_has_no_test,
    every_file_of_attacks_stands_behind_a_sentence,
)
