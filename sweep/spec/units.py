"""Units of expressions: combined in the same way as the numbers, or rejected.

In a sum or a comparison, a literal number has the unit of the remaining parts, for
example in `100 - coverage`. Elsewhere a literal number has no unit.
"""

import ast
import re
from collections.abc import Iterable, Mapping
from fractions import Fraction

from sweep.spec.evaluation import CONSTANTS, FUNCTIONS, ExpressionError, evaluate
from sweep.spec.settings import Setting

Unit = dict[str, Fraction]
"""Power of each base unit, such as {"px": 1, "step": -1}; no power is zero."""

NO_UNIT: Unit = {}
FACTOR = re.compile(r"(?P<over>/)?(?P<base>[^*/^]+)(\^(?P<power>[0-9.]+))?")
MOST_POWER = 20
"""Largest power of a unit. A larger power is a mistake."""
SIMPLEST = 12
"""Largest denominator of a power, so that roots of roots have units."""


def parsed(text: str) -> Unit:
    """Return the unit of a string such as "px^2/step^2" or "1/s".

    >>> parsed("px/step")
    {'px': Fraction(1, 1), 'step': Fraction(-1, 1)}
    """
    unit = NO_UNIT
    for factor in FACTOR.finditer(text.replace(" ", "")):
        base = factor["base"]
        power = Fraction(factor["power"] or 1)
        if base != "1":
            unit = _product(unit, {base: -power if factor["over"] else power})
    return unit


def written_out(unit: Unit) -> str:
    """Return the string of a unit, such as "px^2/step".

    >>> written_out({"step": Fraction(-1), "px": Fraction(1, 2)})
    'px^0.5/step'
    """
    above = [_factor(base, power) for base, power in unit.items() if power > 0]
    below = [f"/{_factor(base, -power)}" for base, power in unit.items() if power < 0]
    return ("*".join(above) or "1" * bool(below)) + "".join(below)


def _factor(base: str, power: Fraction) -> str:
    return base if power == 1 else f"{base}^{float(power):.6g}"


def _product(left: Unit, right: Unit) -> Unit:
    bases = {**left, **right}
    powers = {base: left.get(base, 0) + right.get(base, 0) for base in bases}
    return {base: Fraction(power) for base, power in powers.items() if power}


def _raised(unit: Unit, power: Fraction) -> Unit:
    raised = {base: (own * power) for base, own in unit.items()}
    return {base: own for base, own in raised.items() if own}


def unit_of(tree: ast.expr, settings: Mapping[str, Setting]) -> str:
    """Return the unit of a checked expression over `settings`, "" for none.

    Raises ExpressionError for incompatible units.
    """
    return written_out(_Combining(settings).unit(tree) or NO_UNIT)


class _Combining:
    """Finder of the unit of every part of an expression.

    A part with only literal numbers has the unit None.
    """

    def __init__(self, settings: Mapping[str, Setting]) -> None:
        self.settings = settings

    def unit(self, node: ast.expr) -> Unit | None:
        """Return the unit of a part. Raises ExpressionError."""
        match node:
            case ast.Constant():
                return None
            case ast.Name(id=name):
                return None if name in CONSTANTS else parsed(self.settings[name].unit)
            case ast.UnaryOp(operand=operand):
                return self.unit(operand)
            case ast.BinOp(left=left, op=ast.Pow(), right=right):
                return self._power(left, right)
            case ast.BinOp(left=left, op=ast.Mult() | ast.Div() as operator):
                return self._product(left, node.right, isinstance(operator, ast.Div))
            case ast.BinOp(left=left, op=operator, right=right):
                equal = self._equal(node, [left, right])
                return NO_UNIT if isinstance(operator, ast.FloorDiv) else equal
            case ast.IfExp(test=test, body=body, orelse=orelse):
                self.unit(test)
                return self._equal(node, [body, orelse])
            case ast.Compare(left=left, comparators=rest):
                self._equal(node, [left, *rest])
                return NO_UNIT
            case ast.BoolOp(values=conditions):
                for condition in conditions:
                    self.unit(condition)
                return NO_UNIT
            case ast.Call(func=ast.Name(id=name), args=arguments):
                return self._call(node, name, arguments)
        raise AssertionError(f"unchecked expression {ast.dump(node)}")

    def _product(
        self, left: ast.expr, right: ast.expr, is_quotient: bool
    ) -> Unit | None:
        first = self.unit(left)
        second = self.unit(right)
        if first is None and second is None:
            return None
        sign = Fraction(-1 if is_quotient else 1)
        return _product(first or NO_UNIT, _raised(second or NO_UNIT, sign))

    def _power(self, base: ast.expr, power: ast.expr) -> Unit | None:
        unit = self.unit(base)
        exponent = self.unit(power)
        self._without(power, exponent, "a power")
        if not unit:
            return unit if exponent is None else NO_UNIT
        if exponent is not None:
            raise ExpressionError(
                f"{_in(base, unit)}: the power must be a literal number, not"
                f' "{ast.unparse(power)}"; {self._way_out(base, unit)}'
            )
        number = float(evaluate(power, {}, 1)[0])
        simple = Fraction(number).limit_denominator(SIMPLEST)
        if abs(number) > MOST_POWER or abs(simple - number) > 1e-9:
            raise ExpressionError(
                f"{_in(base, unit)}: the power must be an integer or a simple"
                f" fraction, at most {MOST_POWER}, not {number:g}"
            )
        return _raised(unit, simple)

    def _call(
        self, node: ast.expr, name: str, arguments: list[ast.expr]
    ) -> Unit | None:
        rule = FUNCTIONS[name].unit
        unit = self._equal(node, arguments)
        if rule == "none":
            self._without(arguments[0], unit, name)
        return _raised(unit, Fraction(1, 2)) if rule == "root" and unit else unit

    def _without(self, node: ast.expr, unit: Unit | None, operation: str) -> None:
        if unit:
            raise ExpressionError(
                f"{operation} needs a number without unit, but {_in(node, unit)};"
                f" {self._way_out(node, unit)}"
            )

    def _equal(self, parent: ast.expr, nodes: Iterable[ast.expr]) -> Unit | None:
        """Return the common unit of all parts.

        Literal numbers take the unit of the remaining parts.
        """
        having = [
            (node, unit)
            for node, unit in ((node, self.unit(node)) for node in nodes)
            if unit is not None
        ]
        if not having:
            return None
        (node, unit), *further = having
        for other, own in further:
            if own != unit:
                measured = node if unit else other
                raise ExpressionError(
                    f'"{ast.unparse(parent)}" needs equal units, but {_in(node, unit)}'
                    f" and {_in(other, own)};"
                    f" {self._way_out(measured, unit or own)}"
                )
        return unit

    def _way_out(self, node: ast.expr, unit: Unit) -> str:
        """Return the fix in words: a division that removes the unit of a part.

        The divisor is a parameter or a metric of an equal unit.
        """
        text = ast.unparse(node)
        quotient = text if isinstance(node, ast.Name) else f"({text})"
        divisor = next(
            (
                name
                for name, setting in self.settings.items()
                if parsed(setting.unit) == unit and name != text
            ),
            "",
        )
        example = f', for example "{quotient} / {divisor}"' if divisor else ""
        return f"divide by a value in {written_out(unit)}{example}"


def _in(node: ast.expr, unit: Unit) -> str:
    phrase = f"is in {written_out(unit)}" if unit else "has no unit"
    return f'"{ast.unparse(node)}" {phrase}'
