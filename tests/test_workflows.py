"""The action for continuous integrations runs what its documents say.

`make check` compares the files with the schemas of GitHub. No test can run them there.
"""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from sweep.sharing.packing import pack
from tests.studies import SMALL, launched

ROOT = Path(__file__).parents[1]
PINNED = re.compile(r"uses: (actions/[\w-]+@[0-9a-f]{40}  # v[\d.]+)$", re.MULTILINE)
USES = re.compile(r"uses: (actions/\S+)")


def test_an_action_has_one_revision_everywhere() -> None:
    """It is the hash of a commit: a tag can move."""
    files = [ROOT / "action.yml", ROOT / "docs/guide/certificates.md"]
    files += (ROOT / ".github/workflows").glob("*.yml")
    texts = [file.read_text("utf-8") for file in files]
    pinned = {name for text in texts for name in PINNED.findall(text)}
    assert sum(map(len, map(USES.findall, texts))) == sum(
        map(len, map(PINNED.findall, texts))
    )
    assert len(pinned) == len({name.partition("@")[0] for name in pinned}) == 5


def test_the_action_writes_a_certificate(tmp_path: Path) -> None:
    pack(launched(SMALL, tmp_path), tmp_path / "small.zip")
    action: Any = YAML(typ="safe").load(ROOT / "action.yml")
    steps = action["runs"]["steps"]
    [script] = [step["run"] for step in steps if step.get("id") == "certify"]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", script],
        cwd=tmp_path,
        env=os.environ
        | {
            "PATH": path,
            "SOURCES": "small.zip",
            "OPTIONS": "--most 2 --fraction 1",
            "GITHUB_OUTPUT": str(tmp_path / "output"),
        },
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    [line] = (tmp_path / "output").read_text("utf-8").splitlines()
    folder = tmp_path / line.removeprefix("folder=")
    content = json.loads((folder / "certificate.json").read_text("utf-8"))
    assert content["summary"] == "2 of 2 trials identical"
