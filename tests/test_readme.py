"""What the README and the guide show is true; tests/docs/test_blocks.py runs it."""

import re
from io import StringIO
from textwrap import dedent

import pytest
from ruamel.yaml import YAML

import sweep
from sweep.figures import KINDS
from sweep.spec.study import parse_spec
from tests import ROOT
from tests.studies import SMALL

README = (ROOT / "README.md").read_text(encoding="utf-8")
DEVELOPING = (ROOT / "DEVELOPING.md").read_text(encoding="utf-8")
GUIDE = "".join(
    page.read_text(encoding="utf-8") for page in sorted(ROOT.glob("docs/guide/*.md"))
)
SPECS = re.findall(r"```yaml\n(.*?)```", README + GUIDE, re.DOTALL)
"""Whole specs, and pieces of one."""
OF_NO_FILE = [
    text for text in SPECS if not re.search(r"\.csv|\./|^---$", text, re.MULTILINE)
]
"""Without those that name a file, which tests/docs/test_blocks.py writes first."""


@pytest.mark.parametrize("text", OF_NO_FILE, ids=range(len(OF_NO_FILE)))
def test_each_spec_and_each_piece_of_one_is_valid(text: str) -> None:
    """A piece is valid together with a small spec, whose keys it replaces."""
    yaml = YAML()
    whole = yaml.load(text)
    if "study" not in whole:
        whole = yaml.load(SMALL) | whole
    written = StringIO()
    yaml.dump(whole, written)
    parse_spec(written.getvalue())


def test_its_map_of_the_house_is_that_of_the_package() -> None:
    """Whose completeness tests/house/packages.py checks."""
    lines = dedent(sweep.__doc__ or "").split("\n")
    assert {line.strip() for line in lines if re.match(r"    \w", line)} <= {
        line.strip() for line in DEVELOPING.split("\n")
    }


KINDS_OF_FIGURES = re.compile(r"The kinds are\n(.*?)\n\n", re.DOTALL)
NUMBERS = ["zero", "one", "two", "three", "four", "five", "six", "seven", "eight"]
NUMBERS += ["nine", "ten", "eleven", "twelve", "thirteen", "fourteen", "fifteen"]


def test_the_guide_names_all_kinds_of_figures() -> None:
    listed = KINDS_OF_FIGURES.search(GUIDE)
    assert listed
    assert set(re.findall(r"`(\w+)`", listed[1])) == set(KINDS)


def test_the_readme_counts_the_studies_and_those_that_are_judged() -> None:
    """As its table of verdicts does."""
    rows = re.findall(r"^\| (\w+) \| (\d+) \|", README, re.MULTILINE)
    studies = {path.parent.name for path in ROOT.glob("experiments/*/published.yaml")}
    assert {name for name, _ in rows} == studies
    judged = NUMBERS[sum(count != "0" for _, count in rows)]
    others = NUMBERS[sum(count == "0" for _, count in rows)]
    words = " ".join(README.split())
    count = NUMBERS[len(studies)]
    assert f"{count.capitalize()} published studies are built in." in words
    assert f"[statements of {judged} of them](#the-studies)" in words
    assert f"Of the other {others} only" in words
    assert f"runs what is missing of all {count}" in words
    listed = re.findall(r"^\| \[(\w+)\]\(experiments", README, re.MULTILINE)
    assert set(listed) == studies


def test_no_text_counts_what_is_not_counted_by_a_test() -> None:
    """Stories, examples and demos are without a number: they are seen at once."""
    pages = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")]
    counted = re.compile(
        rf"\b(?:{'|'.join(NUMBERS)}) (?:stories|tutorials|notebooks|demos"
        r"|models of (?:other )?papers|built-in studies)\b",
        re.IGNORECASE,
    )
    found = {
        path.name: counted.findall(path.read_text(encoding="utf-8")) for path in pages
    }
    del found["CHANGELOG.md"]  # it says what was
    assert {name: one for name, one in found.items() if one} == {}


def test_make_help_explains_every_target() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = re.search(r"\.PHONY: (.*)", makefile)
    assert targets is not None
    for target in targets[1].split():
        assert re.search(rf"^{target}:.*## ", makefile, re.MULTILINE), target
