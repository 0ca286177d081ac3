"""Who imports whom."""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter

from tests.house.sources import Checkout, Finding, Module

MAY_IMPORT = {
    "kernels": "",
    "errors": "",
    "text": "",
    "surroundings": "",
    "method": "kernels",
    "analysis": "text",
    "spec": "kernels errors text method analysis",
    "recordings": "kernels errors text spec",
    "own_code": "kernels errors text spec recordings",
    "design": "kernels text spec",
    "trial": "kernels errors text surroundings spec recordings own_code design",
    "store": "kernels errors text spec recordings own_code design trial",
    "workers": "kernels errors text surroundings spec design trial store",
    "testing": "kernels errors text spec own_code design trial workers",
    "tables": "kernels errors text method analysis spec design trial store workers",
    "campaigns": (
        "kernels errors text spec own_code design trial store workers testing tables"
    ),
    "figures": ("kernels errors text method analysis spec own_code trial store tables"),
    "methods": (
        "errors text method analysis spec design trial store workers tables campaigns"
        " figures"
    ),
    "loaded": "errors text method analysis spec tables methods",
    "replays": ("kernels errors text spec design trial store workers tables figures"),
    "published": (
        "kernels errors text method analysis spec recordings own_code design store"
        " workers tables methods campaigns figures"
    ),
    "sharing": (
        "kernels errors text spec design store workers tables campaigns replays"
        " published"
    ),
    "web": (
        "kernels errors text spec own_code design trial store tables figures replays"
        " sharing"
    ),
    "explorer": (
        "errors text analysis spec design trial store workers tables methods figures"
        " replays published sharing web"
    ),
    "cli": (
        "kernels errors text surroundings method spec own_code design trial store"
        " workers tables testing methods campaigns figures replays published sharing"
        " web explorer"
    ),
}
"""The house: what each package imports. A study flows down this list, and every arrow
points up. Imports within functions and for types count like all others.
"""
KERNEL_FACTS = {"kernels"} | {
    f"kernels.{name}"
    for name in (
        "catalogue",
        "identity",
        "metrics",
        "metrics.parts",
        "model",
        "models",
        "playback",
        "profiles",
        "registry",
        "robots.abilities",
        "robots.readers",
        "robots.robots",
        "settings",
        "shapes",
        "starts",
        "topology",
        "worlds",
    )
}
"""What a model, a metric, a setting or a map is called and is like: all may know it.
The rest of the kernels is met in `sweep/trial/` alone.
"""
TABLE = "tests/house/imports.py"


def within(module: str, packages: set[str]) -> bool:
    return any(
        module == package or module.startswith(package + ".") for package in packages
    )


def dotted(name: str) -> str:
    """The module of a file."""
    return name.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


@cache
def files_of(checkout: Checkout) -> dict[str, str]:
    """The files of our own modules."""
    return {dotted(name): name for name in checkout.modules}


@cache
def arrows(checkout: Checkout, module: Module) -> dict[str, int]:
    """Our own modules that a file imports from, and in which line first."""
    ours = files_of(checkout)
    found: dict[str, int] = {}
    for line, imported in module.imports:
        while imported not in ours and "." in imported:
            imported = imported.rpartition(".")[0]
        if imported in ours and imported != dotted(module.name):
            found.setdefault(imported, line)
    return found


def is_package(file: str) -> bool:
    return file.endswith("/__init__.py")


def package(module: str) -> str:
    """The package of a module, or the module on the ground."""
    first, *rest = module.split(".")
    return first if first == "kernels" or not rest else rest[0]


def no_import_is_relative(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.modules.values():
        for line, imported in module.imports:
            if imported.startswith("."):
                yield module.finding(line, "a relative import")


def packages_import_what_the_table_says(checkout: Checkout) -> Iterator[Finding]:
    """And no less."""
    unused = {
        (name, other) for name, others in MAY_IMPORT.items() for other in others.split()
    }
    for dotted_name, name in files_of(checkout).items():
        if dotted_name == "sweep":  # the package itself hands everything on
            continue
        own, module = package(dotted_name), checkout.modules[name]
        if own not in MAY_IMPORT:
            yield module.finding(1, f"{own} is missing in MAY_IMPORT of {TABLE}")
        for imported, line in arrows(checkout, module).items():
            other = package(imported)
            if other not in {own, *MAY_IMPORT.get(own, "").split()}:
                yield module.finding(line, f"{own} may not import {other}")
            unused.discard((own, other))
    for own, other in unused:
        yield Finding(TABLE, 1, f"{own} may import {other}, and does not")


def arrows_of_the_table_point_up(_checkout: Checkout) -> Iterator[Finding]:
    above: set[str] = set()
    for name, others in MAY_IMPORT.items():
        for other in set(others.split()) - above:
            yield Finding(TABLE, 1, f"{name} may import {other}, which is not above it")
        above.add(name)


def no_files_import_each_other_in_a_circle(checkout: Checkout) -> Iterator[Finding]:
    files = files_of(checkout)
    graph = {
        dotted_name: arrows(checkout, checkout.modules[name]).keys()
        for dotted_name, name in files.items()
    }
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        circle = error.args[1][::-1]  # each imports the next
        first = checkout.modules[files[circle[0]]]
        line = arrows(checkout, first)[circle[1]]
        yield first.finding(line, f"a circle: {' -> '.join(circle)}")


def others_import_from_the_face_of_a_package(checkout: Checkout) -> Iterator[Finding]:
    """The face is `__init__`, whose stub lists what others take. What is behind it may
    move.
    """
    packages = {name for name, file in files_of(checkout).items() if is_package(file)}
    for module in checkout.part("sweep/"):
        own = dotted(module.name)
        for node in module.nodes:
            if not isinstance(node, ast.ImportFrom) or node.module in packages:
                continue
            face = (node.module or "").rpartition(".")[0]
            is_ours = face in packages and face.startswith("sweep.")
            if is_ours and not within(own, {face}):
                what = f"imports from {node.module}, and not from {face}"
                yield module.finding(node, what)


def a_name_of_a_face_is_no_module(checkout: Checkout) -> Iterator[Finding]:
    """Once a module is imported, it is an attribute of its package, and would be what
    others get by its name.
    """
    files = files_of(checkout)
    for stub in checkout.files("sweep/**/__init__.pyi"):
        document = checkout.document(stub)
        package = dotted(stub.removesuffix("i"))
        for node in ast.parse(document.text).body:
            if not isinstance(node, ast.ImportFrom) or node.module is None:
                continue
            for alias in node.names:
                if f"{package}.{alias.name}" in files:
                    what = f"{alias.name} of {node.module} is a module of {package} too"
                    yield Finding(stub, node.lineno, what)


def the_machine_knows_no_experiment(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.part("sweep"):
        for line, imported in module.imports:
            if within(imported, {"experiments", "notebooks", "tests"}):
                yield module.finding(line, f"sweep may not import {imported}")


def kernels_are_met_in_one_place(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.part("sweep"):
        if module.name.startswith("sweep/trial/"):
            continue
        for imported, line in arrows(checkout, module).items():
            if within(imported, {"kernels"}) and imported not in KERNEL_FACTS:
                yield module.finding(line, f"only sweep/trial may import {imported}")


RULES = (
    no_import_is_relative,
    packages_import_what_the_table_says,
    arrows_of_the_table_point_up,
    no_files_import_each_other_in_a_circle,
    others_import_from_the_face_of_a_package,
    a_name_of_a_face_is_no_module,
    the_machine_knows_no_experiment,
    kernels_are_met_in_one_place,
)
