"""Which mistakes there could be in the code, and a sample of them."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from functools import cache
from hashlib import sha256
from itertools import pairwise
from typing import NamedTuple

from tests import ROOT

SEED = 20261128
MUTANTS = 110
"""Of which packages have shares, by all that there could be."""
FEWEST = 4
"""Of a package."""

COMPARED = {
    ast.Lt: ("<", "<="),
    ast.LtE: ("<=", "<"),
    ast.Gt: (">", ">="),
    ast.GtE: (">=", ">"),
    ast.Eq: ("==", "!="),
    ast.NotEq: ("!=", "=="),
    ast.Is: ("is", "is not"),
    ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"),
    ast.NotIn: ("not in", "in"),
}
COMPUTED = {
    ast.Add: ("+", "-"),
    ast.Sub: ("-", "+"),
    ast.Mult: ("*", "/"),
    ast.Div: ("/", "*"),
    ast.FloorDiv: ("//", "*"),
    ast.Mod: ("%", "//"),
}
JOINED = {ast.And: ("and", "or"), ast.Or: ("or", "and")}
NEGATED = ast.Eq | ast.NotEq | ast.Is | ast.IsNot | ast.In | ast.NotIn
"""Comparisons that another comparison turns round already."""
CALLED = {"min": "max", "max": "min", "any": "all", "all": "any"}

WITHOUT_EFFECT = {("zip", "strict"), ("field", "repr")}
"""Keywords of functions that only a mistake elsewhere, or a debugger, would show."""

Code = ast.expr | ast.stmt


class Mutant(NamedTuple):
    """One mistake: the signs of a module from `start` to `end` become `text`."""

    path: str
    start: int
    end: int
    text: str

    def source(self) -> str:
        """The module with the mistake."""
        return applied(read(self.path), [self])

    def lines(self) -> tuple[str, str]:
        """The lines that the mistake touches, as they are and as it leaves them. White
        space counts as one blank.
        """
        source = read(self.path)
        begin = source.rfind("\n", 0, self.start) + 1
        end = source.find("\n", self.end)
        right = source[begin:end]
        wrong = source[begin : self.start] + self.text + source[self.end : end]
        return " ".join(right.split()), " ".join(wrong.split())

    def __str__(self) -> str:
        line = read(self.path).count("\n", 0, self.start) + 1
        return "{}:{}: {}  ->  {}".format(self.path, line, *self.lines())


def package_of(path: str) -> str:
    """`kernels`, or the package within `sweep`; its single modules are `sweep`."""
    first, second, *rest = path.split("/")
    return second if first == "sweep" and rest else first


def applied(source: str, mutants: Iterable[Mutant]) -> str:
    """A module with mistakes that do not overlap. The last one is made first, so that
    the places of the others stay.
    """
    for one in sorted(mutants, reverse=True):
        source = source[: one.start] + one.text + source[one.end :]
    return source


@cache
def read(path: str) -> str:
    """The source of a module, as it was when it was first asked for."""
    return (ROOT / path).read_text(encoding="utf-8")


def modules() -> list[str]:
    """The paths of all modules that get mistakes."""
    parts = ROOT / "kernels", ROOT / "sweep"
    files = [file for part in parts for file in part.rglob("*.py")]
    return sorted(file.relative_to(ROOT).as_posix() for file in files)


def drawn(
    paths: Iterable[str], number: int = MUTANTS, seed: int = SEED
) -> list[Mutant]:
    """A sample of all mistakes in some modules. Each package has its share, and at
    least `FEWEST`.

    A hash of the seed, the path and the lines decides. So a change of the code leaves
    the mistakes in other lines in the sample.
    """
    possible: dict[str, list[Mutant]] = defaultdict(list)
    for path in paths:
        possible[package_of(path)] += mutants(path, read(path))
    total = sum(len(those) for those in possible.values())
    sample = []
    for _, those in sorted(possible.items()):
        share = max(FEWEST, round(number * len(those) / total))
        sample += sorted(_first(those, share, seed))
    return sample


def _first(those: list[Mutant], share: int, seed: int) -> list[Mutant]:
    """The first ones by their hashes, each other lines. They parse, and differ from the
    module as a tree.
    """
    ordered = {
        sha256("\n".join((str(seed), one.path, *one.lines())).encode()).digest(): one
        for one in reversed(those)
    }
    found: list[Mutant] = []
    for _, mutant in sorted(ordered.items()):
        if len(found) < share and is_other_code(mutant):
            found.append(mutant)
    return found


def is_other_code(mutant: Mutant) -> bool:
    """Whether the module with the mistake parses, and is another tree."""
    try:
        wrong = ast.parse(mutant.source())
    except SyntaxError:
        return False
    return ast.dump(wrong) != ast.dump(ast.parse(read(mutant.path)))


def mutants(path: str, source: str) -> Iterator[Mutant]:
    """All mistakes of a module: another comparison, operation, connective, number,
    truth, extreme; a condition turned round; a call left out.
    """
    module = ast.parse(source)
    begins = [0]
    for line in source.split("\n"):
        begins.append(begins[-1] + len(line) + 1)
    ascii_only = source.isascii()

    def sign(line: int, column: int) -> int:
        """Where a place of the tree, which counts bytes of a line, is in the source."""
        begin = begins[line - 1]
        if ascii_only:
            return begin + column
        text = source[begin : begins[line]].encode()[:column]
        return begin + len(text.decode())

    def place(node: Code) -> tuple[int, int]:
        assert node.end_lineno is not None
        assert node.end_col_offset is not None
        return (
            sign(node.lineno, node.col_offset),
            sign(node.end_lineno, node.end_col_offset),
        )

    def between(left: Code, right: Code, words: tuple[str, str]) -> Iterator[Mutant]:
        """The operator between two parts of an expression becomes another. Only
        brackets and comments stand there too.
        """
        begin, end = place(left)[1], place(right)[0]
        code = re.sub("#.*", lambda found: " " * len(found[0]), source[begin:end])
        found = code.find(words[0])
        if found >= 0:
            start = begin + found
            yield Mutant(path, start, start + len(words[0]), words[1])

    for node in _code(module):
        match node:
            case ast.Compare():
                sides = [node.left, *node.comparators]
                for left, kind, right in zip(sides, node.ops, sides[1:], strict=False):
                    yield from between(left, right, COMPARED[type(kind)])
            case ast.BinOp(left, kind, right) if type(kind) in COMPUTED:
                if not _is_text(left) and not _is_text(right):
                    yield from between(left, right, COMPUTED[type(kind)])
            case ast.BoolOp(kind, sides):
                for left, right in pairwise(sides):
                    yield from between(left, right, JOINED[type(kind)])
            case ast.Constant(bool() as truth):
                yield Mutant(path, *place(node), str(not truth))
            case ast.Constant(int() | float() as number):
                yield Mutant(path, *place(node), repr(number + 1))
            case ast.Call(ast.Name(name) as called) if name in CALLED:
                yield Mutant(path, *place(called), CALLED[name])
            case ast.If(test) | ast.While(test) | ast.IfExp(test=test):
                if not _is_turned_already(test):
                    begin, end = place(test)
                    yield Mutant(path, begin, end, f"not ({source[begin:end]})")
            case ast.Expr(ast.Call()):
                yield Mutant(path, *place(node), "pass")


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """What is below a node and does something: no annotation, no decorator, no keyword
    without effect, nothing that only a checker of types or a program runs.
    """
    for name, field in ast.iter_fields(node):
        if name in {"annotation", "returns", "decorator_list"}:
            continue
        for part in field if isinstance(field, list) else [field]:
            if isinstance(part, ast.AST) and not _is_left_out(node, part):
                yield part
                yield from _code(part)


def _is_left_out(node: ast.AST, part: ast.AST) -> bool:
    match node, part:
        case ast.Call(ast.Name(called)), ast.keyword(keyword):
            return (called, keyword) in WITHOUT_EFFECT
        case _, ast.If(test):
            words = ast.unparse(test)
            return "TYPE_CHECKING" in words or words.startswith("__name__ ==")
    return False


def _is_turned_already(test: ast.expr) -> bool:
    match test:
        case ast.Compare(ops=[kind]):
            return isinstance(kind, NEGATED)
    return False


def _is_text(node: ast.expr) -> bool:
    is_constant = isinstance(node, ast.Constant) and isinstance(node.value, str)
    return is_constant or isinstance(node, ast.JoinedStr)
