"""Errors of numba about a kernel that numba cannot compile, each as one sentence.

The sentence has the file, the line, the code there, the broken rule and the fix. The
messages of numba are pages long and name files of numba. WITHIN and OPENINGS match
numba's messages for common mistakes; every listed mistake was tried. For all other
mistakes the sentence comes from numba.
"""

import ast
import linecache
import os
import re
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import kernels  # before numba, which then obeys no settings in the current folder

# isort: split
import numba
from numba.core import ir
from numba.core.errors import NumbaError, UnsupportedBytecodeError

from kernels.flight import Scenery
from kernels.near import Near
from kernels.neighbours import Grid
from kernels.recording import Record
from kernels.state import Flock, World
from kernels.workspace import Workspace
from kernels.worlds import Reach
from sweep.own_code import undefined
from sweep.text import shortened, similar

OTHERS = tuple(
    f"{Path(str(package.__file__)).parent}{os.sep}" for package in (numba, kernels)
)
"""Folders of numba and of the built-in kernels, without mistakes of an author."""
PLACES = re.compile(r'File "(.+?)", line (\d+)| (?:at|from) (.+\.py) \((\d+)\)')
NO_NAME = re.compile(r"NameError: name '(\w+)' is not defined")
SILENT = re.compile(r"Failed in \w+ mode pipeline|^- Resolution failure|^\s*$")
OWN_PACKAGE = re.compile(r"^own_[0-9a-f]+/")
ARGUMENTS = (Flock, World, Workspace, Grid, Near, Reach, Record, Scenery)
"""Arguments of kernels; an author may misspell their fields."""


class Place(NamedTuple):
    """Line of a file."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{_shown(self.file)}, line {self.line}"

    @property
    def code(self) -> str:
        """Code of the line, without its indentation."""
        return shortened(linecache.getline(self.file, self.line).strip())


Words = Callable[["re.Match[str]", Place | None], str]
"""Function that returns the broken rule and the fix, from numba's message and place."""


def own_line(error: BaseException) -> str:
    """Return the last line of custom code before an error; "" without one."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if OWN_PACKAGE.match(frame.filename)]
    return str(Place(own[-1].filename, own[-1].lineno or 1)) if own else ""


def of_own_code(error: BaseException) -> str | None:
    """Return an error of custom code in one line: the line of the code, and the reason.

    Returns None for any other error.
    """
    if sentence := explained(error):
        return sentence
    where = own_line(error)
    reason = " ".join(f"{type(error).__name__}: {error}".split())
    return f"{where}: {reason}" if where else None


def explained(error: BaseException) -> str | None:
    """Return the sentence about an error of compiling; None for any other error."""
    if not _is_of_the_compiler(error):
        return None
    place = _undefined(error) or _place(error)
    where = f'{place}, "{place.code}"' if place and place.code else place or "a kernel"
    return f"{where}: {_rule(str(error), place)}"


def _rule(text: str, place: Place | None) -> str:
    """Return the meaning of numba's message, or else the first line of the message."""
    opening = _from_opening(text)
    for pattern, say in WITHIN.items():
        if match := re.search(pattern, text):
            return say(match, place)
    for pattern, say in OPENINGS.items():
        if match := re.match(pattern, opening):
            return say(match, place)
    return f"numba cannot compile this: {shortened(opening.splitlines()[0].strip())}"


def _from_opening(text: str) -> str:
    """Return a message from the first informative line on."""
    lines = text.splitlines()
    while len(lines) > 1 and SILENT.search(lines[0]):
        del lines[0]
    return "\n".join(lines)


def _is_of_the_compiler(error: BaseException) -> bool:
    """Return whether an error was raised while numba compiled.

    A kernel that runs has no frames of numba.
    """
    if isinstance(error, NumbaError | UnsupportedBytecodeError):
        return True
    return any(
        frame.f_code.co_filename.startswith(OTHERS[0])
        for frame, _ in traceback.walk_tb(error.__traceback__)
    )


def _undefined(error: BaseException) -> Place | None:
    """Return the place where an undefined name is read.

    The message of numba has only the place where the function is called.
    """
    if not (match := NO_NAME.search(str(error))):
        return None
    for frame, _ in traceback.walk_tb(error.__traceback__):
        if compiled := getattr(frame.f_locals.get("self"), "py_func", None):
            uses = (use for use in undefined(compiled) if use.name == match[1])
            return next((_at(use.file, use.line) for use in uses), None)
    return None


def _place(error: BaseException) -> Place | None:
    """Return the place of a mistake: the innermost place in a file of the author.

    If there is no such place, return the innermost place in the built-in kernels.
    """
    places = [place for place in _places(error) if not place.file.startswith(OTHERS[0])]
    own = (place for place in places if not place.file.startswith(OTHERS))
    return next(own, places[0] if places else None)


def _places(error: BaseException) -> Iterator[Place]:
    """Yield the places that an error names, from the innermost place outwards.

    The places are in the message and in `loc` of the error, and in the local variables
    of numba.
    """
    for match in PLACES.finditer(str(error)):
        file, line, other_file, other_line = match.groups()
        yield _at(file or other_file, int(line or other_line))
    locations = [getattr(error, "loc", None)]
    for frame, _ in reversed(list(traceback.walk_tb(error.__traceback__))):
        values = list(frame.f_locals.values())
        locations += values
        locations += [getattr(value, "__dict__", {}).get("loc") for value in values]
    for loc in locations:
        if isinstance(loc, ir.Loc) and loc.line:
            yield _at(loc.filename, loc.line)


def _at(file: str, line: int) -> Place:
    """Return a place with an absolute path; numba writes some paths relative to cwd."""
    return Place(file if OWN_PACKAGE.match(file) else str(Path(file).resolve()), line)


def _shown(file: str) -> str:
    """Return the path of a file as the author knows the path."""
    if OWN_PACKAGE.match(file):
        return OWN_PACKAGE.sub("", file)
    path = Path(file)
    return str(
        path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    )


def _allocates(_match: "re.Match[str]", _place: Place | None) -> str:
    return (
        "this allocates memory for a new array, list, dictionary or string, which @jit"
        " rejects; loop over the elements, write into an array of work, or use a tuple"
    )


def _unknown_attribute(match: "re.Match[str]", place: Place | None) -> str:
    name, kind = match.groups()
    fields = next(
        (argument._fields for argument in ARGUMENTS if argument.__name__ == kind), ()
    )
    names = list(fields or _fields(kind, place))
    close = "" if name.startswith("_") else similar(name, names)
    has = f", which has {', '.join(names)}" if names and not close else ""
    return f'there is no "{name}" in {kind}{has}{close}'


def _fields(kind: str, place: Place | None) -> Iterator[str]:
    """Yield the fields of a class in the file of a place."""
    text = "".join(linecache.getlines(place.file)) if place else ""
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef) and node.name == kind:
            for part in node.body:
                if isinstance(part, ast.AnnAssign) and isinstance(
                    part.target, ast.Name
                ):
                    yield part.target.id


def _untyped(match: "re.Match[str]", _place: Place | None) -> str:
    name, kind = match.groups()
    if kind == "function":
        return f'"{name}" is a plain Python function; put @jit above it'
    return (
        f'"{name}" is a {kind}, which kernels cannot use; use a number, a tuple of'
        " numbers, a NumPy array or a parameter"
    )


def _no_operation(match: "re.Match[str]", _place: Place | None) -> str:
    name = re.sub(r".*[ .]|'|>", "", match[1].split(" at 0x")[0])
    return (
        f"numba has no {name}({_plain(match[2])}); a name keeps one type in a kernel,"
        " which computes with numbers, tuples and arrays"
    )


def _plain(types: str) -> str:
    """Return types as named by numba, in a shorter form."""
    types = re.sub(r"Literal\[str\]\((.*?)\)", r"'\1'", types)
    types = re.sub(r"Literal\[\w+\]\((.*?)\)", r"\1", types)
    types = re.sub(r"UniTuple\((\w+) x (\d+)\)", r"tuple of \2 \1", types)
    return re.sub(r"array\((\w+), (\d)d, \w\)", r"array of \1", types)


OPCODES: dict[str, str] = {
    "IMPORT_NAME": "put the import at the top of the file",
    "STORE_GLOBAL": "names of the module cannot be set; write into an array of work",
}
WITHIN: dict[str, Words] = {
    r"NRT required but not enabled|Only accept returning of array": _allocates,
    r"Cannot modify readonly array": lambda *_: (
        "this changes an array of the module, which is a constant in a kernel; write"
        " into an array of work or of the flock"
    ),
    r"Exception matching is limited to": lambda *_: (
        "kernels cannot tell exceptions apart, and divisions by zero raise no"
        " exception; test the condition with if"
    ),
}
"""Patterns anywhere in a message of numba, and the meaning of each pattern."""
OPENINGS: dict[str, Words] = {
    r"Unknown attribute '(\w+)' of type (\w+)": _unknown_attribute,
    r"module '(\w+)' has no attribute '(\w+)'": lambda match, _: (
        f'there is no "{match[2]}" in {match[1]}'
    ),
    NO_NAME.pattern: lambda match, _: (
        f'the name "{match[1]}" is not defined; define or import it'
    ),
    r".*Variable '(\w+)' is not defined": lambda match, _: (
        f'"{match[1]}" is read before it has a value; set a value before the loop or'
        " the condition"
    ),
    r"Untyped global name '(\w+)'.*<class '(\w+)'>": _untyped,
    r".*wrong tuple length.*expected (\d+), got (\d+)": lambda match, _: (
        f"{match[1]} names are on the left, and {match[2]} values on the right"
    ),
    r"failed to unpack none": lambda *_: (
        "several names are on the left, and the function on the right returns no"
        " value; end the function with return"
    ),
    r"failed to unpack (.+)": lambda match, _: (
        f"several names are on the left, and one value ({match[1]}) on the right"
    ),
    r"Can't unify return type from the following types: (.+)": lambda match, _: (
        f"the function returns values of different types ({_plain(match[1])}); all"
        " values must have one type"
    ),
    r".* to signature '\((.*)\).*' due to \"TypeError: (.+?)\.?\"": lambda match, _: (
        f"the call does not fit ({re.sub(r': [^,]+', '', match[1])}): {match[2]}"
    ),
    r"Use of unsupported opcode \((\w+)\)": lambda match, _: (
        "kernels know only a part of Python:"
        f" {OPCODES.get(match[1], f'the instruction {match[1]} is missing')}"
    ),
    r"No definition for lowering (\w+)\(.*\)\.(\w+) = ": lambda match, _: (
        f'"{match[2]}" of {match[1]} cannot be set, because a tuple is constant; use a'
        " variable, or change the elements of an array"
    ),
    r"No implementation of function Function\((.+?)\) found for signature:"
    r"\s+>>> \w+\((.*)\)": _no_operation,
}
"""Patterns at the beginning of a message of numba, and the meaning of each pattern."""
