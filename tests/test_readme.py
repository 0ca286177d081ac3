"""What the README and the guide show is true; tests/docs/test_blocks.py runs it."""

import re
from textwrap import dedent

import pytest

import sweep
from sweep.spec.study import parse_spec
from tests import ROOT
from tests.studies import SMALL

README = (ROOT / "README.md").read_text(encoding="utf-8")
DEVELOPING = (ROOT / "DEVELOPING.md").read_text(encoding="utf-8")
GUIDE = (ROOT / "GUIDE.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```yaml\n(.*?)```", README + GUIDE, re.DOTALL)
PIECES = [block for block in BLOCKS if "study:" not in block]


@pytest.mark.parametrize("piece", PIECES, ids=range(len(PIECES)))
def test_its_pieces_of_specs_fit_into_one(piece: str) -> None:
    parse_spec(SMALL + piece)


def test_its_map_of_the_house_is_that_of_the_package() -> None:
    """Whose completeness tests/test_house.py checks."""
    lines = dedent(sweep.__doc__ or "").split("\n")
    assert {line.strip() for line in lines if re.match(r"    \w", line)} <= {
        line.strip() for line in DEVELOPING.split("\n")
    }


def test_the_guide_lists_its_chapters() -> None:
    chapters = re.findall(r"^## (.*)$", GUIDE, re.MULTILINE)
    assert re.findall(r"^- \[(.*)\]\(#(.*)\)$", GUIDE, re.MULTILINE) == [
        (chapter, chapter.lower().replace(" ", "-")) for chapter in chapters
    ]


def test_make_help_explains_every_target() -> None:
    makefile = (ROOT / "Makefile").read_text(encoding="utf-8")
    targets = re.search(r"\.PHONY: (.*)", makefile)
    assert targets is not None
    for target in targets[1].split():
        assert re.search(rf"^{target}:.*## ", makefile, re.MULTILINE), target
