"""The page: what it says, that it is well formed, that its links lead somewhere and
that texts are escaped.
"""

import json
import math
import re
from datetime import date
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import pytest
from playwright.sync_api import Browser

from sweep.analysis import mean_estimate
from sweep.cli.progress import ProgressBar
from sweep.published.claims import Claim
from sweep.published.estimates import Measured
from sweep.published.judging import Row
from sweep.published.publications import read_all
from sweep.published.reproducing import reproduce
from sweep.published.scorecard import (
    Page,
    noticeable_text,
    ours_text,
    published_text,
    sentence,
    trials_text,
)
from sweep.published.scorecard_html import as_html
from sweep.published.verdicts import Above, Below, Expectation, Value, Within, judge
from sweep.workers.executors import Serial
from tests import ROOT
from tests.publications import PUBLISHED, experiments
from tests.web.test_axe import found

VOID = {"meta", "img", "br"}


class Reader(HTMLParser):
    """Checks that tags are closed in order, and keeps links, anchors and text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.links: list[str] = []
        self.anchors: list[str] = []
        self.images: list[str] = []
        self.text: list[str] = []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.links += [given["href"] or ""] if "href" in given else []
        self.anchors += [given["id"] or ""] if "id" in given else []
        self.images += [given["src"] or ""] if "src" in given else []
        assert tag not in ("script", "link")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] != "style":
            self.text.append(data)


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results with the pages of a publication in which one claim fails."""
    folder = tmp_path_factory.mktemp("page")
    wrong = """
  - id: wrong
    where: "Figure 2 & <3>"
    says: "boids start at 3 px/step"
    kind: reading
    registered: 2024-03-01
    spec: small
    measure: {mean: speed, frame: 0, for: {separation_weight: 1}}
    expect: {value: 3, margin: 0.1, because: "a <guess>"}
    statement: speed
    alternatives: "a <b>bound</b>"
    looked: after
contradictions:"""
    publications = read_all(
        experiments(folder, PUBLISHED.replace("\ncontradictions:", wrong)), quick=False
    )
    reproduce(publications, folder / "results", Serial(), ProgressBar)
    return folder / "results"


@pytest.fixture(scope="module")
def html(root: Path) -> Reader:
    return Reader((root / "scorecard.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def markdown(root: Path) -> str:
    return (root / "scorecard.md").read_text(encoding="utf-8")


def test_links_and_images_of_the_page_exist(html: Reader, root: Path) -> None:
    assert len(html.links) > 5
    for link in html.links:
        if link.startswith("#"):
            assert link[1:] in html.anchors
        else:
            assert (root / unquote(link)).exists(), link
    assert html.images == ["figures/scorecard-tiny.png", "figures/tiny/curves.png"]


def test_links_of_the_markdown_exist(markdown: str, root: Path) -> None:
    links = re.findall(r"\]\(([^)]+)\)", markdown)
    assert "figures/tiny/curves.pdf" in links
    for link in links:
        assert (
            f'id="{link[1:]}"' in markdown
            if link.startswith("#")
            else (root / link).exists()
        )


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_on_a_page_with_a_watermark(
    browser: Browser, tmp_path: Path, scheme: Any
) -> None:
    """A watermark is no text that has to be read."""
    page = browser.new_page(color_scheme=scheme)
    page.set_content(as_html(Page(tmp_path, [], "quick", "<b>quick</b> scale")))
    drawn = "getComputedStyle(document.querySelector('.watermark'), '::before').content"
    assert page.evaluate(drawn) == '"<b>quick</b> scale"'
    assert found(page) == []
    page.close()


@pytest.mark.parametrize("kind", ["html", "markdown"])
def test_both_pages_say_the_same(html: Reader, markdown: str, kind: str) -> None:
    said = " ".join(html.text) if kind == "html" else re.sub(r"\\(.)", r"\1", markdown)
    for words in (
        "A tiny study",
        "Nobody (2024), <nowhere>",
        "Figure 2, frame 0",
        "0.765; mean of 100 trials",
        "2 of 3 claims are counted and tested together",
        "each at 0.05/2 = 0.025.",
        "Boids start at 3 px/step.",
        "is completely outside the margin.",
        "reading, registered 2024-03-01, such results first seen after that, statement"
        " speed; also tried: a <b>bound</b>",
        "tiny: no mutants were tried",
        "3; margin 0.1: a <guess>",
        "No machine is named.",
        "It is <b>fast</b>.",
        "the text says speed 3, the curves start at 0.77",
        "Speed & dispersion",
        "kernels_sha",
    ):
        assert words in said, words


def test_no_text_of_a_document_is_markup(root: Path, markdown: str) -> None:
    text = (root / "scorecard.html").read_text(encoding="utf-8")
    assert "<b>" not in text
    assert "<nowhere>" not in text
    assert "<b>" not in markdown
    rows = [line for line in markdown.splitlines() if line.startswith("|")]
    # The table of counts, and that of claims.
    bars = [len(re.findall(r"(?<!\\)\|", row)) for row in rows]
    assert set(bars) == {8, 9}
    assert bars.count(8) == 3


def test_what_is_not_reproduced_comes_first_and_every_verdict_has_its_word(
    html: Reader, markdown: str
) -> None:
    said = " ".join(html.text)
    assert (
        said.index("Boids start at 3")
        < said.index("The rule")
        < said.index("Boids start at 0.765")
    )
    rows = [line for line in markdown.splitlines() if line.startswith("| <a")]
    assert [re.findall(r"\*\*(.*?)\*\*", row)[0] for row in rows] == [
        "refuted",
        "not testable",
        "confirmed",
    ]
    assert "| tiny | 1 | 0 | 0 | 1 | 0 | 1 |" in markdown


def row(expect: Expectation, *values: float, left_out: int = 0) -> Row:
    found = mean_estimate(np.array(values, np.float64))
    day = date(2024, 3, 1)
    claim = Claim("a", "b", "c", "number", "a", day, "s", expect=expect)
    count = len(values)
    return Row(
        claim,
        judge(found, expect, 2, count),
        Measured(found, f"{count}", count, left_out),
    )


@pytest.mark.parametrize(
    ("expect", "text"),
    [
        (Value(57.3, 0.005), "57.30"),
        (Value(57.3, 0.05, 3), "57.3; mean of 3 trials"),
        (Value(1200.0, 50.0), "1200"),
        (Value(57.25), "57.25"),
        (Value(2.0, 0.0, None, 0.5, "a guess"), "2; margin 0.5: a guess"),
        (Above(0.5), "above 0.5"),
        (Below(0.5), "below 0.5"),
        (Within(-1.0, 1.0), "-1 to 1"),
    ],
)
def test_published_numbers_look_as_published(expect: Expectation, text: str) -> None:
    assert published_text(row(expect, 1.0, 2.0)) == text


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ((57.0, 57.2, 57.4), "57.20 (56.70 to 57.70)"),
        ((1000.0, 3000.0, 5000.0), "3000 (-1968 to 7968)"),
        ((2.0, 2.0), "2"),
        ((3e-12, 4e-12, 5e-12), "4.0e-12 (1.5e-12 to 6.5e-12)"),
        ((3.0,), "3"),
        ((), ""),
    ],
)
def test_ours_stand_to_the_second_figure_of_their_interval(
    values: tuple[float, ...], text: str
) -> None:
    assert ours_text(row(Value(1.0), *values)) == text


def test_what_was_left_out_is_counted() -> None:
    assert trials_text(row(Value(1.0), 1.0, 2.0, left_out=1234)) == "2 (1,234 left out)"
    assert trials_text(row(Value(1.0), 1.0, 2.0)) == "2"


def test_a_weak_test_shows_how_weak() -> None:
    """Student's t of one degree of freedom at 1 - 0.025/2 is 25.452; the standard error
    of 1 and 2 is 0.5.
    """
    assert noticeable_text(row(Value(1.0), 1.0, 2.0)) == f"{25.452 * 0.5:.4g}"
    assert noticeable_text(row(Value(1.0), math.nan)) == ""


def test_sentences() -> None:
    assert [sentence(text) for text in ("a b", "A.", "why?")] == ["A b.", "A.", "Why?"]


@pytest.fixture(scope="module")
def scorecard(root: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(
        (root / "scorecard.json").read_text(encoding="utf-8"),
        parse_constant=lambda name: pytest.fail(f"{name} is no JSON"),
    )
    return found


def test_machines_read_what_the_page_says(
    scorecard: dict[str, Any], markdown: str
) -> None:
    first, untestable, wrong = scorecard["rows"]
    assert (first["id"], first["study"], first["statement"]) == (
        "start-speed",
        "tiny",
        "start-speed",
    )
    assert [one["status"] for one in scorecard["rows"]] == [
        "confirmed",
        "not testable",
        "refuted",
    ]
    shown = f"{first['ours']:.3f} ({first['interval'][0]:.3f} to "
    assert shown in markdown.replace("\\", "")
    low, high = first["simultaneous"]
    assert low < first["interval"][0] < first["interval"][1] < high
    assert first["noticeable"] == pytest.approx((high - low) / 2)
    assert (first["expect"], first["published"], first["margin"]) == (
        "value",
        0.765,
        0.2,
    )
    assert (first["trials"], first["weak"], first["mutants"]) == (8, False, None)
    assert wrong["alternatives"] == "a <b>bound</b>"
    assert wrong["unverified"] == ""
    for key in ("ours", "interval", "published", "margin", "noticeable", "looked"):
        assert untestable[key] is None
    (tiny,) = scorecard["documents"]
    assert (tiny["family"], tiny["mutants"], scorecard["scale"]) == (2, None, "full")
    counts = dict.fromkeys(tiny["statements"], 0)
    assert tiny["statements"] == counts | {
        "confirmed": 1,
        "refuted": 1,
        "not testable": 1,
    }


def test_the_format_is_described_key_by_key(scorecard: dict[str, Any]) -> None:
    """Each key of the file has a row in docs/scorecard.md, and each row is a key."""
    text = (ROOT / "docs" / "scorecard.md").read_text(encoding="utf-8")
    parts = re.split(r"\n## .*\n", text)
    described = [
        [
            key
            for cell in re.findall(r"^\| (`.*?) \|", part, re.MULTILINE)
            for key in re.findall(r"`(\w+)`", cell)
        ]
        for part in parts
    ]
    assert described == [
        list(scorecard),
        list(scorecard["documents"][0]),
        list(scorecard["rows"][0]),
    ]
