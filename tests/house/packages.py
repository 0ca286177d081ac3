"""What packages, modules and classes say of themselves, and where their tests lie."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from tests.house.sources import Checkout, Finding

TESTED_TOGETHER = {
    *("attacks", "bench", "cluster", "docs", "examples", "experiments", "faults"),
    *("house", "mutants", "naive"),
}
"""Folders of tests that belong to no single package."""


def a_package_says_what_each_of_its_modules_is_for(
    checkout: Checkout,
) -> Iterator[Finding]:
    """Each stands in its docstring, followed by a few words."""
    for module in checkout.part("sweep"):
        if not module.name.endswith("__init__.py"):
            continue
        map_of = ast.get_docstring(module.tree) or ""
        folder = Path(module.name).parent.as_posix()
        files = {Path(name) for name in checkout.files(f"{folder}/*.py")}
        inside = {path.stem for path in files} - {"__init__"}
        packages = checkout.files(f"{folder}/*/__init__.py")
        inside |= {f"{Path(name).parent.name}/" for name in packages}
        for one in inside:
            if not re.search(rf"(^| ){re.escape(one)} +\S", map_of, re.MULTILINE):
                yield module.finding(1, f"does not say what {one} is for")


def a_module_says_what_it_is(checkout: Checkout) -> Iterator[Finding]:
    for module in checkout.modules.values():
        if module.tree.body and not ast.get_docstring(module.tree):
            yield module.finding(1, "a module without a docstring")


def public_functions_and_classes_have_a_docstring(
    checkout: Checkout,
) -> Iterator[Finding]:
    """Those of a module; of a class's methods the name and its docstring may say
    enough.
    """
    for module in checkout.modules.values():
        for node in module.public:
            if not ast.get_docstring(node):
                yield module.finding(node, f"{node.name} has no docstring")


def a_class_name_occurs_once(checkout: Checkout) -> Iterator[Finding]:
    """But for Params, of which every model has its own."""
    first: dict[str, str] = {}
    for module in checkout.modules.values():
        for node in module.tree.body:
            if isinstance(node, ast.ClassDef) and node.name != "Params":
                if node.name in first:
                    what = f"{first[node.name]} has a class {node.name} too"
                    yield module.finding(node, what)
                first.setdefault(node.name, module.name)


def folders_of_tests_mirror_the_packages(checkout: Checkout) -> Iterator[Finding]:
    packages = {
        Path(name).parent.name for name in checkout.files("sweep/*/__init__.py")
    }
    folders: dict[str, str] = {}
    for name in checkout.files("tests/*/*.py"):
        folders.setdefault(Path(name).parent.name, name)
    for folder in folders.keys() - packages - TESTED_TOGETHER - {"kernels"}:
        yield Finding(folders[folder], 1, f"there is no package {folder}")
    if "kernels" not in folders:
        yield Finding("kernels/__init__.py", 1, "tests/kernels has no tests")
    for name in packages:
        named = re.compile(rf"\b(from|import) sweep\.{name}\b")
        tests = checkout.files(f"tests/{name}/*.py")
        if not any(named.search(checkout.document(test).text) for test in tests):
            what = f"tests/{name} has no tests of it"
            yield Finding(f"sweep/{name}/__init__.py", 1, what)


RULES = (
    a_package_says_what_each_of_its_modules_is_for,
    a_module_says_what_it_is,
    public_functions_and_classes_have_a_docstring,
    a_class_name_occurs_once,
    folders_of_tests_mirror_the_packages,
)
