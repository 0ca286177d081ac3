"""The rules of the house: who imports whom, and what everything says of itself."""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path
from typing import get_args, get_type_hints

import pytest

from kernels.metrics import METRICS
from kernels.metrics.ground import Better
from kernels.models import MODELS
from kernels.settings import UNITS
from kernels.worlds import MAPS
from sweep.spec.settings import GROUPS
from sweep.testing import assert_keeps
from tests import ROOT

MODULES = {
    path.relative_to(ROOT).as_posix(): path
    for part in ("kernels", "sweep")
    for path in ROOT.glob(f"{part}/**/*.py")
}
TREES = {name: ast.parse(path.read_text()) for name, path in MODULES.items()}

BROUGHT = {ROOT / "sweep/web/static/uplot.js"}
"""Scripts of others, as they were released."""
SCRIPTS = sorted(
    {*ROOT.glob("sweep/**/*.[jt]s"), *ROOT.glob("tests/**/*.[jt]s")} - BROUGHT
)
MOST_SIGNS = 88

Function = ast.FunctionDef | ast.AsyncFunctionDef


def imports(name: str) -> Iterator[str]:
    """The modules that a module imports anywhere, with `kernels.` or `sweep.` and what
    follows.
    """
    for node in ast.walk(TREES[name]):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}:{node.lineno}: a relative import"
            assert node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def within(module: str, packages: set[str]) -> bool:
    return any(
        module == package or module.startswith(package + ".") for package in packages
    )


def modules(part: str) -> list[str]:
    return [name for name in MODULES if name.startswith(part)]


KERNELS_MAY_IMPORT = {
    "kernels",
    "numpy",
    "numba",
    "math",
    "random",
    "hashlib",
    "os",
    "pathlib",
    "typing",
    "collections",
    "dataclasses",
    "functools",
}
STAMPS_MAY_IMPORT = {"ast", "contextlib", "importlib", "json", "sys", "types"}
"""What reads code, to say what computes a trial."""
REGISTRY_MAY_IMPORT = {"importlib", "site", "sys"}
"""What asks installed packages."""
LANES_MAY_IMPORT = {
    *("ast", "builtins", "inspect", "itertools", "linecache", "operator", "textwrap"),
    "llvmlite",
}
"""What makes functions of functions, and types for numba."""
THREADS_MAY_IMPORT = {"ast", "llvmlite", "sys", "threading"}
"""What makes functions of functions, and has several threads wait for each other."""
MADE = {"lanes": LANES_MAY_IMPORT, "threads": THREADS_MAY_IMPORT}
"""What packages import whose kernels are made of others."""


@pytest.mark.parametrize("name", modules("kernels"))
def test_kernels_know_nothing_above_them_and_no_input_or_output(name: str) -> None:
    allowed = KERNELS_MAY_IMPORT | {
        "kernels/stamps.py": STAMPS_MAY_IMPORT,
        "kernels/identity.py": STAMPS_MAY_IMPORT,
        "kernels/caching.py": {
            *("contextlib", "glob", "sys", "time", "types", "warnings", "weakref")
        },
        "kernels/registry.py": REGISTRY_MAY_IMPORT,
        "kernels/device/assembly.py": {"cuda", "re"},
        "kernels/device/batch.py": {"contextlib"},
        "kernels/device/gpu.py": {"ctypes", "cuda"},
        "kernels/device/kernel.py": {"textwrap"},
        "kernels/device/ptx.py": {"contextlib", "importlib", "re"},
        "kernels/device/views.py": {"llvmlite"},
        "kernels/fetching.py": {"llvmlite"},
        "kernels/fours.py": {"llvmlite"},
        "kernels/indices.py": {"llvmlite"},
        "kernels/robots/publishers.py": {"ast", "inspect"},
        "kernels/robots/readers.py": {"ast"},
    }.get(name, MADE.get(name.split("/")[1], set()))
    assert [module for module in imports(name) if not within(module, allowed)] == []
    calls = [
        node.func.id
        for node in ast.walk(TREES[name])
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    ]
    assert {"print", "open", "input"}.isdisjoint(calls)


@pytest.mark.parametrize("name", modules("kernels"))
def test_one_module_says_how_kernels_are_compiled(name: str) -> None:
    """Others say where the compiled code is kept, and what is compiled to instructions
    of the processor that Python has no words for, or of a GPU. Lanes have their own
    types, and threads their barrier.
    """
    others = "caching", "fetching", "fours", "generator", "indices", "jit"
    others += "device/ptx", "device/views", "threads/barrier"
    allowed = [f"kernels/{one}.py" for one in ("__init__", *others)]
    if name not in allowed and "/lanes/" not in name:
        assert not any(within(module, {"numba"}) for module in imports(name))


EXACT = {
    *("ceil", "copysign", "degrees", "factorial", "floor", "frexp", "isfinite"),
    *("isinf", "isqrt", "ldexp", "prod", "radians", "sqrt"),
}
"""What a mathematics library rounds as IEEE 754 says, or not at all."""
ROUNDED_ANYHOW = {
    *("arctan2", "cos", "einsum", "exp", "expm1", "hypot", "leggauss", "linalg"),
    *("log", "log1p", "log2", "normal", "power", "sin", "standard_normal"),
}
"""Methods and functions of NumPy whose last bits depend on the processor, or on the
mathematics library.
"""


@pytest.mark.parametrize("name", [*modules("kernels"), *modules("examples")])
def test_kernels_call_no_function_that_a_library_rounds_as_it_likes(name: str) -> None:
    """They call those of kernels.elementary and kernels.chance, which have the same
    bits everywhere. Only constants of modules are powers.
    """
    for node in ast.walk(TREES[name]):
        match node:
            case ast.Call(ast.Attribute(ast.Name("math"), called)):
                assert called in EXACT, node.lineno
            case ast.Attribute(attr=attribute):
                assert attribute not in ROUNDED_ANYHOW, node.lineno
            case ast.FunctionDef():
                operators = [
                    one.op for one in ast.walk(node) if isinstance(one, ast.BinOp)
                ]
                inexact = ast.Pow | ast.MatMult
                assert not any(isinstance(one, inexact) for one in operators), node.name


MAY_IMPORT = {
    "kernels": "",
    "errors": "",
    "text": "",
    "surroundings": "",
    "analysis": "text",
    "spec": "kernels errors text analysis",
    "own_code": "kernels errors text spec",
    "design": "kernels text spec",
    "trial": "kernels errors text surroundings spec own_code design",
    "store": "kernels errors text spec own_code design trial",
    "workers": "kernels errors text surroundings spec design trial store",
    "testing": "kernels errors text spec own_code design trial workers",
    "tables": "kernels errors text analysis spec design trial store workers",
    "campaigns": (
        "kernels errors text analysis spec own_code design trial store workers testing"
        " tables"
    ),
    "figures": (
        "kernels errors text analysis spec own_code trial store tables campaigns"
    ),
    "replays": ("kernels errors text spec design trial store workers tables figures"),
    "published": (
        "kernels errors text analysis spec own_code design store workers tables"
        " campaigns figures"
    ),
    "sharing": "kernels errors text spec design store tables published",
    "web": (
        "kernels errors text spec own_code design trial store tables figures replays"
        " sharing"
    ),
    "explorer": (
        "errors text analysis spec design trial store workers tables campaigns figures"
        " replays sharing web"
    ),
    "cli": (
        "kernels errors text surroundings analysis spec own_code design store workers"
        " tables testing campaigns figures replays published sharing web explorer"
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
        "registry",
        "robots.publishers",
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


def dotted(name: str) -> str:
    """The module of a file."""
    return name.removesuffix(".py").replace("/", ".").removesuffix(".__init__")


FILES = {dotted(name): name for name in MODULES}


def arrows(name: str) -> set[str]:
    """Our own modules that a file imports from."""
    found = set()
    for module in imports(name):
        while module not in FILES and "." in module:
            module = module.rpartition(".")[0]
        found |= {module} & FILES.keys()
    return found - {dotted(name)}


def package(module: str) -> str:
    """The package of a module, or the module on the ground."""
    first, *rest = module.split(".")
    return first if first == "kernels" or not rest else rest[0]


def test_packages_import_what_the_table_says_and_no_less() -> None:
    used: dict[str, set[str]] = {name: set() for name in MAY_IMPORT}
    for module, name in FILES.items():
        if module != "sweep":  # the package itself hands everything on
            used[package(module)] |= {package(other) for other in arrows(name)} - {
                package(module)
            }
    assert used == {name: set(allowed.split()) for name, allowed in MAY_IMPORT.items()}


def test_every_arrow_of_the_table_points_up() -> None:
    order = list(MAY_IMPORT)
    for number, name in enumerate(order):
        assert set(MAY_IMPORT[name].split()) <= set(order[:number]), name


def test_no_files_import_each_other_in_a_circle() -> None:
    graph = {module: arrows(name) for module, name in FILES.items()}
    TopologicalSorter(graph).prepare()


@pytest.mark.parametrize("name", modules("sweep"))
def test_the_machine_knows_no_experiment_and_meets_kernels_in_one_place(
    name: str,
) -> None:
    assert not any(
        within(module, {"experiments", "notebooks", "tests"})
        for module in imports(name)
    )
    if not name.startswith("sweep/trial/"):
        met = {module for module in arrows(name) if within(module, {"kernels"})}
        assert met <= KERNEL_FACTS


@pytest.mark.parametrize(
    "name", [name for name in modules("sweep") if name.endswith("__init__.py")]
)
def test_a_package_says_what_each_of_its_modules_is_for(name: str) -> None:
    """Each stands in its docstring, followed by a few words."""
    map_of = ast.get_docstring(TREES[name]) or ""
    inside = {
        path
        for path in MODULES[name].parent.iterdir()
        if path.suffix == ".py" or (path / "__init__.py").exists()
    }
    names = {path.stem + "/" * path.is_dir() for path in inside} - {"__init__"}
    lost = {
        one
        for one in names
        if not re.search(rf"(^| ){re.escape(one)} +\S", map_of, re.MULTILINE)
    }
    assert not lost


TESTED_TOGETHER = {
    *("attacks", "bench", "cluster", "docs", "examples", "experiments", "faults"),
    *("mutants", "naive"),
}
"""Folders of tests that belong to no single package."""


def test_folders_of_tests_mirror_the_packages() -> None:
    tests = ROOT / "tests"
    packages = {path.parent.name for path in ROOT.glob("sweep/*/__init__.py")}
    folders = {path.parent.name for path in tests.glob("*/*.py")}
    assert folders - TESTED_TOGETHER == {"kernels"} | packages
    for name in packages:
        named = re.compile(rf"\b(from|import) sweep\.{name}\b")
        assert any(
            named.search(path.read_text()) for path in tests.glob(f"{name}/*.py")
        )


def test_a_class_name_occurs_once() -> None:
    """But for Params, of which every model has its own."""
    names = Counter(
        node.name
        for tree in TREES.values()
        for node in tree.body
        if isinstance(node, ast.ClassDef)
    )
    assert [name for name, count in names.items() if count > 1] == ["Params"]


@pytest.mark.parametrize("name", MODULES)
def test_a_module_says_what_it_is(name: str) -> None:
    assert ast.get_docstring(TREES[name]) or not TREES[name].body


@pytest.mark.parametrize("name", MODULES)
def test_public_functions_and_classes_have_a_docstring(name: str) -> None:
    """Those of a module; of a class's methods the name and its docstring may say
    enough.
    """
    members = [
        node for node in TREES[name].body if isinstance(node, Function | ast.ClassDef)
    ]
    silent = [
        node.name
        for node in members
        if not node.name.startswith("_") and not ast.get_docstring(node)
    ]
    assert silent == []


MEANS = {
    "mean_interval": "distribution",
    "curves": "distribution",
    "by_point": "distributions",
}
"""Functions that show the means of values they do not know, and what tells them how
these are distributed.
"""


def test_no_figure_forgets_how_values_are_distributed() -> None:
    """`StoredStudy.means` and `mean_of` know it of metrics; of other values it is said,
    and `half_width` holds for normal ones only.
    """
    figures = [*ROOT.glob("sweep/figures/*.py"), *ROOT.glob("experiments/*/*.py")]
    calls = [
        (path, node)
        for path in figures
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    ]
    found = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path, node in calls
        if node.func.id == "half_width"
        or MEANS.get(node.func.id) not in {None, *(one.arg for one in node.keywords)}
    ]
    assert found == []
    assert {"mean_interval", "curves"} <= {node.func.id for _, node in calls}


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
def test_lines_of_scripts_are_short(script: Path) -> None:
    """The formatter breaks code, but neither comments nor texts."""
    lines = enumerate(script.read_text(encoding="utf-8").splitlines(), 1)
    assert [number for number, line in lines if len(line) > MOST_SIGNS] == []


@pytest.mark.parametrize(
    "name", [name for name in modules("kernels/models") if "__init__" not in name]
)
def test_a_model_has_params_presets_sight_and_advance_and_no_more(name: str) -> None:
    public = [
        node.name
        for node in TREES[name].body
        if isinstance(node, Function | ast.ClassDef) and node.name[0] != "_"
    ]
    assert sorted(public) == ["Params", "advance", "sight"]


@pytest.mark.parametrize("name", MODELS)
def test_a_model_is_entered_under_its_name_with_both_presets_and_known_metrics(
    name: str,
) -> None:
    model = MODELS[name]
    assert model.name == name
    assert {"as_written", "as_run"} <= set(model.presets)
    assert set(model.metrics) <= set(METRICS)
    assert model.source


@pytest.mark.parametrize("model", MODELS)
def test_a_model_says_all_of_its_settings_and_gives_them_values(model: str) -> None:
    assert_keeps(model, "settings")
    assert_keeps(model, "presets")


def test_a_setting_that_all_models_have_has_a_text_and_a_unit_and_one_group() -> None:
    for _, group in GROUPS:
        for hint in get_type_hints(group, include_extras=True).values():
            assert get_args(hint)[1].text
            assert get_args(hint)[1].unit in UNITS
    names = [name for _, group in GROUPS for name in group._fields]
    assert len(names) == len(set(names))


@pytest.mark.parametrize("name", METRICS)
def test_a_metric_has_a_text_a_source_and_a_unit_or_none(name: str) -> None:
    metric = METRICS[name]
    assert metric.text
    assert metric.source
    assert metric.unit in UNITS
    assert metric.better in get_args(Better)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_has_a_text_and_a_source(name: str) -> None:
    assert MAPS[name].text
    assert MAPS[name].source
