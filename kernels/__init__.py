"""The physics: flocks, rules, worlds and metrics as numba kernels. Reads no file,
prints nothing, validates nothing.

    settings     what a user can choose
    model        what a model says of itself
    models/      one file a published model
    metrics/     recorded frames -> numbers
    flight       one flock under way, from its start to its numbers
    inspection   what can be seen of a flight
    jit          how kernels are compiled
    state        Flock, World: what enters kernels
    workspace    what a model works with
    neighbours   who sees whom
    arbitration  how forces share one acceleration
    rules/       social, steering, avoidance, obstacles, borders
    worlds       maps -> World
    arenas       maps for small robots, in metres
    occupancy    grids on which robots look for obstacles
    starts       initial flocks
    recording    frames of a trial
    events       what is counted during a trial
    coverage     visited pixels

numba's disk cache does not notice that a called function changed in another file (numba
issue 1833), so cached code lives in a folder named by a hash of all kernels. The same
hash is recorded with every result.
"""

import ast
import hashlib
import os
from pathlib import Path

import numba


def source_stamp(folder: Path) -> str:
    """The sha256, in hexadecimal, of what all Python sources below `folder` do: names
    and code.

    Docstrings, comments and layout are left out, so that a better explanation leaves
    results valid.
    """
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        code = ast.unparse(_without_docstrings(ast.parse(path.read_bytes())))
        digest.update(
            f"{path.relative_to(folder).as_posix()} {len(code)}\n{code}".encode()
        )
    return digest.hexdigest()


def _without_docstrings(tree: ast.Module) -> ast.Module:
    """The tree without statements that are only a constant, as docstrings are, in
    place.
    """
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            node.body = [part for part in node.body if not _is_constant(part)] or [
                ast.Pass()
            ]
    return tree


def _is_constant(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


KERNELS_SHA = source_stamp(Path(__file__).parent)


def _cache_folder() -> Path:
    home = Path(
        os.environ.get("NUMBA_CACHE_DIR")
        or os.environ.get("XDG_CACHE_HOME")
        or Path.home() / ".cache"
    )
    return home / "boidsweep" / KERNELS_SHA[:16]


# numba declares it at run time.
setattr(numba.config, "CACHE_DIR", str(_cache_folder()))  # noqa: B010
