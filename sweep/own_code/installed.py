"""Modules of installed packages that a spec names, `their_package.vortex:MODEL`.

Their text does not travel: a package is installed wherever its trials run. So its code
has a hash, and a process whose package has another one refuses.
"""

import sys
from functools import cache
from importlib import import_module
from importlib.metadata import Distribution, distributions
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from kernels.identity import package_sha
from kernels.registry import places
from sweep.errors import CodeError
from sweep.own_code.sources import SUFFIX
from sweep.text import unknown

_IMPORTED: dict[str, str] = {}
"""The hash of each package when this process imported it."""


class Installed(NamedTuple):
    """A package: its name when it is imported, its distribution as `name version`, and
    the sha256 of its code.
    """

    name: str
    owner: str
    sha: str


def installed_package(module: str) -> Installed:
    """The package that has a module, as it is installed here; nothing is imported.

    Raises CodeError where no package of that name is installed.
    """
    name = module.partition(".")[0]
    distribution = _providers().get(name)
    if distribution is None or not (found := locations(name)):
        message = unknown("installed package", name, sorted(_providers()))
        raise CodeError(f"{module}: {message}")
    owner = f"{distribution.name} {distribution.version}"
    return Installed(name, owner, package_sha(*found))


def locations(package: str) -> list[Path]:
    """The folders of a package, or the file of one that is a single module."""
    found = find_spec(package)
    if found is None:
        return []
    whole = found.submodule_search_locations or [found.origin or ""]
    places = map(Path, whole)
    return [place for place in places if place.is_dir() or place.suffix == SUFFIX]


def installed_module(module: str, package: Installed) -> ModuleType:
    """The module of a package, which is imported. Raises CodeError where the package
    has other code here, and for whatever is wrong with it.
    """
    here = installed_package(module)
    if here.sha != package.sha:
        raise CodeError(
            f"{module}: the code of {package.owner}, by which the trials are computed,"
            f" is not that of {here.owner}, which is installed here"
        )
    if _IMPORTED.setdefault(here.name, here.sha) != here.sha:
        raise CodeError(
            f"{module}: {here.owner} was edited after this process had imported it;"
            " begin a new process"
        )
    try:
        return import_module(module)
    except Exception as error:
        raise CodeError(f"{module}: {type(error).__name__}: {error}") from error


@cache
def _providers() -> dict[str, Distribution]:
    """The distribution of each package and module that is installed."""
    found = dict[str, Distribution]()
    for one in distributions(path=places()):
        listed = (one.read_text("top_level.txt") or "").split()
        files = {file.parts[0].removesuffix(".py") for file in one.files or ()}
        for name in {*listed, *files, one.name.replace("-", "_")}:
            if name.isidentifier() and name not in sys.stdlib_module_names:
                found.setdefault(name, one)
    return found
