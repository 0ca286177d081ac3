"""Functions that a kernel for lanes calls; numba compiles variants by argument types.

A stub has no body. numba passes the types of a call, and gets the function to compile
for these types. Functions without a meaning for vectors are called lane by lane: the
numbers of each lane are extracted, and the results are inserted into vectors.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import numba
from numba.extending import overload

from kernels.lanes import rows, vectors
from kernels.lanes.texts import function_of
from kernels.lanes.vectors import OPTIONS, WIDTH

TOOLS: dict[str, Any] = {
    f"_{tool.__name__}": tool
    for tool in (
        *(vectors.where, vectors.both, vectors.either, vectors.negated),
        *(vectors.as_float, vectors.as_int, vectors.as_bool, vectors.any_lane),
        *(rows.listed, rows.marked, rows.of_lane, rows.spread_all, rows.put_all),
    )
}
"""Functions that converted text may name, in addition to the names of the module."""
LANE_BY_LANE: dict[str, str] = {}
"""Functions that this process has compiled lane by lane, with reasons.

A call lane by lane costs as much as calls in single trials. The list lets a user find
slow functions.
"""


def stub(
    name: str, names: Sequence[str], choose: Callable[[dict[str, Any]], Any]
) -> Callable[..., Any]:
    """Return a function without a body for numba.

    numba compares the names of arguments, so the stub and the function that calls
    `choose` have equal argument names.

    Parameters
    ----------
    name : str
        Name of the function.
    names : sequence of str
        Names of the arguments.
    choose : function
        Function that returns the function to compile, from the types of the arguments
        by name.
    """
    listed = ", ".join(names)
    empty: Callable[..., Any] = function_of(f"def {name}({listed}): pass", {})
    chosen = function_of(
        f"def chosen({listed}): return choose({listed})",
        {"choose": lambda *kinds: choose(dict(zip(names, kinds, strict=True)))},
    )
    overload(empty, jit_options=OPTIONS, strict=False)(chosen)
    return empty


def lane_by_lane(function: Callable[..., Any], kinds: dict[str, Any], why: str) -> Any:
    """Return a function that calls a function of single numbers for each lane.

    Parameters
    ----------
    function : function
        Function of single numbers.
    kinds : dict of type
        Types of the arguments by name.
    why : str
        Reason, for `LANE_BY_LANE`.
    """
    # Arguments with these names hide no name in the text.
    named = {f"_argument_{k}": kind for k, kind in enumerate(kinds.values())}

    def call(at: str) -> str:
        parts = (f"{_taken(kind)}({name}, {at})" for name, kind in named.items())
        return f"function({', '.join(parts)})"

    LANE_BY_LANE[function.__name__] = why
    text = f"""
        def each({", ".join(named)}):
            result = _spread_all({call("0")})
            for at in range(1, {WIDTH}):
                result = _put_all(result, at, {call("at")})
            return result
    """
    return function_of(text, TOOLS | {"function": function, "_row_of": rows.row_of})


def _taken(kind: Any) -> str:
    """Return the name of the tool that extracts the part of one lane of an argument."""
    return "_row_of" if isinstance(kind, rows.Stacked) else "_of_lane"


@cache
def in_each_lane(function: Callable[..., Any], count: int) -> Callable[..., Any]:
    """Return a stub that calls a function of `count` numbers in each lane."""
    names = [f"value_{k}" for k in range(count)]
    why = "the processor has it for single numbers only"
    return stub(
        function.__name__, names, lambda kinds: lane_by_lane(function, kinds, why)
    )


@cache
def text_in_each_lane(text: str, count: int) -> Callable[..., Any]:
    """Return a stub that computes an expression in each lane.

    The arguments of the expression are `first`, or `first` and `second`.
    """
    names = ["first", "second"][:count]
    plain = function_of(f"def computed({', '.join(names)}): return {text}", {})
    function = numba.njit(**OPTIONS)(plain)
    why = "`**`, `//` and `%` are computed as for single numbers"
    return stub("computed", names, lambda kinds: lane_by_lane(function, kinds, why))


@cache
def method_in_each_lane(name: str, count: int) -> Callable[..., Any]:
    """Return a stub that calls a method of the generator of each lane."""
    names = [f"value_{k}" for k in range(count)]
    listed = ", ".join(names)
    text = f"def {name}(rng, {listed}): return rng.{name}({listed})"
    drawn = numba.njit(**OPTIONS)(function_of(text, {}))
    why = "each lane has its own random numbers"
    return stub(name, ["rng", *names], lambda kinds: lane_by_lane(drawn, kinds, why))
