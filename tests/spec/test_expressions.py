"""Expressions compute what Python would, for whole
columns, and refuse everything else.
"""

import ast
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kernels.catalogue import BUILT_IN
from sweep.spec.expressions import CONDITION, NUMBER, TEXT, ExpressionError, parse
from sweep.spec.settings import settings_of

KNOWN = settings_of("nguyen2024", BUILT_IN)
NAMES = ("drag", "n", "width", "steps")
ROUNDED = {"round": round, "floor": math.floor, "ceil": math.ceil}
PYTHON = {
    "min": min,
    "max": max,
    "abs": abs,
    "sqrt": math.sqrt,
    "log": math.log,
    "exp": math.exp,
    "pi": math.pi,
}


def numbers() -> st.SearchStrategy[str]:
    leaves = st.one_of(
        st.sampled_from(NAMES), st.sampled_from(["0", "1", "2.5", "7", "pi"])
    )

    def grown(part: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
        return st.one_of(
            st.builds(
                "({} {} {})".format,
                part,
                st.sampled_from(["+", "-", "*", "/", "//", "%", "**"]),
                part,
            ),
            st.builds("(-{})".format, part),
            st.builds(
                "{}({})".format,
                st.sampled_from(["abs", "sqrt", "log", "exp", *ROUNDED]),
                part,
            ),
            st.builds("{}({}, {})".format, st.sampled_from(["min", "max"]), part, part),
            st.builds("({} if {} else {})".format, part, conditions(part), part),
        )

    return st.recursive(leaves, grown, max_leaves=6)


def conditions(part: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    compared = st.builds(
        "({} {} {} {} {})".format,
        part,
        st.sampled_from(["<", ">="]),
        part,
        st.sampled_from(["!=", "=="]),
        part,
    )
    return st.one_of(
        compared,
        st.builds("(not {})".format, compared),
        st.builds(
            "({} {} {})".format, compared, st.sampled_from(["and", "or"]), compared
        ),
    )


class PowersAsCalls(ast.NodeTransformer):
    """Makes `a ** b` the call `power(a, b)`."""

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow):
            return node
        return ast.Call(ast.Name("power", ast.Load()), [node.left, node.right], [])


def real_power(base: float, exponent: float) -> float:
    """A power; ValueError where Python goes on with a complex number, even if only to
    compare it.
    """
    result = base**exponent
    if isinstance(result, complex):
        raise ValueError("not a real number")
    return result


def in_python(text: str, values: dict[str, float]) -> object:
    """What Python makes of it, with float numbers; None where that is an error or not a
    finite real number.
    """
    names = (
        values
        | PYTHON
        | {
            name: lambda x, f=function: float(f(x))
            for name, function in ROUNDED.items()
        }
    )
    names |= {"power": real_power}
    literals = ast.fix_missing_locations(
        PowersAsCalls().visit(ast.parse(text, mode="eval"))
    )
    for node in ast.walk(literals):
        if isinstance(node, ast.Constant) and not isinstance(node.value, str):
            node.value = float(node.value)
    try:
        result = eval(compile(literals, "", "eval"), {"__builtins__": {}}, names)
    except (ArithmeticError, ValueError, TypeError):
        return None
    return result if math.isfinite(result) else None


POINTS = st.fixed_dictionaries(
    {name: st.sampled_from([-2.0, 0.0, 0.5, 1.0, 3.0, 10.0]) for name in NAMES}
)


@settings(deadline=None)
@given(
    st.one_of(numbers(), conditions(numbers())),
    st.lists(POINTS, min_size=1, max_size=5),
)
def test_agrees_with_python(text: str, points: list[dict[str, float]]) -> None:
    expected = [in_python(text, point) for point in points]
    columns = {name: np.array([point[name] for point in points]) for name in NAMES}
    expression = parse(text, KNOWN)
    if None in expected:
        with pytest.raises(ExpressionError) as error:
            expression.evaluate(columns, len(points))
        assert expected[error.value.point] is None
    else:
        assert expression.evaluate(columns, len(points)).tolist() == pytest.approx(
            expected, rel=1e-12
        )


def test_kinds_and_names() -> None:
    assert parse("n * 2", KNOWN).kind == NUMBER
    assert (
        parse("minimum_image == true and not range_inclusive", KNOWN).kind == CONDITION
    )
    assert parse("'empty' if n > 10 else map", KNOWN).kind == TEXT
    assert parse("'empty' if n > 10 else map", KNOWN).names == {"n", "map"}


def test_texts_are_compared_and_chosen() -> None:
    maps = np.array(["empty", "cafeteria"], dtype=object)
    assert parse("map != 'empty'", KNOWN).evaluate({"map": maps}, 2).tolist() == [
        False,
        True,
    ]
    chosen = parse("map if n > 1 else 'empty'", KNOWN)
    assert chosen.evaluate({"map": "cafeteria", "n": np.array([1, 2])}, 2).tolist() == [
        "empty",
        "cafeteria",
    ]


@pytest.mark.parametrize(
    "text",
    [
        "1 / n if n > 0 else 0",
        "n > 0 and 1 / n > 0",
        "n == 0 or 1 / n > 0",
        "0 < n < 1 / n",
        "min(n, 1) / max(n, 1)",
    ],
)
def test_what_is_not_needed_is_not_computed(text: str) -> None:
    parse(text, KNOWN).evaluate({"n": np.array([0, 2])}, 2)


def test_first_point_without_a_value_is_named() -> None:
    with pytest.raises(
        ExpressionError, match=r'^"1 / n" is not a finite number$'
    ) as error:
        parse("2 if n == 5 else 1 / n", KNOWN).evaluate(
            {"n": np.array([5, 2, 0, 0])}, 4
        )
    assert error.value.point == 2


def test_infinity_may_be_given_but_not_made() -> None:
    ranges = {"obstacle_range": np.array([1.0, math.inf])}
    assert parse("2 * obstacle_range", KNOWN).evaluate(ranges, 2).tolist() == [
        2.0,
        math.inf,
    ]
    for text in (
        "obstacle_range - obstacle_range",
        "10 ** 400",
        "9 ** 9 ** 9",
        "exp(1000)",
    ):
        with pytest.raises(ExpressionError, match="is not a finite number"):
            parse(text, KNOWN).evaluate(ranges, 2)


REFUSED = [
    ("", '"" is not an expression'),
    ("n +", '"n +" is not an expression'),
    ("n := 1", "is not an expression"),
    ("1if n > 1 else 2", "is not an expression"),
    ("\0", "is not an expression"),
    ("(" * 300 + "1" + ")" * 300, "is not an expression"),
    ("-" * 900 + "1", "the expression is nested too deeply"),
    ("n" + " + n" * 400, "an expression has at most 1000 characters"),
    ("nn", 'unknown name "nn"; did you mean "n"?'),
    ("__import__('os').system('ls')", "is not allowed in an expression"),
    ("__import__('os')", 'unknown function "__import__"'),
    ("sqroot(2)", 'unknown function "sqroot"; did you mean "sqrt"?'),
    ("(lambda: 1)()", "is not allowed in an expression"),
    ("n.real", '"n.real" is not allowed in an expression'),
    ("[n][0]", "is not allowed in an expression"),
    ("f'{n}'", "is not allowed in an expression"),
    ("1j", '"1j" is not allowed in an expression'),
    ("~n", '"~n" is not allowed in an expression'),
    ("n << 2", '"n << 2" is not allowed in an expression'),
    ("round(n, ndigits=1)", "is not allowed in an expression"),
    ("min(*n, 1)", "is not allowed in an expression"),
    ("sqrt()", "sqrt takes 1 argument, not 0"),
    ("min(1)", "min takes 2 to 20 arguments, not 1"),
    ("1e999", "the expression contains a number that is too large"),
    ("n is 1", "a number can only be compared with ==, !=, <, <=, > and >="),
    ("map < 'empty'", "a string can only be compared with == and !="),
    ("map == 1", 'comparison with "map" needs a string, but "1" is a number'),
    ("n == 'a'", 'comparison with "n" needs a number, but "\'a\'" is a string'),
    ("map == 'emty'", 'unknown map "emty"; did you mean "empty"?'),
    (
        "next_goals == '1 2;3 4'",
        'next_goals has the value "1 2; 3 4" in tables, not "1 2;3 4"',
    ),
    ("next_goals == '1 2 3'", "'1 2 3' is not allowed for next_goals; allowed: a list"),
    ("n and 1", 'and needs a condition, but "n" is a number'),
    ("not n", 'not needs a condition, but "n" is a number'),
    ("1 + (n > 1)", 'arithmetic needs a number, but "n > 1" is a condition'),
    ("-map", 'a sign needs a number, but "map" is a string'),
    ("1 if n else 2", 'if needs a condition, but "n" is a number'),
    ("1 if n > 1 else 'a'", '"1" before "if" needs a number, but "\'a\'" is a string'),
    ("sqrt(map)", 'sqrt needs a number, but "map" is a string'),
]


@pytest.mark.parametrize(
    ("text", "message"), REFUSED, ids=[text[:30] for text, _ in REFUSED]
)
def test_refused_with_a_reason(text: str, message: str) -> None:
    with pytest.raises(ExpressionError) as error:
        parse(text, KNOWN)
    assert message in str(error.value)
