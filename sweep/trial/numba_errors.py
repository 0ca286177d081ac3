"""What numba says of a kernel that it cannot compile, as one sentence: file, line, the
code there, the rule that is broken, and the way out.

numba's own messages are pages long and name its own files. WITHIN and OPENINGS have
what they say of the usual mistakes, each of which was made to find out. Of others the
sentence is numba's own.
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
from sweep.own_code.names import undefined
from sweep.text import shortened, similar

OTHERS = tuple(
    f"{Path(str(package.__file__)).parent}{os.sep}" for package in (numba, kernels)
)
"""Folders in which the author of a model has made no mistake."""
PLACES = re.compile(r'File "(.+?)", line (\d+)| (?:at|from) (.+\.py) \((\d+)\)')
NO_NAME = re.compile(r"NameError: name '(\w+)' is not defined")
SILENT = re.compile(r"Failed in \w+ mode pipeline|^- Resolution failure|^\s*$")
OWN_PACKAGE = re.compile(r"^own_[0-9a-f]+/")
GIVEN = (Flock, World, Workspace, Grid, Near, Reach, Record, Scenery)
"""What kernels are given, whose fields an author may misspell."""


class Place(NamedTuple):
    """A line of a file."""

    file: str
    line: int

    def __str__(self) -> str:
        return f"{_shown(self.file)}, line {self.line}"

    @property
    def code(self) -> str:
        """The text of the line, without what is indented."""
        return shortened(linecache.getline(self.file, self.line).strip())


Words = Callable[["re.Match[str]", Place | None], str]
"""The rule that is broken, and the way out, from what numba said and where."""


def own_line(error: BaseException) -> str:
    """The last line of a file of one's own that led to an error; "" if none did."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if OWN_PACKAGE.match(frame.filename)]
    return str(Place(own[-1].filename, own[-1].lineno or 1)) if own else ""


def of_own_code(error: BaseException) -> str | None:
    """What an error says to which code of one's own led, in one line: the line of the
    code, and why. None for any other error.
    """
    if said := explained(error):
        return said
    where = own_line(error)
    words = " ".join(f"{type(error).__name__}: {error}".split())
    return f"{where}: {words}" if where else None


def explained(error: BaseException) -> str | None:
    """The sentence about an error that came up while a kernel was compiled; None for
    any other error.
    """
    if not _is_of_the_compiler(error):
        return None
    place = _undefined(error) or _place(error)
    where = f'{place}, "{place.code}"' if place and place.code else place or "a kernel"
    return f"{where}: {_rule(str(error), place)}"


def _rule(text: str, place: Place | None) -> str:
    """What numba's text means, or else its first line."""
    opening = _from_opening(text)
    for pattern, say in WITHIN.items():
        if found := re.search(pattern, text):
            return say(found, place)
    for pattern, say in OPENINGS.items():
        if found := re.match(pattern, opening):
            return say(found, place)
    return f"numba cannot compile this: {shortened(opening.splitlines()[0].strip())}"


def _from_opening(text: str) -> str:
    """A message from its first line on that says something."""
    lines = text.splitlines()
    while len(lines) > 1 and SILENT.search(lines[0]):
        del lines[0]
    return "\n".join(lines)


def _is_of_the_compiler(error: BaseException) -> bool:
    """Whether numba was at work when it was raised. A kernel that runs has no frames of
    numba's any more.
    """
    if isinstance(error, NumbaError | UnsupportedBytecodeError):
        return True
    return any(
        frame.f_code.co_filename.startswith(OTHERS[0])
        for frame, _ in traceback.walk_tb(error.__traceback__)
    )


def _undefined(error: BaseException) -> Place | None:
    """Where a name is read that stands for nothing: numba only says from where the
    function is called.
    """
    if not (found := NO_NAME.search(str(error))):
        return None
    for frame, _ in traceback.walk_tb(error.__traceback__):
        if compiled := getattr(frame.f_locals.get("self"), "py_func", None):
            wrong = (one for one in undefined(compiled) if one.name == found[1])
            return next((_at(one.file, one.line) for one in wrong), None)
    return None


def _place(error: BaseException) -> Place | None:
    """Where the mistake is: the innermost place in a file of the author's, or else in
    one of ours.
    """
    places = [one for one in _places(error) if not one.file.startswith(OTHERS[0])]
    own = (one for one in places if not one.file.startswith(OTHERS))
    return next(own, places[0] if places else None)


def _places(error: BaseException) -> Iterator[Place]:
    """The places that an error names, from the inside out: in its text, as its `loc`,
    and in what numba was looking at.
    """
    for one in PLACES.finditer(str(error)):
        file, line, other, number = one.groups()
        yield _at(file or other, int(line or number))
    seen = [getattr(error, "loc", None)]
    for frame, _ in reversed(list(traceback.walk_tb(error.__traceback__))):
        values = list(frame.f_locals.values())
        seen += [*values, *(getattr(one, "__dict__", {}).get("loc") for one in values)]
    for loc in seen:
        if isinstance(loc, ir.Loc) and loc.line:
            yield _at(loc.filename, loc.line)


def _at(file: str, line: int) -> Place:
    """numba writes some paths relative to the folder in which we stand."""
    return Place(file if OWN_PACKAGE.match(file) else str(Path(file).resolve()), line)


def _shown(file: str) -> str:
    """A file as its author knows it."""
    if OWN_PACKAGE.match(file):
        return OWN_PACKAGE.sub("", file)
    path = Path(file)
    return str(
        path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path
    )


def _allocates(_found: "re.Match[str]", _place: Place | None) -> str:
    return (
        "this allocates memory for a new array, list, dictionary or text, which @jit"
        " refuses; loop over the elements, write into an array that is there, as those"
        " of work, or use a tuple"
    )


def _unknown_attribute(found: "re.Match[str]", place: Place | None) -> str:
    name, kind = found.groups()
    fields = next((one._fields for one in GIVEN if one.__name__ == kind), ())
    names = list(fields or _fields(kind, place))
    close = "" if name.startswith("_") else similar(name, names)
    has = f", which has {', '.join(names)}" if names and not close else ""
    return f'there is no "{name}" in {kind}{has}{close}'


def _fields(kind: str, place: Place | None) -> Iterator[str]:
    """The fields of a class in the file of a place."""
    text = "".join(linecache.getlines(place.file)) if place else ""
    for node in ast.parse(text).body:
        if isinstance(node, ast.ClassDef) and node.name == kind:
            for part in node.body:
                if isinstance(part, ast.AnnAssign) and isinstance(
                    part.target, ast.Name
                ):
                    yield part.target.id


def _untyped(found: "re.Match[str]", _place: Place | None) -> str:
    name, kind = found.groups()
    if kind == "function":
        return f'"{name}" is a plain Python function; put @jit above it'
    return (
        f'"{name}" is a {kind}, which kernels cannot use; make it a number, a tuple of'
        " numbers or a NumPy array, or a setting"
    )


def _no_operation(found: "re.Match[str]", _place: Place | None) -> str:
    name = re.sub(r".*[ .]|'|>", "", found[1].split(" at 0x")[0])
    return (
        f"numba has no {name}({_plain(found[2])}); a name keeps one type in a kernel,"
        " which computes with numbers and their tuples and arrays"
    )


def _plain(types: str) -> str:
    """Types as numba writes them, in fewer signs."""
    types = re.sub(r"Literal\[str\]\((.*?)\)", r"'\1'", types)
    types = re.sub(r"Literal\[\w+\]\((.*?)\)", r"\1", types)
    types = re.sub(r"UniTuple\((\w+) x (\d+)\)", r"tuple of \2 \1", types)
    return re.sub(r"array\((\w+), (\d)d, \w\)", r"array of \1", types)


OPCODES: dict[str, str] = {
    "IMPORT_NAME": "import stands at the top of the file",
    "STORE_GLOBAL": "no name of the module can be set; write into an array of work",
}
WITHIN: dict[str, Words] = {
    r"NRT required but not enabled|Only accept returning of array": _allocates,
    r"Cannot modify readonly array": lambda *_: (
        "this changes an array of the module, which is a constant in a kernel; write"
        " into an array of work or of the flock"
    ),
    r"Exception matching is limited to": lambda *_: (
        "kernels cannot tell exceptions apart, and divisions by zero raise none; ask"
        " for the condition itself with if"
    ),
}
"""Patterns anywhere in what numba says, and what that means."""
OPENINGS: dict[str, Words] = {
    r"Unknown attribute '(\w+)' of type (\w+)": _unknown_attribute,
    r"module '(\w+)' has no attribute '(\w+)'": lambda found, _: (
        f'there is no "{found[2]}" in {found[1]}'
    ),
    NO_NAME.pattern: lambda found, _: (
        f'the name "{found[1]}" stands for nothing; define or import it'
    ),
    r".*Variable '(\w+)' is not defined": lambda found, _: (
        f'"{found[1]}" is read before it has a value; give it one before the loop or'
        " the condition"
    ),
    r"Untyped global name '(\w+)'.*<class '(\w+)'>": _untyped,
    r".*wrong tuple length.*expected (\d+), got (\d+)": lambda found, _: (
        f"{found[1]} names stand on the left, and {found[2]} values on the right"
    ),
    r"failed to unpack none": lambda *_: (
        "several names stand on the left, and the function on the right returns"
        " nothing; end it with return"
    ),
    r"failed to unpack (.+)": lambda found, _: (
        f"several names stand on the left, and one value ({found[1]}) on the right"
    ),
    r"Can't unify return type from the following types: (.+)": lambda found, _: (
        f"the function returns values of different types ({_plain(found[1])}); every"
        " return must give the same"
    ),
    r".* to signature '\((.*)\).*' due to \"TypeError: (.+?)\.?\"": lambda found, _: (
        f"the call does not fit ({re.sub(r': [^,]+', '', found[1])}): {found[2]}"
    ),
    r"Use of unsupported opcode \((\w+)\)": lambda found, _: (
        "kernels know only a part of Python:"
        f" {OPCODES.get(found[1], f'the instruction {found[1]} is not in it')}"
    ),
    r"No definition for lowering (\w+)\(.*\)\.(\w+) = ": lambda found, _: (
        f'"{found[2]}" of {found[1]} cannot be set, as that is a tuple; use a'
        " variable, or change the elements of an array"
    ),
    r"No implementation of function Function\((.+?)\) found for signature:"
    r"\s+>>> \w+\((.*)\)": _no_operation,
}
"""Patterns of how numba begins, and what that means."""
