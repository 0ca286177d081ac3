"""Each sentence of the page on trust stands with tests that exist, or says why it has
none.
"""

import ast
import re
from functools import cache

import pytest

from tests import ROOT

PAGE = (ROOT / "docs" / "trust.md").read_text(encoding="utf-8")
BULLETS = re.findall(r"^- (.*?)(?=^- |^## |\Z)", PAGE, re.MULTILINE | re.DOTALL)
PARTS = re.compile(r"(?P<sentence>.*?\.)\n  <!-- (?P<proof>.*?) -->\n*", re.DOTALL)
TEST = re.compile(r"(?P<file>tests/[a-z0-9_/]+\.py)::(?P<name>test_\w+)")


@cache
def names_in(file: str) -> set[str]:
    tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("bullet", BULLETS, ids=range(len(BULLETS)))
def test_a_sentence_has_its_tests(bullet: str) -> None:
    parts = PARTS.fullmatch(bullet)
    assert parts is not None, bullet
    if parts["proof"].startswith("none: "):
        return
    for proof in parts["proof"].split():
        found = TEST.fullmatch(proof)
        assert found is not None, proof
        assert found["name"] in names_in(found["file"]), proof


def test_only_what_is_not_promised_has_no_test() -> None:
    promised, not_promised = PAGE.split("## Not promised")
    assert "<!-- none" not in promised
    assert not_promised.count("<!-- none: ") == not_promised.count("\n- ")


def test_every_file_of_attacks_stands_behind_a_sentence() -> None:
    named = {found["file"] for found in TEST.finditer(PAGE)}
    attacks = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "tests" / "attacks").glob("test_*.py")
    }
    assert attacks <= named
