"""The code blocks of a page: found, and run in an empty folder.

Each fenced block is run, in the order of the page, by its language:

    sh      line by line, as commands
    python  in one namespace for all blocks of the page
    yaml    a whole spec is read, and its points are counted
    text    must stand in the output of the block before it; `...` stands for any lines,
            and for the rest of a line

A comment just before a block, which readers do not see, says what else is to be done:

    <!-- file: spec.yaml -->        the block is the text of this file, which is written
    <!-- not run: needs Slurm -->   why it is not run
"""

import re
import shlex
import subprocess
from collections.abc import Callable, Iterator
from contextlib import chdir, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any, NamedTuple

FENCE = re.compile(
    r"(?:^<!-- (?P<word>file|not run): (?P<what>[^>]*?) -->\n)?"
    r"^(?P<fence>```+)(?P<language>[^`\n]*)\n(?P<text>.*?)^(?P=fence)$",
    re.MULTILINE | re.DOTALL,
)
SHELL = re.compile(r"[|<>&;$*]")
"""Signs of a line that a shell must read."""

Command = Callable[[Path, list[str]], str]
"""Runs a command in a folder; returns what it has put out, or raises
BlockError.
"""


class BlockError(Exception):
    """A block that does not do what its page says."""


class Block(NamedTuple):
    """One block: its place, its language and text; the `file` that it is, and the
    `reason` for which it is not run, "" for none.
    """

    page: str
    line: int
    language: str
    text: str
    file: str
    reason: str

    def error(self, why: str) -> BlockError:
        """An error with the place of the block."""
        return BlockError(f"{self.page}:{self.line}: {why}")

    @property
    def commands(self) -> list[str]:
        """The commands of a block of sh, without comments and prompts."""
        joined = self.text.replace("\\\n", " ")
        lines = (line.removeprefix("$ ").strip() for line in joined.splitlines())
        return [line for line in lines if line and not line.startswith("#")]


def blocks(page: str, text: str) -> Iterator[Block]:
    """The fenced blocks of a page, in its order; directives of MyST are none."""
    for found in FENCE.finditer(text):
        if found["language"].startswith("{"):
            continue
        line = text.count("\n", 0, found.start("fence")) + 1
        word, what = found["word"], found["what"] or ""
        yield Block(
            page,
            line,
            found["language"],
            found["text"],
            what if word == "file" else "",
            what if word == "not run" else "",
        )


def words(line: str) -> list[str]:
    """The words of a command, without a comment."""
    return shlex.split(line, comments=True)


class PageRun:
    """The run of a page in `folder`, which holds what its blocks write.

    command    runs `sweep`
    read_spec  reads a text as a whole spec, and raises where it is none
    variables  the namespace of its Python
    """

    def __init__(
        self, folder: Path, command: Command, read_spec: Callable[[str], object]
    ) -> None:
        self.folder, self.command, self.read_spec = folder, command, read_spec
        self.variables: dict[str, Any] = {"__name__": "page"}
        self.output = ""

    def run(self, block: Block) -> None:
        """Run a block. Raises BlockError for one that fails, or that nobody can run."""
        if block.reason:
            return
        if block.file:
            path = self.folder / block.file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(block.text, encoding="utf-8")
            return
        actions = {
            "sh": self._sh,
            "python": self._python,
            "yaml": self._yaml,
            "text": self._text,
        }
        if block.language not in actions:
            raise block.error(
                f'a block of "{block.language}" is run by nothing; name its file, say'
                " why it is not run, or give it one of " + ", ".join(actions)
            )
        try:
            actions[block.language](block)
        except BlockError:
            raise
        except Exception as error:
            raise block.error(f"{type(error).__name__}: {error}") from error

    def _sh(self, block: Block) -> None:
        outputs = []
        for line in block.commands:
            first, *rest = words(line)
            if first == "sweep" and not SHELL.search(line):
                outputs.append(self.command(self.folder, rest))
            else:
                outputs.append(_shell(self.folder, line))
        self.output = "\n".join(outputs)

    def _python(self, block: Block) -> None:
        said = StringIO()
        code = compile(block.text, f"{block.page}:{block.line}", "exec")
        with chdir(self.folder), redirect_stdout(said):
            exec(code, self.variables)
        self.output = said.getvalue()

    def _yaml(self, block: Block) -> None:
        self.read_spec(block.text)

    def _text(self, block: Block) -> None:
        """Compared word by word: widths of columns are left to the terminal."""
        found = iter(" ".join(line.split()) for line in self.output.splitlines())
        for line in block.text.splitlines():
            wanted = " ".join(line.split())
            start = wanted.removesuffix("...")
            if start and not any(
                one == wanted or (start != wanted and one.startswith(start))
                for one in found
            ):
                raise block.error(f"not in the output: {line}\n{self.output}")


def _shell(folder: Path, line: str) -> str:
    finished = subprocess.run(
        ["sh", "-c", line], cwd=folder, capture_output=True, text=True, check=False
    )
    if finished.returncode:
        raise BlockError(f"{line}: exit code {finished.returncode}: {finished.stderr}")
    return finished.stdout
