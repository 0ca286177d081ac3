"""What a wheel and an sdist say of themselves: from which commit they were built, what
a package registry shows of the README, and whom and which addresses it names.

A checkout that is installed as it is needs no commit: there git is asked at run time.
Of an sdist the file is there already, and goes into the wheel as any other.
"""

import json
import re
import tempfile
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

ROOT = Path(__file__).parent
ASKING = ROOT / "sweep" / "store" / "repository.py"
PUBLISHER = ROOT / "docs" / "building" / "publisher.py"
CODE = re.compile(r"(^```.*?^```$)", re.MULTILINE | re.DOTALL)
NEAR = re.compile(r"(!?)\[([^\[\]]+)\]\((?![a-z]+:)[^()]+\)")
"""A link or a picture that leads to no other site."""


class SayReadme(MetadataHookInterface):
    """Gives the package the README as its description, its authors and addresses."""

    def update(self, metadata: dict[str, Any]) -> None:
        """hatch calls this for whatever it builds."""
        text = readable_anywhere((ROOT / "README.md").read_text(encoding="utf-8"))
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
        publisher = _loaded(PUBLISHER).read_publisher(ROOT / "pyproject.toml")
        metadata.update(publisher.metadata())


def readable_anywhere(text: str) -> str:
    """Markdown for a page that has no other file of the repository: what would lead to
    one is its words alone, and a picture is what it would show.
    """
    parts = CODE.split(text)
    parts[::2] = [NEAR.sub(_in_words, part) for part in parts[::2]]
    return "".join(parts)


def _in_words(link: "re.Match[str]") -> str:
    picture, words = link.groups()
    return f"*(Picture: {words}.)*" if picture else words


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
