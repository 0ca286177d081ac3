"""The names that functions read, checked before numba compiles them.

Without this check numba would compile for seconds, and then report only the call of a
function with a wrong name.
"""

import builtins
import dis
import linecache
from collections.abc import Callable, Iterator
from types import FunctionType, ModuleType
from typing import Any, NamedTuple


class Undefined(NamedTuple):
    """A global name that is read and not defined, with file and line."""

    name: str
    file: str
    line: int

    @property
    def words(self) -> str:
        """The code of the line, and the mistake."""
        code = linecache.getline(self.file, self.line).strip()
        return f'"{code}": the name "{self.name}" is not defined; define or import it'


def undefined(function: Callable[..., Any]) -> Iterator[Undefined]:
    """Yield the undefined names of a function, and of all called compiled functions.

    The function may be compiled or not. Functions of `kernels` are skipped.
    """
    plain = getattr(function, "py_func", function)
    return _undefined(plain, set()) if isinstance(plain, FunctionType) else iter(())


def _undefined(
    function: FunctionType, checked: set[FunctionType]
) -> Iterator[Undefined]:
    checked.add(function)
    code = function.__code__
    defined = function.__globals__
    for instruction in dis.get_instructions(code):
        if instruction.opname != "LOAD_GLOBAL":
            continue
        name = instruction.argval
        if name not in defined and not hasattr(builtins, name):
            positions = instruction.positions
            line = positions.lineno if positions else None
            yield Undefined(name, code.co_filename, line or code.co_firstlineno)
    called = [defined.get(name) for name in code.co_names]
    modules = [value for value in called if isinstance(value, ModuleType)]
    for module in modules:
        called += [getattr(module, name, None) for name in code.co_names]
    for value in called:
        inner = getattr(value, "py_func", None)
        if isinstance(inner, FunctionType) and inner not in checked and _is_own(inner):
            yield from _undefined(inner, checked)


def _is_own(function: FunctionType) -> bool:
    return function.__module__.partition(".")[0] != "kernels"
