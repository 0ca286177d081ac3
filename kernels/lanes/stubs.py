"""What a kernel for lanes calls: functions of which numba compiles what suits the types
of the arguments.

A stub has no body. numba asks it by the types of a call, and gets the function that is
compiled for these. What has no meaning for vectors is called lane by lane: for each
lane its own numbers are taken out, and the results are put into vectors again.
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
"""What converted text may name besides the names of its own module."""
LANE_BY_LANE: dict[str, str] = {}
"""The functions that this process has compiled lane by lane, and why. They cost as much
as in single trials, so that nobody should be surprised by one.
"""


def stub(
    name: str, names: Sequence[str], choose: Callable[[dict[str, Any]], Any]
) -> Callable[..., Any]:
    """A function for numba, of arguments of these names. `choose` gives the one that is
    compiled, from the types of the arguments by name.

    numba compares the names of arguments, so that both functions are written with them.
    """
    listed = ", ".join(names)
    empty: Callable[..., Any] = function_of(f"def {name}({listed}): pass", {})
    chosen = function_of(
        f"def chosen({listed}): return choose({listed})",
        {"choose": lambda *kinds: choose(dict(zip(names, kinds, strict=True)))},
    )
    overload(empty, jit_options=OPTIONS, strict=False)(chosen)
    return empty


def lane_by_lane(function: Callable[..., Any], given: dict[str, Any], why: str) -> Any:
    """A function that calls another one for each lane. `given` are the types of the
    arguments by name, and `why` says why it has to be so.
    """
    # Arguments of these names hide nothing that the text calls.
    given = {f"_given_{k}": kind for k, kind in enumerate(given.values())}

    def call(at: str) -> str:
        parts = (f"{_taken(kind)}({name}, {at})" for name, kind in given.items())
        return f"function({', '.join(parts)})"

    LANE_BY_LANE[function.__name__] = why
    text = f"""
        def each({", ".join(given)}):
            result = _spread_all({call("0")})
            for at in range(1, {WIDTH}):
                result = _put_all(result, at, {call("at")})
            return result
    """
    return function_of(text, TOOLS | {"function": function, "_row_of": rows.row_of})


def _taken(kind: Any) -> str:
    """What takes out of an argument that which belongs to one lane."""
    return "_row_of" if isinstance(kind, rows.Stacked) else "_of_lane"


@cache
def in_each_lane(function: Callable[..., Any], count: int) -> Callable[..., Any]:
    """What calls a function of `count` numbers, as math.cos, in each lane."""
    names = [f"value_{k}" for k in range(count)]
    why = "the processor has it for single numbers only"
    return stub(
        function.__name__, names, lambda given: lane_by_lane(function, given, why)
    )


@cache
def text_in_each_lane(text: str, count: int) -> Callable[..., Any]:
    """What computes an expression of `one`, or of `one` and `other`, in each lane."""
    names = ["one", "other"][:count]
    plain = function_of(f"def computed({', '.join(names)}): return {text}", {})
    function = numba.njit(**OPTIONS)(plain)
    why = "`**`, `//` and `%` are computed as for single numbers"
    return stub("computed", names, lambda given: lane_by_lane(function, given, why))


@cache
def method_in_each_lane(name: str, count: int) -> Callable[..., Any]:
    """What calls a method, with `count` numbers, of the generator of each lane."""
    names = [f"value_{k}" for k in range(count)]
    listed = ", ".join(names)
    text = f"def {name}(rng, {listed}): return rng.{name}({listed})"
    drawn = numba.njit(**OPTIONS)(function_of(text, {}))
    why = "each lane has its own random numbers"
    return stub(name, ["rng", *names], lambda given: lane_by_lane(drawn, given, why))
