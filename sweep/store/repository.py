"""State of the code of boidsweep, and of the spec of a study, in git.

git runs no command that a repository configures. A wheel has no repository: its
BUILT_FROM has the state of the code at the build. hatch_build.py writes BUILT_FROM, and
loads this module by its path. So this module imports only the standard library.
"""

import hashlib
import json
import os
import subprocess
from contextlib import suppress
from pathlib import Path
from typing import Any

BUILT_FROM = "built_from.json"
MOST_DIFF = 200_000
QUIETLY = ("--no-pager", "-c", "core.fsmonitor=false", "-c", "core.hooksPath=/dev/null")
OURSELVES = ("--no-ext-diff", "--no-textconv", "--ignore-submodules=all")
APART = {"GIT_OPTIONAL_LOCKS": "0", "GIT_NO_LAZY_FETCH": "1", "GIT_ALLOW_PROTOCOL": ""}
"""Variables with which git neither writes the index nor fetches objects.

A partial clone lacks objects, which git would fetch.
"""


def git_state(folder: Path) -> dict[str, Any]:
    """Return the state of the code in the working tree that contains `folder`.

    The code is in `folder` and in the folder `kernels` next to it. The state is empty
    if git does not track the code. It has the `commit`, the `diff` to the commit, and
    the sha256 of `untracked` files by name. A diff of more than MOST_DIFF characters is
    shortened by `cut` characters.
    """
    root = folder.parent
    code = ("--", folder.name, "kernels")
    commit = _run(root, ["rev-parse", "HEAD"])  # runs no filter
    if not commit or not _git(root, ["ls-files", "--", folder.name]):
        return {}
    diff = os.fsencode(_git(root, ["diff", *OURSELVES, "HEAD", *code])).decode(
        errors="replace"
    )
    return {
        "commit": commit.strip(),
        "diff": diff[:MOST_DIFF],
        "cut": max(0, len(diff) - MOST_DIFF),
        "untracked": _untracked(root, code),
    }


def built_from(folder: Path) -> dict[str, Any]:
    """Return the state of the code below `folder` at the build of the wheel.

    The state is empty if it is unknown.
    """
    with suppress(OSError, ValueError):
        state = json.loads((folder / BUILT_FROM).read_text(encoding="utf-8"))
        if isinstance(state, dict):
            return state
    return {}


def study_state(spec: Path, text: str) -> dict[str, Any]:
    """Return the state of a spec in the working tree that contains the spec.

    The state has the `commit`, the `path` of the spec, and `modified`: whether files in
    the folder of the spec or below differ from the commit. A spec that is not committed
    counts as modified. The state is empty if the spec is not in a working tree, or if
    `text` is not the content of the file. No further data of the user's repository are
    recorded.
    """
    try:
        if spec.read_bytes() != text.encode():
            return {}
    except OSError:
        return {}
    folder = spec.resolve().parent
    # Runs no filter.
    answer = _run(folder, ["rev-parse", "--show-toplevel", "HEAD"])
    root, _, commit = answer.removesuffix("\n").rpartition("\n")
    if not root:
        return {}
    changed = _git(folder, ["diff", *OURSELVES, "--name-only", "HEAD", "--", "."])
    tracked = _git(folder, ["ls-files", "--", f":(literal){spec.name}"])
    path = spec.resolve().relative_to(Path(root).resolve())
    return {
        "commit": commit,
        "path": path.as_posix(),
        "modified": bool(changed) or not tracked,
    }


def _untracked(root: Path, code: tuple[str, ...]) -> dict[str, str]:
    listed = _git(root, ["ls-files", "--others", "--exclude-standard", "-z", *code])
    names = listed.split("\0")
    paths = {name: root / name for name in names if name and (root / name).is_file()}
    return {
        name: hashlib.sha256(path.read_bytes()).hexdigest()
        for name, path in sorted(paths.items())
    }


def _git(root: Path, arguments: list[str]) -> str:
    """Return the output of git, which runs no command that a repository configures.

    The code may be installed inside an untrusted repository. File filters have custom
    names, and each filter is switched off by its name.
    """
    names = _run(
        root, ["config", "--name-only", "-z", "--get-regexp", r"^filter\."]
    ).split("\0")
    if any("=" in name for name in names):  # no option can name it
        return ""
    off = [
        f"{name}={'false' if name.endswith('.required') else ''}"
        for name in names
        if name
    ]
    options = [word for setting in off for word in ("-c", setting)]
    return _run(root, [*options, *arguments])


def _run(root: Path, arguments: list[str]) -> str:
    command = ["git", "-C", str(root), *QUIETLY, *arguments]
    try:
        done = subprocess.run(
            command, env=os.environ | APART, capture_output=True, timeout=20
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return os.fsdecode(done.stdout) if done.returncode == 0 else ""
