"""Lets a wheel and an sdist say from which commit they were built.

A checkout that is installed as it is needs none of this: there git is asked at run
time. Of an sdist the file is there already, and goes into the wheel as any other.
"""

import json
import tempfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).parent
ASKING = ROOT / "sweep" / "store" / "repository.py"


class SayCommit(BuildHookInterface):
    """Adds the file in which `sweep/store/repository.py` reads what git said."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """hatch calls this before it builds."""
        asking = _loaded(ASKING)
        said = asking.git_state(ROOT / "sweep")
        if version == "editable" or not said:
            return
        self.folder = tempfile.TemporaryDirectory()
        file = Path(self.folder.name) / asking.BUILT_FROM
        file.write_text(json.dumps(said), encoding="utf-8")
        build_data["force_include"][str(file)] = f"sweep/{file.name}"

    def finalize(self, *_: Any) -> None:
        """hatch calls this after it has built."""
        if folder := getattr(self, "folder", None):
            folder.cleanup()


def _loaded(file: Path) -> ModuleType:
    """A module of its own, without its package, which needs more than Python."""
    spec = spec_from_file_location(file.stem, file)
    assert spec
    assert spec.loader
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
