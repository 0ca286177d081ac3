"""What the README and the guide show is true."""

import re
from pathlib import Path
from textwrap import dedent

import pytest

import sweep
from sweep.design.design import expand
from sweep.spec.study import parse_spec
from tests import ROOT
from tests.plotted import SEARCHED
from tests.searches import asked_by
from tests.studies import SMALL, launched

README = (ROOT / "README.md").read_text(encoding="utf-8")
GUIDE = (ROOT / "GUIDE.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```yaml\n(.*?)```", README + GUIDE, re.DOTALL)
SPECS = [block for block in BLOCKS if "study:" in block]
CURVES = SMALL.replace("[0.5, 1]", "[0.5, 1, 2]")
WHOLE = re.findall(r"```python\n(import sweep\n.*?)```", GUIDE, re.DOTALL)
"""Python that runs as it stands, on studies of these names."""
PIECES = [block for block in BLOCKS if "study:" not in block]


@pytest.mark.parametrize("spec", SPECS, ids=range(len(SPECS)))
def test_its_specs_load(spec: str) -> None:
    study = parse_spec(spec)
    assert study.search or expand(study).n_points > 1


@pytest.mark.parametrize("piece", PIECES, ids=range(len(PIECES)))
def test_its_pieces_of_specs_fit_into_one(piece: str) -> None:
    parse_spec(SMALL + piece)


@pytest.mark.parametrize("python", WHOLE, ids=range(len(WHOLE)))
def test_its_python_runs_as_it_stands(
    python: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (name,) = re.findall(r'sweep\.load\("(.*?)"\)', python)
    results = tmp_path / "results"
    if name == "my/gains":
        asked_by(SEARCHED.replace("study: searched", f"study: {name}"), results)
    else:
        launched(CURVES.replace("study: small", f"study: {name}"), results)
    monkeypatch.chdir(tmp_path)
    exec(python, {})


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
