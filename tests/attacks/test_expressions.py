"""The work of an expression grows with its length, and is counted here."""

import ast
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import sweep.spec.evaluation as evaluation
import sweep.spec.expressions as expressions
import sweep.spec.units as units
from kernels.catalogue import BUILT_IN
from sweep.design.plan import make_plan
from sweep.spec.expressions import Expression, ExpressionError, parse
from sweep.spec.settings import Values, settings_of
from tests.specs import short_study

KNOWN = settings_of("nguyen2024", BUILT_IN)
EVALUATION = evaluation._Evaluation

NESTINGS: dict[str, tuple[str, str]] = {
    "middle of a chain": ("n", "(1 if 0<{}<9 else 1)"),
    "longer chains": ("n", "(1 if 0<{}<9<10 else 1)"),
    "chains of conditions": ("n>1", "(({})==true==true)"),
    "first of a chain": ("n", "(1 if {}<9<10 else 1)"),
    "body": ("n", "({} if 0<n<1 else 2)"),
    "else": ("n", "(2 if 0<n<1 else {})"),
    "and": ("n>1", "(n>0 and {})"),
    "or": ("n>1", "(n<0 or {})"),
    "arguments": ("n", "max({},n,1)"),
    "powers": ("n", "(1**{})"),
}
"""What is nested, as deeply as an expression may be."""


def nested(innermost: str, around: str) -> str:
    """The longest of the expressions that are allowed."""
    texts = [innermost]
    while len(around.format(texts[-1])) <= expressions.MOST_CHARACTERS:
        texts.append(around.format(texts[-1]))
    trees = (ast.parse(text, mode="eval").body for text in texts)
    depths = [expressions._depth(tree) for tree in trees]
    allowed = [depth <= expressions.MOST_LEVELS for depth in depths]
    return texts[allowed.count(True) - 1]


def counted(
    monkeypatch: pytest.MonkeyPatch,
    place: Any,
    name: str,
    most: int,
) -> list[Any]:
    """The arguments of all calls of a function, or of a method, at most so many."""
    calls: list[Any] = []
    original: Callable[..., Any] = getattr(place, name)

    def counting(*arguments: Any) -> Any:
        calls.append(arguments)
        assert len(calls) <= most, f"{name} is called more than {most} times"
        return original(*arguments)

    monkeypatch.setattr(place, name, counting)
    return calls


def evaluated(expression: Expression, n: Values) -> Values:
    return expression.evaluate({"n": n}, len(n))


@pytest.mark.parametrize("nesting", NESTINGS)
def test_each_part_is_computed_once(
    nesting: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    expression = parse(nested(*NESTINGS[nesting]), KNOWN)
    assert expression.operations > 100
    visited = counted(monkeypatch, EVALUATION, "value", expression.operations)
    evaluated(expression, np.arange(9))
    assert len(visited) == expression.operations
    assert len({id(node) for _, node, _ in visited}) == len(visited)


@pytest.mark.parametrize("nesting", NESTINGS)
def test_the_unit_of_each_part_is_found_once(
    nesting: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    expression = parse(nested(*NESTINGS[nesting]), KNOWN)
    found = counted(monkeypatch, units._Combining, "unit", expression.operations)
    assert units.unit_of(expression.tree, KNOWN) == ""
    assert len(found) == expression.operations


@pytest.mark.parametrize("nesting", NESTINGS)
def test_each_part_is_checked_once(
    nesting: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    text = nested(*NESTINGS[nesting])
    checked = counted(monkeypatch, expressions._Checker, "kind", len(text))
    shown = counted(monkeypatch, ast, "unparse", 0)
    assert parse(text, KNOWN).operations == len(checked)
    assert shown == []


def test_chains_within_chains_are_planned(monkeypatch: pytest.MonkeyPatch) -> None:
    """Were a middle computed twice, each nesting would double the work."""
    text = "n"
    for _ in range(28):
        text = f"(1 if 0<{text}<9 else 1)"
    study = short_study("derive:", f'  drag: "0.1*{text}"')
    counted(monkeypatch, EVALUATION, "value", 10_000)
    assert make_plan(study, 1).points == 1


@pytest.mark.parametrize(
    "text",
    ["0 < n < 4 < 2 * n != 6", "n if 1 < n < 5 else -n", "n > 2 and n < 5", "n ** 0.3"],
)
def test_blocks_of_points_add_up_to_the_same_bits(
    text: str,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    n = np.arange(1, 50)
    whole = evaluated(parse(text, KNOWN), n)
    monkeypatch.setattr(evaluation, "BLOCK", 7)
    parted = evaluated(parse(text, KNOWN), n)
    assert parted.dtype == whole.dtype
    assert parted.tobytes() == whole.tobytes()
    assert whole.tolist() == [eval(text, {"n": float(one)}) for one in n]


def test_no_level_holds_more_than_a_block(monkeypatch: pytest.MonkeyPatch) -> None:
    sizes: list[int] = []
    original = EVALUATION.value

    def watching(self: Any, node: ast.expr, rows: Values) -> Values:
        sizes.append(len(rows))
        return original(self, node, rows)

    monkeypatch.setattr(EVALUATION, "value", watching)
    points = 3 * evaluation.BLOCK + 5
    n = np.broadcast_to(np.array([5]), points)
    evaluated(parse(nested(*NESTINGS["body"]), KNOWN), n)
    assert max(sizes) == evaluation.BLOCK


def test_a_point_beyond_the_first_block_is_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(evaluation, "BLOCK", 7)
    n = np.ones(50)
    n[[23, 40]] = 0
    with pytest.raises(ExpressionError) as error:
        evaluated(parse("1 / n", KNOWN), n)
    assert error.value.point == 23


def test_of_no_points_there_are_no_values() -> None:
    assert evaluated(parse("n > 1", KNOWN), np.zeros(0)).dtype == np.bool_
