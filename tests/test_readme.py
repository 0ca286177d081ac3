"""What the README and the guide show is true."""

import re
from pathlib import Path

import pytest
from studies import SMALL

from sweep.design.design import expand
from sweep.spec.study import parse_spec

ROOT = Path(__file__).parent.parent
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


def test_its_map_of_the_house_names_every_module() -> None:
    modules = [
        path
        for package in ("kernels", "sweep")
        for path in (ROOT / package).glob("*.py")
    ]
    unnamed = [
        path.name
        for path in modules
        if path.name != "__init__.py" and path.stem not in README
    ]
    assert not unnamed


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
