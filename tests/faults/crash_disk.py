"""What a crash may leave on a disk: a model of what was written and what was flushed.

`Recorder` notes what a program does to a folder. It stands between the program and
those functions of `os` that change names or flush, and before and after each call it
looks at the whole folder: so it sees also what was written otherwise, as by pyarrow in
C++. What it finds must be what its notes make, or it raises: a recording is complete,
or there is none. A flush that it did not see would make it expect less of the disk than
there is, never more.

`Disk` takes up such notes, and tells what may be left of them: content and names that
were flushed are there for certain, and any of the others may be or not.
"""

import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import pytest

Tree = dict[str, bytes | None]
"""Files by their path with their content, and folders with None."""


@dataclass(eq=False)
class File:
    """A file: its content, and what of that the disk holds for certain."""

    content: bytes = b""
    held: bytes = b""


@dataclass(eq=False)
class Folder:
    """A folder: what is in it by name, and what the disk holds of that for certain."""

    names: "dict[str, Node]" = field(default_factory=dict)
    held: "dict[str, Node]" = field(default_factory=dict)


Node = File | Folder
Names = Callable[[Folder], dict[str, Node]]


class Change(NamedTuple):
    """A name in a folder that now stands for something, or nothing; not flushed yet."""

    folder: Folder
    name: str
    node: Node | None


class Step(NamedTuple):
    """Something that happened: a method of `Disk`, and with what."""

    what: str
    path: str
    other: str = ""
    content: bytes = b""


class Disk:
    """Files and folders below a root that is there for certain.

    `pending` are the changes of names that were not flushed, in their order; those of
    one rename are together.
    """

    def __init__(self) -> None:
        self.root = Folder()
        self.pending: list[list[Change]] = []

    def do(self, step: Step) -> None:
        """Take up a step."""
        if step.what == "rename":
            self.rename(step.path, step.other)
        elif step.what == "write":
            self.file(step.path).content = step.content
        elif step.what == "flush":
            self.flush(step.path)
        else:
            made = {"folder": Folder, "file": File, "gone": lambda: None}[step.what]()
            self._change([self._entry(step.path, made)])

    def rename(self, path: str, other: str) -> None:
        self._change([self._entry(other, self.node(path)), self._entry(path, None)])

    def flush(self, path: str) -> None:
        """The content of a file, or the names in a folder, are held from now on."""
        node = self.node(path)
        if isinstance(node, File):
            node.held = node.content
            return
        node.held = dict(node.names)
        for group in self.pending:
            group[:] = [one for one in group if one.folder is not node]
        self.pending = [group for group in self.pending if group]

    def node(self, path: str) -> Node:
        found: Node = self.root
        for name in filter(None, path.split("/")):
            assert isinstance(found, Folder)
            found = found.names[name]
        return found

    def file(self, path: str) -> File:
        node = self.node(path)
        assert isinstance(node, File)
        return node

    def files(self) -> list[File]:
        """All files that have a name."""
        return [node for _, node in _walk(self.root, now) if isinstance(node, File)]

    def left(
        self,
        names: "Names",
        content: Callable[[File], bytes],
    ) -> Tree:
        """What is left where folders keep those names and files that content."""
        return {
            path: content(node) if isinstance(node, File) else None
            for path, node in _walk(self.root, names)
        }

    def without(self, lost: Callable[[int], bool]) -> "Names":
        """What is left where some of the pending changes, by their number, are lost."""
        found: dict[Folder, dict[str, Node]] = {}
        for number, group in enumerate(self.pending):
            for folder, name, node in [] if lost(number) else group:
                names = found.setdefault(folder, dict(folder.held))
                names.pop(name, None)
                names |= {name: node} if node else {}
        return lambda folder: found.get(folder, folder.held)

    def _entry(self, path: str, node: Node | None) -> Change:
        above, _, name = path.rpartition("/")
        folder = self.node(above)
        assert isinstance(folder, Folder)
        return Change(folder, name, node)

    def _change(self, group: list[Change]) -> None:
        for folder, name, node in group:
            folder.names.pop(name, None)
            folder.names |= {name: node} if node else {}
        self.pending.append(group)


def now(folder: Folder) -> dict[str, Node]:
    """The names as they are while nothing has crashed."""
    return folder.names


def held(folder: Folder) -> dict[str, Node]:
    """The names that the disk holds for certain."""
    return folder.held


def _walk(folder: Folder, names: Names, above: str = "") -> Iterator[tuple[str, Node]]:
    for name, node in sorted(names(folder).items()):
        yield above + name, node
        if isinstance(node, Folder):
            yield from _walk(node, names, f"{above}{name}/")


def seen(root: Path) -> Tree:
    """What is in a folder now."""
    found: Tree = {}
    for path in root.rglob("*"):
        assert not path.is_symlink(), path
        content = None if path.is_dir() else path.read_bytes()
        found[path.relative_to(root).as_posix()] = content
    return found


def put(tree: Tree, root: Path, age: float) -> None:
    """Make a folder of what is left of one, with files of that age in seconds."""
    root.mkdir()
    for name in sorted(tree):
        path, content = root / name, tree[name]
        if content is None:
            path.mkdir()
        else:
            path.write_bytes(content)
            then = path.stat().st_mtime - age
            os.utime(path, (then, then))


def _flushed(tree: Tree) -> Iterator[Step]:
    """The steps that make all of that, and flush it."""
    for path, content in sorted(tree.items()):
        yield Step("folder" if content is None else "file", path)
        if content is not None:
            yield Step("write", path, content=content)
    yield from (Step("flush", path) for path in ("", *tree))


def _opened(descriptor: int) -> Path:
    return Path(f"/proc/self/fd/{descriptor}").readlink()


class Recorder:
    """Notes in `steps` what this process does to the folder `root` in `recording`.

    `before` are the steps that have led to what is there; without them that is held for
    certain.
    """

    def __init__(self, root: Path, before: list[Step] | None = None) -> None:
        self.root = root.resolve()
        self.steps: list[Step] = []
        self.disk = Disk()
        self._busy = threading.RLock()
        for step in _flushed(seen(root)) if before is None else before:
            self._do(step)

    @contextmanager
    def recording(self) -> Iterator[None]:
        """What happens inside is noted."""
        one_path = {
            "mkdir": "folder",
            "unlink": "gone",
            "remove": "gone",
            "rmdir": "gone",
        }
        with pytest.MonkeyPatch.context() as patch:
            for name, what in one_path.items():
                patch.setattr(os, name, self._standing_for(name, self._changing(what)))
            ends = ("src_dir_fd", "dst_dir_fd")
            for name in ("rename", "replace"):
                patch.setattr(os, name, self._standing_for(name, self._renaming, ends))
            for name in ("fsync", "fdatasync"):
                patch.setattr(os, name, self._standing_for(name, self._flushing))
            for name in ("truncate", "ftruncate"):
                patch.setattr(os, name, self._standing_for(name, lambda _path: None))
            yield
            self.look()

    def look(self) -> None:
        """Note what was written since the last call; raise where more was done."""
        tree = self.disk.left(now, lambda file: file.content)
        there = seen(self.root)
        for path in sorted(there.keys() - tree.keys()):
            assert there[path] is not None, f"{path}: a folder was made, and not seen"
            self._do(Step("file", path))
        assert tree.keys() <= there.keys(), f"gone unseen: {tree.keys() - there.keys()}"
        for path, content in there.items():
            if content is not None and content != tree.get(path, b""):
                self._do(Step("write", path, content=content))

    def _do(self, step: Step) -> None:
        self.disk.do(step)
        self.steps.append(step)

    def _standing_for(
        self,
        name: str,
        note: Callable[..., None],
        folders: tuple[str, ...] = ("dir_fd",),
    ) -> Callable[..., Any]:
        """A noted function of `os`; `folders` are the options its paths are relative
        to.
        """
        original = getattr(os, name)

        def call(*arguments: Any, **options: Any) -> Any:
            with self._busy:
                self.look()
                given = zip(arguments, map(options.get, folders), strict=False)
                places = [self._place(path, folder) for path, folder in given]
                result = original(*arguments, **options)
                note(*places)
                self.look()
                return result

        return call

    def _place(self, given: Any, above: int | None) -> str | None:
        """What a call was given, as a path below the root; None for all else."""
        folder = Path.cwd() if above is None else _opened(above)
        path = _opened(given) if isinstance(given, int) else folder / given
        if not path.is_relative_to(self.root):
            return None
        return path.relative_to(self.root).as_posix()

    def _changing(self, what: str) -> Callable[..., None]:
        def note(path: str | None) -> None:
            if path is not None:
                self._do(Step(what, path))

        return note

    def _renaming(self, path: str | None, other: str | None) -> None:
        assert (path is None) == (other is None)
        if path is not None and other is not None:
            self._do(Step("rename", path, other))

    def _flushing(self, path: str | None) -> None:
        if path is not None:
            self._do(Step("flush", "" if path == "." else path))
