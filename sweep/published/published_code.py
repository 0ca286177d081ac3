"""Code of a publication: a figures.py, and all relatively imported files.

figures.py, next to the specs, has figures and functions for claims. Further code of the
folder never runs. `sweep reproduce` prints the names of the files that run.
"""

import ast
import sys
from collections.abc import Mapping
from importlib.machinery import FileFinder, ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from traceback import extract_tb
from types import CodeType, ModuleType
from typing import Any

from sweep.errors import SpecError
from sweep.figures import NAME, Drawing
from sweep.spec import Study
from sweep.text import unknown

CODE = "figures.py"


class _Readable(SourceFileLoader):
    """A loader of readable source files, never of bytecode files."""

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


class _Beside(FileFinder):
    """A finder of readable files of a folder, without subfolders."""

    def find_spec(
        self, fullname: str, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        spec = super().find_spec(fullname, target)
        return spec if spec and spec.submodule_search_locations is None else None


def files_of_code(file: Path) -> list[Path]:
    """Return a figures.py and all relatively imported files of the folder.

    Imports of imported files count, too. A file that cannot be read, or is not Python,
    has no imports.
    """
    files = [file]
    for source in files:  # the list grows meanwhile
        beside = [file.with_name(f"{name}.py") for name in _imported(source)]
        files += [path for path in beside if path.is_file() and path not in files]
    return files


def _imported(file: Path) -> list[str]:
    """Return the modules in the folder of a file that the file imports, each once."""
    try:
        tree = ast.parse(file.read_bytes())
    except (OSError, SyntaxError, ValueError, RecursionError, MemoryError):
        return []
    names = [
        name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and node.level == 1
        for name in (
            [node.module] if node.module else [alias.name for alias in node.names]
        )
    ]
    return list(dict.fromkeys(names))


def run_code(file: Path) -> dict[str, Any]:
    """Return the names that a figures.py defines; empty without such a file.

    Raises
    ------
    SpecError
        If the file cannot be run. The error has the line.
    """
    if not file.exists():
        return {}
    name = f"_figures_of_{file.parent.name}"
    folder = str(file.parent.resolve())
    for older in [loaded for loaded in sys.modules if loaded.startswith(f"{name}.")]:
        del sys.modules[older]
    # `_Beside` finds the modules that Python imports from the folder.
    sys.path_importer_cache[folder] = _Beside(folder, (_Readable, [".py"]))
    loader = _Readable(name, str(file))
    spec = spec_from_file_location(
        name, file, loader=loader, submodule_search_locations=[folder]
    )
    assert spec is not None
    module = module_from_spec(spec)
    sys.modules[name] = module
    try:
        loader.exec_module(module)
    except Exception as error:
        lines = [
            frame.lineno
            for frame in extract_tb(error.__traceback__)
            if frame.filename == str(file)
        ]
        line = f":{lines[-1]}" if lines else ""
        raise SpecError(
            f"{file.name}{line}: cannot be loaded: {type(error).__name__}: {error}"
        ) from error
    return vars(module)


def check_drawings(
    module: Mapping[str, Any], studies: Mapping[str, Study]
) -> dict[str, Drawing]:
    """Return the drawings of a module. All specs must be in `studies`.

    Raises
    ------
    SpecError
        If FIGURES, a name or a drawing is not valid.
    """
    drawings = module.get("FIGURES", {})
    if not isinstance(drawings, dict):
        raise SpecError(
            "figures.py: FIGURES must be a dict of drawings by name, not"
            f" {type(drawings).__name__}"
        )
    for name, drawing in drawings.items():
        if not isinstance(name, str):
            raise SpecError(f'figures.py: figure "{name}" must have a string as name')
        if not NAME.fullmatch(name):
            raise SpecError(
                f'figures.py: figure "{name}" is not a name of letters, digits,'
                ' "_" and "-"'
            )
        if (
            not isinstance(drawing, Drawing)
            or not callable(drawing.draw)
            or not isinstance(drawing.specs, tuple)
        ):
            raise SpecError(
                f'figures.py: figure "{name}" must be Drawing(function,'
                " (names of specs,), text)"
            )
        for spec in map(str, drawing.specs):
            if spec not in studies:
                raise SpecError(
                    f'figures.py: figure "{name}": {unknown("spec", spec, studies)}'
                )
    return drawings
