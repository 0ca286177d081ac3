"""The sample of mistakes, and each kind of mistake."""

import ast
from collections import Counter

import pytest

from tests.mutants import drawing
from tests.mutants.drawing import (
    FEWEST,
    Mutant,
    applied,
    drawn,
    is_other_code,
    modules,
    mutants,
    package_of,
    read,
)

SOME = [path for path in modules() if package_of(path) in {"own_code", "sweep"}]
"""To read all modules takes seconds."""
NUMBER = 12


@pytest.fixture(scope="module")
def sample() -> list[Mutant]:
    return drawn(SOME, NUMBER)


def test_the_sample_follows_from_the_code_alone(sample: list[Mutant]) -> None:
    assert len({(one.path, one.lines()) for one in sample}) == len(sample)
    assert drawn(SOME, NUMBER) == sample
    assert drawn(SOME, NUMBER, seed=1) != sample


def test_each_package_has_its_share(sample: list[Mutant]) -> None:
    counts = Counter(package_of(one.path) for one in sample)
    assert counts["sweep"] == FEWEST
    assert FEWEST < counts["own_code"] <= NUMBER


def test_single_modules_are_one_package_and_kernels_another() -> None:
    paths = "sweep/__init__.py", "sweep/text.py", "sweep/web/a/b.py", "kernels/a/b.py"
    assert [package_of(one) for one in paths] == ["sweep", "sweep", "web", "kernels"]
    assert {*paths[:2]} <= set(modules())


def test_a_change_elsewhere_leaves_the_sample(
    sample: list[Mutant], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(drawing, "read", lambda path: "# a line more\n" + read(path))
    moved = drawn(SOME, NUMBER)
    assert [one.start for one in moved] == [one.start + 14 for one in sample]


def test_each_mistake_is_code_that_differs_in_one_place(sample: list[Mutant]) -> None:
    for one in sample:
        assert is_other_code(one)
        source, wrong = read(one.path), one.source()
        assert wrong[: one.start] == source[: one.start]
        assert wrong[one.start + len(one.text) :] == source[one.end :]
        right, left = one.lines()
        assert right != left


KINDS = {
    "a < b": ["a <= b"],
    "a == b": ["a != b"],
    "a in b": ["a not in b"],
    "a is not b": ["a is b"],
    "a < b <= c": ["a <= b <= c", "a < b < c"],
    "(a) + (b)": ["(a) - (b)"],
    "a // b": ["a * b"],
    "a % b": ["a // b"],
    "a ** b": [],
    "'a' + b": [],
    "f'{a}' + b": [],
    "f'{a + b}'": ["f'{a - b}'"],
    "'%s' % a": [],
    "a and b and c": ["a or b and c", "a and b or c"],
    "a = True": ["a = False"],
    "a = 1.5": ["a = 2.5"],
    "a = None": [],
    "max(a)": ["pass", "min(a)"],
    "a(b)": ["pass"],
    "a = b if c else d": ["a = b if not (c) else d"],
    "if a: b": ["if not (a): b"],
    "if a == b: c": ["if a != b: c"],
    "while a: b": ["while not (a): b"],
    "if (a := b): c": ["if (not (a := b)): c"],
    "def a(b: 'c < d' = 1) -> f[2]: g": ["def a(b: 'c < d' = 2) -> f[2]: g"],
    "a: Annotated[b, c(True)] = d": [],
    "@a(True)\ndef b(): c": [],
    "'''A text, 1 < 2.'''": [],
    "a = zip(b, strict=True)": [],
    "a = field(repr=False)": [],
    "a = field(init=False)": ["a = field(init=True)"],
    "if TYPE_CHECKING: a = 1": [],
    "if __name__ == '__main__': a()": [],
}


@pytest.mark.parametrize("source", KINDS)
def test_mistakes_of_a_line(source: str) -> None:
    made = [applied(source, [one]) for one in mutants("a.py", source)]
    assert sorted(made) == sorted(KINDS[source])
    for one in made:
        assert ast.dump(ast.parse(one)) != ast.dump(ast.parse(source))


def test_a_comment_between_two_parts_is_no_operator() -> None:
    source = "a = (b  # and < +\n    and c)\n"
    made = [applied(source, [one]) for one in mutants("a.py", source)]
    assert made == ["a = (b  # and < +\n    or c)\n"]


def test_signs_that_are_no_ascii_move_no_place() -> None:
    source = 'x = "äöü→𝄞"; y = "é", a < b\n'
    made = [applied(source, [one]) for one in mutants("a.py", source)]
    assert made == ['x = "äöü→𝄞"; y = "é", a <= b\n']


def test_signs_that_end_lines_elsewhere_end_none_here() -> None:
    source = 'x = "\x0c\u2028"\ny = 1\n'
    made = [applied(source, [one]) for one in mutants("a.py", source)]
    assert made == ['x = "\x0c\u2028"\ny = 2\n']
