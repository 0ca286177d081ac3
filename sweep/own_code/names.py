"""The names that functions read, before numba meets them: it would compile for seconds
and then say only from where a function with a wrong name is called.
"""

import builtins
import dis
import linecache
from collections.abc import Callable, Iterator
from types import FunctionType, ModuleType
from typing import Any, NamedTuple


class Undefined(NamedTuple):
    """A global name that is read and stands for nothing, its file and its line."""

    name: str
    file: str
    line: int

    @property
    def words(self) -> str:
        """The code of the line, and what is wrong with it."""
        code = linecache.getline(self.file, self.line).strip()
        return (
            f'"{code}": the name "{self.name}" stands for nothing; define or import it'
        )


def undefined(function: Callable[..., Any]) -> Iterator[Undefined]:
    """What a function, compiled or not, and the compiled ones that it calls, read and
    is not there. Those of `kernels` are not looked at.
    """
    plain = getattr(function, "py_func", function)
    return _undefined(plain, set()) if isinstance(plain, FunctionType) else iter(())


def _undefined(function: FunctionType, seen: set[FunctionType]) -> Iterator[Undefined]:
    seen.add(function)
    code, known = function.__code__, function.__globals__
    for one in dis.get_instructions(code):
        lacking = one.argval not in known and not hasattr(builtins, str(one.argval))
        if one.opname == "LOAD_GLOBAL" and lacking:
            line = one.positions.lineno if one.positions else None
            yield Undefined(one.argval, code.co_filename, line or code.co_firstlineno)
    called = [known.get(name) for name in code.co_names]
    modules = [one for one in called if isinstance(one, ModuleType)]
    called += [getattr(one, name, None) for one in modules for name in code.co_names]
    for other in called:
        inner = getattr(other, "py_func", None)
        if isinstance(inner, FunctionType) and inner not in seen and _is_own(inner):
            yield from _undefined(inner, seen)


def _is_own(function: FunctionType) -> bool:
    return function.__module__.partition(".")[0] != "kernels"
