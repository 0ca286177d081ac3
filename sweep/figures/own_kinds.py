"""Custom kinds of figures, in files that the arguments of `sweep plot` name.

An argument is `./mine.py`, or `./mine.py:NAME` for a single kind in the file. The file
defines FIGURES, a mapping from names to FigureKinds. Naming a file runs the file. The
file is not part of the study.
"""

from collections import ChainMap
from collections.abc import Mapping, Sequence
from pathlib import Path

from sweep.errors import CodeError
from sweep.figures.kinds import KINDS
from sweep.figures.planning import FigureKind
from sweep.own_code import SUFFIX, gather, load, table_of
from sweep.text import unknown

Kinds = Mapping[str, FigureKind]


def with_files(names: Sequence[str]) -> tuple[list[str], Kinds]:
    """Return the names of the chosen kinds, and all kinds including custom kinds.

    Each file among `names` is replaced by the names of the kinds in the file. Raises
    CodeError for a file without kinds, for an unknown kind of a file, and for a name
    that is taken.
    """
    own = dict[str, FigureKind]()
    plain = list[str]()
    for name in names:
        path, _, kind = name.partition(":")
        if not path.endswith(SUFFIX):
            plain.append(name)
            continue
        in_file = _in_file(Path(path))
        if kind and kind not in in_file:
            raise CodeError(unknown(f"figure of {path}", kind, in_file))
        chosen = {kind: in_file[kind]} if kind else in_file
        if taken := [new for new in chosen if new in KINDS or new in own]:
            raise CodeError(f'{path}: a kind "{taken[0]}" exists already')
        own |= chosen
        plain += chosen
    return plain, ChainMap(own, KINDS)


def _in_file(path: Path) -> dict[str, FigureKind]:
    sources = gather(path.parent, [path.name])
    kinds = table_of(load(sources, path.name), path.name, "FIGURES", FigureKind)
    if not kinds:
        raise CodeError(f"{path.name} has no FIGURES")
    return kinds
