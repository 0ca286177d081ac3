"""What the README and the guide show is true."""

import re
from textwrap import dedent

import pytest

import sweep
from sweep.design.design import expand
from sweep.spec.study import parse_spec
from tests import ROOT
from tests.studies import SMALL

README = (ROOT / "README.md").read_text(encoding="utf-8")
GUIDE = (ROOT / "GUIDE.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```yaml\n(.*?)```", README + GUIDE, re.DOTALL)
SPECS = [block for block in BLOCKS if "study:" in block]
PIECES = [block for block in BLOCKS if "study:" not in block]


@pytest.mark.parametrize("spec", SPECS, ids=range(len(SPECS)))
def test_its_specs_load(spec: str) -> None:
    study = parse_spec(spec)
    assert study.search or expand(study).n_points > 1


@pytest.mark.parametrize("piece", PIECES, ids=range(len(PIECES)))
def test_its_pieces_of_specs_fit_into_one(piece: str) -> None:
    parse_spec(SMALL + piece)


def test_its_map_of_the_house_is_that_of_the_package() -> None:
    """Whose completeness tests/test_house.py checks."""
    lines = dedent(sweep.__doc__ or "").split("\n")
    assert {line.strip() for line in lines if re.match(r"    \w", line)} <= {
        line.strip() for line in README.split("\n")
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
