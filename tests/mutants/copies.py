"""Copies of the checkout, in which mistakes are made and tests run."""

import json
import os
import re
import shutil
import signal
import subprocess
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple

from tests import ROOT
from tests.mutants.drawing import Mutant, applied

OPTIONS = (
    *("-q", "-m", "not slow", "-p", "no:randomly", "--ignore=tests/mutants"),
    *("-o", "faulthandler_timeout=300", "-o", "faulthandler_exit_on_timeout=true"),
)
ALONE = ("-n", "0", "-x")
LAST_FAILED = Path(".pytest_cache/v/cache/lastfailed")
NO_SUCH_TEST, NO_TESTS = 4, 5
"""Exit codes of pytest where a test is not found, and where none was chosen."""


class Outcome(NamedTuple):
    """How a run of tests ended.

    Attributes
    ----------
    code
        The exit code of pytest; None if the time was over.
    failed
        Tests that failed, and files that could not be imported.
    """

    code: int | None
    failed: list[str]

    @property
    def is_kill(self) -> bool:
        """Whether tests say that something is wrong."""
        return self.code not in {0, NO_TESTS, None}


Run = Callable[[Path, Sequence[str], float], Outcome]
"""Runs pytest in a folder, with arguments, for so many seconds."""


class UnsoundSuiteError(Exception):
    """Tests that break off without any mistake tell nothing."""


class Copy:
    """A checkout whose modules get mistakes.

    Attributes
    ----------
    unsound
        Tests that fail without any mistake. They are left out.
    """

    def __init__(self, folder: Path, run: Run) -> None:
        self.folder = folder
        self.unsound: set[str] = set()
        self._run = run
        self._sound: set[str] = set()

    def run(self, arguments: Sequence[str], seconds: float) -> Outcome:
        """Run tests, but for those that fail anyway."""
        left_out = [
            f"--deselect={test}" if "::" in test else f"--ignore={test}"
            for test in sorted(self.unsound)
        ]
        chosen = [one for one in arguments if one not in self.unsound]
        return self._run(self.folder, [*left_out, *chosen], seconds)

    def sound(self, tests: Iterable[str], seconds: float) -> list[str]:
        """Those tests that pass without any mistake. The others are left out from now
        on.
        """
        tests = list(tests)
        new = [one for one in tests if one not in self._sound | self.unsound]
        if new:
            outcome = self._run(self.folder, ["-n", "0", *new], seconds)
            if outcome.code == NO_SUCH_TEST and len(new) > 1:
                return [one for test in tests for one in self.sound([test], seconds)]
            # A test that is there only with a mistake fails by the mistake.
            is_there = outcome.code != NO_SUCH_TEST or "::" not in new[0]
            broke_off = outcome.is_kill and not outcome.failed
            if outcome.code is None or (is_there and broke_off):
                raise UnsoundSuiteError(" ".join(new))
            self.unsound |= set(outcome.failed)
            self._sound |= set(new) - self.unsound
        return [one for one in tests if one in self._sound]

    @contextmanager
    def mistaken(self, mutants: Iterable[Mutant]) -> Iterator[None]:
        """The copy with mistakes, as long as the block lasts."""
        of_file: dict[Path, list[Mutant]] = {}
        for one in mutants:
            of_file.setdefault(self.folder / one.path, []).append(one)
        before = {file: file.read_text(encoding="utf-8") for file in of_file}
        try:
            for file, those in of_file.items():
                file.write_text(applied(before[file], those), encoding="utf-8")
            yield
        finally:
            for file, text in before.items():
                file.write_text(text, encoding="utf-8")


def run_tests(folder: Path, arguments: Sequence[str], seconds: float) -> Outcome:
    """Run pytest in a checkout with an environment of its own. All of its processes end
    with it.
    """
    last_failed = folder / LAST_FAILED
    last_failed.unlink(missing_ok=True)
    process = subprocess.Popen(
        [folder / ".venv/bin/pytest", *OPTIONS, *arguments],
        cwd=folder,
        env=_environment(folder),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    try:
        code = process.wait(max(seconds, 1.0))
    except subprocess.TimeoutExpired:
        code = None
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()
    failed = json.loads(last_failed.read_text()) if last_failed.exists() else {}
    return Outcome(code, list(failed))


def made(folder: Path, revision: str) -> Copy:
    """A copy of the checkout with the tests of a revision, and with an environment."""
    _call("git", "clone", "--quiet", str(ROOT), str(folder))
    shutil.rmtree(folder / "tests")
    _call("git", "checkout", "--quiet", revision, "--", "tests", folder=folder)
    _call("make", "--quiet", ".venv/installed", ".venv/browser", folder=folder)
    return Copy(folder, run_tests)


def demand_no_changes() -> None:
    """A copy has what is committed, and nothing else.

    Raises
    ------
    SystemExit
        If the work tree has changes.
    """
    if _call("git", "status", "--porcelain"):
        raise SystemExit("the work tree has changes, which copies lack: commit them")


def named(revision: str) -> str:
    """The full name of a revision.

    Raises
    ------
    SystemExit
        If there is none.
    """
    try:
        return _call("git", "rev-parse", "--quiet", "--verify", revision + "^{commit}")
    except subprocess.CalledProcessError:
        raise SystemExit(f"git knows no revision {revision}") from None


def _call(*command: str, folder: Path = ROOT) -> str:
    done = subprocess.run(
        command,
        cwd=folder,
        env=_environment(folder),
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    return done.stdout.strip()


def _environment(folder: Path) -> dict[str, str]:
    """That of the user; compiled kernels of a copy lie beside it."""
    if folder == ROOT:
        return dict(os.environ)
    caches = folder.with_name(folder.name + "-caches")
    kept = {
        name: value
        for name, value in os.environ.items()
        if not re.match("PYTEST_|NUMBA_|VIRTUAL_ENV|PYTHONPATH", name)
    }
    # What pip and uv have downloaded already is found again.
    home = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    downloads = {"UV_CACHE_DIR": f"{home}/uv", "PIP_CACHE_DIR": f"{home}/pip"}
    return downloads | kept | {"XDG_CACHE_HOME": str(caches)}
