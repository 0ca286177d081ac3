"""Modules of the page, run without a browser."""

import json
import subprocess
from pathlib import Path
from typing import Any

from deno import find_deno_bin

from tests.patience import PATIENCE


def printed(script: str, folder: Path) -> Any:
    """The JSON that a script prints; `folder` is room for it."""
    path = folder / "script.js"
    path.write_text(script)
    done = subprocess.run(
        [find_deno_bin(), "run", "--quiet", "--no-config", path],
        env={"DENO_DIR": str(folder / "deno"), "NO_COLOR": "1"},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr[:2000]
    return json.loads(done.stdout)
