"""The entry of a method, and the registry of methods.

A method is an analysis of the results of a study, such as the search for a level that a
mean crosses. It is a folder in `sweep/methods`, whose module `method` has its entry,
METHOD. No other file names a method. A package offers a method as an entry point of the
group `boidsweep.methods`.

Methods import many other packages. So the registry finds them by their folders and
imports them at its first use: every module may loop over methods, and none depends on
one.
"""

import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import entry_points
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kernels.registry import Registry

FOLDER = "methods"
GROUP = "boidsweep.methods"


@dataclass(frozen=True)
class Method:
    """An analysis of the results of a study.

    Attributes
    ----------
    reports
        Functions that return a `Report` of a stored study, their first argument. Each
        becomes a command of its name, with its options and its docstring as the help.
        Lines of the section Examples are commands, which end the help.
    reports_of_results
        Functions that return a `Report` of a folder of results, their argument
        `results`. They choose studies and trials themselves.
    figures
        A function that returns kinds of figures by their names. It imports them. A
        package offers kinds as entry points of the group `boidsweep.figures`.
    sections
        A function that returns sections that a spec may have, each a
        `sweep.spec.section.SpecSection`. It imports them.
    keep_apart
        A function of a stored study that returns it with those of its trials apart
        that nothing is averaged over, such as the phases of a search.
    directions
        A function of a stored study that returns the columns of trials that it
        optimizes, first ones first, each with True if high values are better.
    status
        A function of a stored study that returns lines of `sweep status`, by their
        labels.
    unfinished
        A function of a stored study that returns why trials follow that its plan does
        not have yet, in words, or "" where none do.
    in_figures
        Names of the face of the method that `sweep.figures` hands on to notebooks.
    """

    reports: Sequence[Callable[..., Any]] = ()
    reports_of_results: Sequence[Callable[..., Any]] = ()
    figures: Callable[[], Mapping[str, Any]] = dict
    in_figures: Sequence[str] = ()
    status: Callable[[Any], Mapping[str, str]] = lambda _study: {}
    unfinished: Callable[[Any], str] = lambda _study: ""
    sections: Callable[[], Sequence[Any]] = tuple
    keep_apart: Callable[[Any], Any] = lambda study: study
    directions: Callable[[Any], Mapping[str, bool]] = lambda _study: {}


@cache
def own_methods() -> Mapping[str, Method]:
    """Return the built-in methods by their names, without those of packages."""
    modules = pkgutil.iter_modules([str(Path(__file__).with_name(FOLDER))])
    names = sorted(module.name for module in modules if module.ispkg)
    return {
        name: import_module(f"{__package__}.{FOLDER}.{name}.method").METHOD
        for name in names
    }


@cache
def methods() -> "Registry[Method]":
    """Return all methods by their names: built-in, and of installed packages."""
    from kernels.registry import Registry

    return Registry(GROUP, Method, own_methods())


def may_have_others() -> bool:
    """Return whether a package may offer methods, without an import of kernels."""
    return bool(entry_points(group=GROUP))
