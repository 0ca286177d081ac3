"""Modules of installed packages, which a spec names by `their_package.vortex:MODEL`.

The text of a package is not sent to workers: the package must be installed on every
machine that runs trials. The code of a package has a hash; a process rejects a package
with another hash.
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
    """An installed package.

    Attributes
    ----------
    name : str
        Name in imports.
    owner : str
        The distribution: ``name version``.
    sha : str
        The sha256 of the code.
    """

    name: str
    owner: str
    sha: str


def installed_package(module: str) -> Installed:
    """Return the installed package that has a module, without an import.

    Raises CodeError if no package of that name is installed.
    """
    name = module.partition(".")[0]
    distribution = _providers().get(name)
    if distribution is None or not (paths := locations(name)):
        message = unknown("installed package", name, sorted(_providers()))
        raise CodeError(f"{module}: {message}")
    owner = f"{distribution.name} {distribution.version}"
    return Installed(name, owner, package_sha(*paths))


def locations(package: str) -> list[Path]:
    """Return the folders of a package, or the file of a package that is a module."""
    spec = find_spec(package)
    if spec is None:
        return []
    paths = map(Path, spec.submodule_search_locations or [spec.origin or ""])
    return [path for path in paths if path.is_dir() or path.suffix == SUFFIX]


def installed_module(module: str, package: Installed) -> ModuleType:
    """Import a module of a package, and return the module.

    Raises CodeError if the installed package has other code than `package`, if the
    package was edited after the import, and for any error of the import.
    """
    here = installed_package(module)
    if here.sha != package.sha:
        raise CodeError(
            f"{module}: the trials need the code of {package.owner}, which differs from"
            f" the code of {here.owner}, installed here"
        )
    if _IMPORTED.setdefault(here.name, here.sha) != here.sha:
        raise CodeError(
            f"{module}: {here.owner} was edited after this process had imported the"
            " package; begin a new process"
        )
    try:
        return import_module(module)
    except Exception as error:
        raise CodeError(f"{module}: {type(error).__name__}: {error}") from error


@cache
def _providers() -> dict[str, Distribution]:
    """Return the distribution of each package and module that is installed."""
    providers = dict[str, Distribution]()
    for distribution in distributions(path=places()):
        listed = (distribution.read_text("top_level.txt") or "").split()
        paths = distribution.files or ()
        files = {path.parts[0].removesuffix(".py") for path in paths}
        for name in {*listed, *files, distribution.name.replace("-", "_")}:
            if name.isidentifier() and name not in sys.stdlib_module_names:
                providers.setdefault(name, distribution)
    return providers
