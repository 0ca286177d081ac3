"""Registries: built-in entries and entries of installed packages, by name.

The metadata of a package lists the offered entries, as entry points of a group:

    [project.entry-points."boidsweep.models"]
    vortex = "their_package.vortex:MODEL"

The search covers installed packages only, never the current folder or a folder of
PYTHONPATH. The lookup of a name that is not built in, and a list of all entries, import
the code of packages. An entry that cannot be used is left out, and `refused` gives the
reason. An entry may not take the name of a built-in entry or of an entry of another
package.
"""

import site
import sys
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from importlib.metadata import Distribution, EntryPoint, distributions
from pathlib import Path
from typing import TypeVar

OURS = "boidsweep."
"""Prefix of the groups of entry points."""

T = TypeVar("T")


class Registry(MutableMapping[str, T]):
    """Entries of one kind by name, in the order of their registration.

    `group` is the group of entry points. `origins` maps the name of each entry of
    another package to the distribution with the entry. `refused` maps the name of each
    unusable entry to the reason. `flaw` returns the reason why an entry of another
    package is unusable, or "". `derive` returns the entry of a name that follows from
    listed names, or None. Derived names are not listed.
    """

    def __init__(
        self,
        group: str,
        kind: type[T],
        own: Mapping[str, T],
        flaw: Callable[[T], str] = lambda _entry: "",
        derive: Callable[[str], T | None] = lambda _name: None,
    ) -> None:
        self.group = group
        self.kind = kind
        self._own = dict(own)
        self.flaw = flaw
        self._derive = derive
        self._others: dict[str, T] | None = None
        self.origins: dict[str, str] = {}
        self.refused: dict[str, str] = {}

    def __getitem__(self, name: str) -> T:
        if name in self._own:
            return self._own[name]
        if name in self._installed():
            return self._installed()[name]
        if (entry := self._derive(name)) is None:
            raise KeyError(name)
        return entry

    def __contains__(self, name: object) -> bool:
        listed = name in self._own or name in self._installed()
        return listed or (isinstance(name, str) and self._derive(name) is not None)

    def __iter__(self) -> Iterator[str]:
        yield from list(self._own)
        yield from list(self._installed())

    def __len__(self) -> int:
        return len(self._own) + len(self._installed())

    def __setitem__(self, name: str, entry: T) -> None:
        self._own[name] = entry

    def __delitem__(self, name: str) -> None:
        del self._own[name]

    def __repr__(self) -> str:
        return f"Registry({self.group!r}, {list(self)})"

    def _installed(self) -> dict[str, T]:
        """Return the entries of installed packages; the first call imports these."""
        if self._others is None:
            # The import of a package may call this function.
            self._others = {}
            offered: dict[str, list[EntryPoint]] = {}
            for point in installed(self.group):
                offered.setdefault(point.name, []).append(point)
            for name, points in sorted(offered.items()):
                self._enter(name, points)
        return self._others

    def _enter(self, name: str, points: list[EntryPoint]) -> None:
        """Enter the entry of installed packages under a name, or reject the entry."""
        assert self._others is not None
        point = points[0]
        owners = [owner(offered) for offered in points]
        if name in self._own:
            self.refused[name] = f"{owners[0]} offers it too, and it is one of ours"
        elif len(points) > 1:
            self.refused[name] = f"several packages offer it: {', '.join(owners)}"
        else:
            try:
                entry = point.load()
            except Exception as error:
                words = f"{type(error).__name__}: {error}"
                self.refused[name] = f"{owners[0]} has it in {point.value}: {words}"
                return
            if not isinstance(entry, self.kind):
                mismatch = f"no {self.kind.__name__} but a {type(entry).__name__}"
                self.refused[name] = f"{owners[0]} has in {point.value} {mismatch}"
            elif flaw := self.flaw(entry):
                self.refused[name] = f"{owners[0]} has it in {point.value}: {flaw}"
            else:
                self._others[name] = entry
                self.origins[name] = owners[0]


def owner(point: EntryPoint) -> str:
    """Return the distribution of an entry point: name and version."""
    assert point.dist is not None
    return f"{point.dist.name} {point.dist.version}"


def packages() -> set[str]:
    """Return the names of the installed packages with entries of any kind."""
    return {point.module.partition(".")[0] for point in installed(OURS)}


def installed(groups: str) -> list[EntryPoint]:
    """Return the entry points of installed packages, of groups with a prefix.

    Each distribution in the folders of installed packages counts once.
    """
    every = list(distributions(path=places()))
    if not any(_points(distribution, groups) for distribution in every):
        return []  # reading the names of all distributions takes long
    # Python imports the first distribution of a name in the order of the path.
    by_name = {distribution.name: distribution for distribution in reversed(every)}
    return [
        point
        for _, distribution in sorted(by_name.items())
        for point in _points(distribution, groups)
    ]


def _points(distribution: Distribution, groups: str) -> list[EntryPoint]:
    """Return the entry points of a distribution, in groups with the prefix `groups`."""
    points = distribution.entry_points
    return [point for point in points if point.group.startswith(groups)]


def places() -> list[str]:
    """Return the folders of the path into which packages are installed."""
    return [path for path in sys.path if _is_for_packages(path)]


def _is_for_packages(path: str) -> bool:
    """Return whether packages are installed into a folder of the path.

    The current folder and the folders of PYTHONPATH may have any content.
    """
    usual = {*site.getsitepackages(), site.getusersitepackages()}
    return path in usual or Path(path).name in ("site-packages", "dist-packages")
