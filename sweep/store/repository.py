"""State of our code, and of the spec of a study, in git.

git runs nothing that a repository names. A wheel has no repository: its BUILT_FROM has
the state where it was built. hatch_build.py writes it, and loads this module by its
file, so that this needs nothing but Python.
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

A partial clone lacks some.
"""


def git_state(folder: Path) -> dict[str, Any]:
    """Return the state of the code in the working tree that `folder` is in.

    It is empty if the code is not kept in one. The code is what is below `folder` and
    in `kernels` beside it: `commit`; its `diff` to it, of which `cut` characters beyond
    MOST_DIFF are left out; and of the files that are `untracked` the name and the
    sha256 of each.
    """
    root = folder.parent
    code = ("--", folder.name, "kernels")
    commit = _run(root, ["rev-parse", "HEAD"])  # filters no file
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
    """Return the state of the code below `folder` where the wheel was built.

    It is empty if it is not known.
    """
    with suppress(OSError, ValueError):
        state = json.loads((folder / BUILT_FROM).read_text(encoding="utf-8"))
        if isinstance(state, dict):
            return state
    return {}


def study_state(spec: Path, text: str) -> dict[str, Any]:
    """Return the state of a spec in the working tree that it is in.

    It has the `commit`, the `path` of the spec, and whether files in its folder and
    below are `modified`; a spec that is not committed counts as one. It is empty if the
    spec is not in a working tree, or its `text` is not from this file. Nothing else of
    the user's repository is recorded.
    """
    try:
        if spec.read_bytes() != text.encode():
            return {}
    except OSError:
        return {}
    folder = spec.resolve().parent
    # Filters no file.
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
    """Return the output of git, which runs no command that a repository may name.

    The code may be installed within somebody else's repository. Filters of files have
    names of their own, and are switched off by them.
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
