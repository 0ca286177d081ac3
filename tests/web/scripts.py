"""Modules of the page, run without a browser, and what they read."""

import base64
import json
import subprocess
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from deno import find_deno_bin

from tests.patience import PATIENCE


def unpacked(text: str) -> bytes:
    """The bytes of a text that is packed for a page."""
    return zlib.decompress(base64.b64decode(text))


def frames_of(run: dict[str, Any]) -> bytes:
    """The frames of a run in a page: the sums of their differences."""
    differences = np.frombuffer(unpacked(run["frames"]), np.uint8)
    rows = differences.reshape(-1, len(run["steps"]))
    return np.cumsum(rows, axis=1, dtype=np.uint8).T.tobytes()


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
