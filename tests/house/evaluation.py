"""No module evaluates text or loads pickles."""

import ast
from collections.abc import Iterator

from tests.house.sources import Checkout, Finding, Module, called, without_a_reason

FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__"}
FORBIDDEN_MODULES = {
    "pickle",
    "cPickle",
    "marshal",
    "shelve",
    "dill",
    "cloudpickle",
    "joblib.numpy_pickle",
    "yaml",
}
OVER_THE_CLUSTER = (
    "what a launch and its workers send each other, over connections on which dask"
    " itself sends code to run"
)
LANES = "kernels for lanes, from the sources of functions that are loaded already"
EVALUATING = {
    "sweep/workers/remote.py pickle": OVER_THE_CLUSTER,
    "sweep/workers/tasks.py pickle": OVER_THE_CLUSTER,
    "sweep/web/compiling.py pickle": (
        "what a page sends to the process that it starts to compile, over its input"
    ),
    "sweep/own_code/loading.py compile": (
        "code of the user's own: docs/trust.md says when it runs"
    ),
    "kernels/lanes/texts.py compile": LANES,
    "kernels/lanes/texts.py exec": LANES,
}


def _evaluating(module: Module) -> Iterator[tuple[str, ast.AST]]:
    """Calls and imports that run what is text or data."""
    for node in module.nodes:
        if isinstance(node, ast.Call):
            name = called(node)
            keywords = {
                word.arg
                for word in node.keywords
                if isinstance(word.value, ast.Constant) and word.value.value
            }
            bare = isinstance(node.func, ast.Name) and name in FORBIDDEN_CALLS
            pickles = name in ("read_pickle", "to_pickle")
            if bare or pickles or keywords & {"allow_pickle", "shell"}:
                yield name, node
        elif isinstance(node, ast.Import | ast.ImportFrom):
            names = [alias.name for alias in node.names]
            if isinstance(node, ast.ImportFrom):
                names = [node.module or ""]
            yield from ((name, node) for name in names if name in FORBIDDEN_MODULES)


def no_module_evaluates_text_or_loads_pickles(checkout: Checkout) -> Iterator[Finding]:
    """joblib and numba pickle between our own processes and into the user's cache;
    nothing stored is read so. A reason holds for one place.
    """
    modules = checkout.modules.values()
    for module in modules:
        seen = set()
        for name, node in _evaluating(module):
            if name in seen:
                yield module.finding(node, f"runs code by {name} a second time")
            seen.add(name)
    yield from without_a_reason(modules, _evaluating, EVALUATING, "runs code by")


RULES = (no_module_evaluates_text_or_loads_pickles,)
