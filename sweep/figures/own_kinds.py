"""Kinds of figures in files of the user's own, which `sweep plot` is given:
`sweep plot STUDY ./mine.py`, or `./mine.py:NAME` where a file has several.

A file has them as FIGURES, a mapping from names to FigureKinds. It runs when it is
named, and is no part of the study.
"""

from collections import ChainMap
from collections.abc import Mapping, Sequence
from pathlib import Path

from sweep.errors import CodeError
from sweep.figures.kinds import KINDS
from sweep.figures.planning import FigureKind
from sweep.own_code.entries import table_of
from sweep.own_code.loading import load
from sweep.own_code.sources import SUFFIX, gather
from sweep.text import unknown

Kinds = Mapping[str, FigureKind]


def with_files(names: Sequence[str]) -> tuple[list[str], Kinds]:
    """The names of the kinds that are asked for, and all kinds, with those of the files
    among `names`.

    Raises CodeError for a file that has none, or one of a name that is taken.
    """
    own, plain = dict[str, FigureKind](), list[str]()
    for name in names:
        path, _, one = name.partition(":")
        if not path.endswith(SUFFIX):
            plain.append(name)
            continue
        found = _in_file(Path(path))
        if one and one not in found:
            raise CodeError(unknown(f"figure of {path}", one, found))
        wanted = {one: found[one]} if one else found
        if taken := [new for new in wanted if new in KINDS or new in own]:
            raise CodeError(f'{path}: there is a kind "{taken[0]}" already')
        own |= wanted
        plain += wanted
    return plain, ChainMap(own, KINDS)


def _in_file(path: Path) -> dict[str, FigureKind]:
    sources = gather(path.parent, [path.name])
    kinds = table_of(load(sources, path.name), path.name, "FIGURES", FigureKind)
    if not kinds:
        raise CodeError(f"{path.name} has no FIGURES")
    return kinds
