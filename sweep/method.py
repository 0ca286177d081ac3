"""The entry of a method, and the registry of methods.

A method is an analysis of the results of a study, such as the search for a level that a
mean crosses. A built-in method is a folder in `sweep/methods`. The module `method` of
this folder has the entry, METHOD. No other file names a method. A package offers a
method as an entry point of the group `boidsweep.methods`.

Methods import many packages. So the registry finds methods by folder, and imports all
methods at the first use. Every module may loop over methods, and no module depends on a
method.
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
    reports : sequence of callable
        Functions that return a `Report` of a stored study, the first argument. Each
        function becomes a command with the name of the function. The parameters become
        options, and the docstring becomes the help. The lines of the section Examples
        are commands, which end the help.
    reports_of_results : sequence of callable
        Functions that return a `Report` of a folder of results, the argument `results`.
        Such a function chooses studies and trials.
    figures : callable
        Function that imports and returns kinds of figures by name. A package offers
        kinds as entry points of the group `boidsweep.figures`.
    sections : callable
        Function that imports and returns sections that a spec may have, each a
        `sweep.spec.section.SpecSection`.
    keep_apart : callable
        Function that takes and returns a stored study. The result keeps apart groups of
        trials that no mean may combine, such as the phases of a search.
    directions : callable
        Function of a stored study that returns the optimised columns of trials, the
        most important column first. Each column has True if high values are better.
    status : callable
        Function of a stored study that returns lines of `sweep status` by label.
    unfinished : callable
        Function of a stored study that returns the reason, in words, for trials that
        will follow and are not in the plan yet. The result is "" without such trials.
    in_figures : sequence of str
        Public names of the method that `sweep.figures` offers to notebooks.
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
    """Return the built-in methods by name, without methods of packages."""
    modules = pkgutil.iter_modules([str(Path(__file__).with_name(FOLDER))])
    names = sorted(module.name for module in modules if module.ispkg)
    return {
        name: import_module(f"{__package__}.{FOLDER}.{name}.method").METHOD
        for name in names
    }


@cache
def methods() -> "Registry[Method]":
    """Return all methods by name: built-in methods and methods of packages."""
    from kernels.registry import Registry

    return Registry(GROUP, Method, own_methods())


def may_have_others() -> bool:
    """Return whether a package may offer methods, without an import of kernels."""
    return bool(entry_points(group=GROUP))
