"""Code in the folder where a user stands never runs, and settings are not obeyed."""

import ast
import ctypes
import json
import os
import re
import signal
import struct
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib.metadata import packages_distributions
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests import ROOT
from tests.cases import slow_but
from tests.patience import PATIENCE
from tests.searches import TINY
from tests.studies import SMALL, launched

COMMAND = "from sweep.cli import main\nmain()\n"
SEVERAL = """
import json, sys
from sweep.cli import main

for arguments in json.loads(sys.argv[1]):
    sys.argv = ["sweep", *arguments]
    try:
        main()
    except SystemExit as ending:
        assert not ending.code, (arguments, ending.code)
    print(*arguments, flush=True)
"""
"""Several commands in one process, which starts once."""
OF_PYTHON = {name for name in sys.stdlib_module_names if find_spec(name)}
SHADOWS = {
    *sys.stdlib_module_names,
    *packages_distributions(),
    *("sweep", "kernels", "sitecustomize", "usercustomize"),
}
"""Every module that this environment has; a file of such a name may be taken for it."""
MARK = """
import os, sys
with open({marks!r}, "a") as file:
    print(__name__, os.getpid(), sys.argv, file=file)
raise ImportError("a stranger's file")
"""


class Hostile:
    """A folder that a stranger has filled, and scripts of ours that lie elsewhere."""

    def __init__(self, root: Path, shadows: set[str]) -> None:
        self.folder, self.scripts = root / "stranger", root / "scripts"
        self.marks = root / "marks"
        self.environment = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith("PYTHON")
        }
        self.folder.mkdir()
        self.scripts.mkdir()
        for name in shadows:
            (self.folder / f"{name}.py").write_text(MARK.format(marks=str(self.marks)))
        (self.folder / "small.yaml").write_text(SMALL)
        (self.folder / "search.yaml").write_text(TINY)

    def run(self, code: str, *arguments: str) -> str:
        """What a script prints that runs in the folder; no other file may have run."""
        script = self.scripts / "script.py"
        script.write_text(code)
        done = subprocess.run(
            [sys.executable, str(script), *arguments],
            cwd=self.folder,
            env=self.environment,
            capture_output=True,
            text=True,
            timeout=PATIENCE,
        )
        assert self.ran() == ""
        assert done.returncode == 0, done.stderr
        return done.stdout + done.stderr

    def ran(self) -> str:
        """Which files of the folder have run."""
        return self.marks.read_text() if self.marks.exists() else ""


@pytest.fixture
def hostile(tmp_path: Path) -> Hostile:
    """A folder with a file of the name of every module."""
    return Hostile(tmp_path, SHADOWS)


@pytest.mark.parametrize("workers", slow_but(["1"], ["1", "2"]))
def test_nothing_beside_a_spec_runs_on_a_launch(hostile: Hostile, workers: str) -> None:
    """In workers, in the trackers of loky and multiprocessing, and in the command."""
    said = hostile.run(COMMAND, "launch", "small.yaml", "--workers", workers)
    assert "6 new trials (6 done)" in said


@pytest.mark.slow
def test_nothing_runs_on_a_search_and_a_verification(hostile: Hostile) -> None:
    launched(SMALL, hostile.folder / "results")
    commands = [
        ["search", "search.yaml", "--workers", "1"],
        ["verify", "small", "--fraction", "1", "--workers", "1"],
    ]
    said = hostile.run(SEVERAL, json.dumps(commands))
    assert "6 of 6" in said


@pytest.mark.slow
def test_nothing_runs_when_stored_results_are_read(hostile: Hostile) -> None:
    trial = launched(SMALL, hostile.folder / "results").trials["trial_id"][0]
    commands = [
        ["plan", "small.yaml"],
        ["status", "small"],
        ["table", "small"],
        ["compare", "small:separation_weight=0.5", "small:separation_weight=1"],
        ["plot", "small"],
        ["replay", "small", trial, "--frame", "2", "frame.png"],
        ["diff", "small.yaml"],
        ["gc", "small", "--dry-run"],
        ["export", "small", "--to", "small.csv"],
        ["models"],
        ["maps"],
        ["metrics"],
        ["schema"],
    ]
    said = hostile.run(SEVERAL, json.dumps(commands))
    assert all(" ".join(command) in said.splitlines() for command in commands)


@pytest.mark.slow
def test_nothing_runs_on_a_view(hostile: Hostile) -> None:
    script = hostile.scripts / "script.py"
    script.write_text(COMMAND)
    command = [sys.executable, str(script), "view", "small.yaml", "--no-open"]
    place = {"cwd": hostile.folder, "env": hostile.environment}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, **place) as view:
        assert view.stdout is not None
        assert view.stdout.readline().startswith("http://127.0.0.1:")
        view.send_signal(signal.SIGINT)
    assert hostile.ran() == ""


RUN = """
import sweep

print(sweep.run("small.yaml", workers=1).statuses())
"""
NOTEBOOK = """
import sys
packages = [path for path in sys.path if path.endswith("site-packages")]
sys.path.insert(sys.path.index(packages[0]), "")
"""


@pytest.mark.slow
def test_nothing_runs_in_workers_of_a_program(hostile: Hostile) -> None:
    assert "{'done': 6}" in hostile.run(RUN)


@pytest.mark.slow
def test_workers_of_a_notebook_look_where_the_notebook_looks(tmp_path: Path) -> None:
    """IPython puts the current folder behind the modules of Python: there it stays."""
    assert "{'done': 6}" in Hostile(tmp_path, OF_PYTHON).run(NOTEBOOK + RUN)


ENVIRON = """
import os
from sweep.workers.executors import Loky
from sweep.surroundings import SAFE_PATH

engine = Loky(1)
print(engine.start().submit(os.getenv, SAFE_PATH).result(), os.getenv(SAFE_PATH))
engine.stop()
"""


@pytest.mark.parametrize("value", slow_but([None, "yes"], [None, "", "yes"]))
def test_a_program_keeps_its_environment(tmp_path: Path, value: str | None) -> None:
    mine = Hostile(tmp_path, set())
    if value is not None:
        mine.environment["PYTHONSAFEPATH"] = value
    assert mine.run(ENVIRON) == f"1 {value}\n"


@pytest.mark.slow
def test_settings_of_matplotlib_in_the_folder_are_not_obeyed(tmp_path: Path) -> None:
    mine = Hostile(tmp_path, set())
    launched(SMALL, mine.folder / "results")
    pictures = []
    for settings in ("", "figure.facecolor: red\ntext.usetex: True\nsavefig.dpi: 20\n"):
        (mine.folder / "matplotlibrc").write_text(settings)
        mine.run(COMMAND, "plot", "small", "curves")
        pictures.append((mine.folder / "results/small/figures/curves.png").read_bytes())
    assert pictures[0] == pictures[1]


NUMBA = """
import sys

def asked(_=None):
    import numba
    from numba.core import config
    seen = [numba.config.DISABLE_JIT, int(numba.config.OPT)]
    config._env_reloader.reset()  # as when NUMBA_... changes
    return [*seen, numba.config.DISABLE_JIT, int(numba.config.OPT)]

if __name__ == "__main__":
    sys.argv = ["sweep", "status", "small"]
    from script import asked
    from sweep.cli import main
    from sweep.workers.executors import Loky
    try:
        main()
    except SystemExit:
        pass
    engine = Loky(1)
    print("asked", asked(), engine.start().submit(asked).result())
    engine.stop()
"""


@pytest.mark.slow
def test_settings_of_numba_in_the_folder_are_not_obeyed(tmp_path: Path) -> None:
    """Neither by a command nor by its workers, neither at first nor later."""
    mine = Hostile(tmp_path, set())
    launched(SMALL, mine.folder / "results")
    (mine.folder / ".numba_config.yaml").write_text("disable_jit: 1\nopt: 0\n")
    assert "asked [0, 3, 0, 3] [0, 3, 0, 3]\n" in mine.run(NUMBA)


class Opened:
    """The files of folders that any process opens from now on: the kernel of Linux
    notes each, also of a process that is killed.
    """

    IN_OPEN = 0x20
    EVENT = struct.Struct("iIII")

    def __init__(self, *folders: Path) -> None:
        libc = ctypes.CDLL(None, use_errno=True)
        self._queue = libc.inotify_init1(os.O_NONBLOCK)
        for folder in folders:
            watch = libc.inotify_add_watch(
                self._queue, os.fsencode(folder), self.IN_OPEN
            )
            assert watch > 0, os.strerror(ctypes.get_errno())

    def names(self) -> set[str]:
        found = set()
        with suppress(BlockingIOError):
            while events := os.read(self._queue, 1 << 20):
                while events:
                    length = self.EVENT.unpack_from(events)[3]
                    name, events = (
                        events[self.EVENT.size : self.EVENT.size + length],
                        events[self.EVENT.size + length :],
                    )
                    found.add(os.fsdecode(name.rstrip(b"\0")))
        return found

    def close(self) -> None:
        os.close(self._queue)


LAID = (
    *(".numba_config.yaml", "matplotlibrc", ".env", ".netrc", ".gitconfig"),
    *("dask.yaml", "distributed.yaml", ".dask", "alembic.ini", "optuna.ini"),
    *("ipython_config.py", "ipython_kernel_config.py", "jupyter_config.json"),
    *("jupyter_config.py", "pyproject.toml", "setup.cfg", "pyvenv.cfg", "uvicorn.ini"),
    *("logging.conf", ".pdbrc", ".pythonrc", "python311._pth", "libcuda.so"),
)
"""Settings as libraries and programs call them, none of which is Python's to run."""
ALL = """
import json, os, sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace


def compiling():
    from sweep.trial import one_step
    from sweep.web import begin
    from sweep.web.compiling import _apart

    _apart(one_step(begin("nguyen2024", "as_run").job))


def launching():
    from sweep.own_code.reading import load_spec
    from sweep.store.locations import location
    from sweep.web.launching import Launcher

    spec = Path("small.yaml")
    started = Launcher(spec, location("results"))._start(load_spec(spec))
    assert started.process.wait() == 0


def page_beside():
    from sweep.cli.page_beside import page_beside

    with page_beside(["small", "--to", "figure.html"]):
        pass


def video():
    import numpy as np
    from sweep.errors import OutputError
    from sweep.replays.video import write_mp4

    with Path("film.mp4").open("wb") as file, suppress(OutputError):  # not installed
        write_mp4(iter([np.zeros((16, 16, 3), np.uint8)] * 2), file)


def trying():
    from sweep.surroundings import SETTINGS, ignore_settings

    ignore_settings(*SETTINGS)  # as the command does, before it imports figures
    from sweep.errors import WorkersError
    from sweep.published.program_mutants import PROGRAM_MUTANTS
    from sweep.published.trying import _judged_by_copy
    from sweep.workers.executors import Serial

    document = SimpleNamespace(name="none", folder=Path("none"))
    variant = SimpleNamespace(name="radians", program=PROGRAM_MUTANTS["radians"])
    with suppress(WorkersError):  # there is no such document
        _judged_by_copy(document, variant, Path("results"), Serial())


def repository():
    from sweep.store.repository import study_state

    spec = Path("small.yaml").absolute()
    study_state(spec, spec.read_text())


def elsewhere():
    from sweep.testing.elsewhere import run_elsewhere

    with suppress(RuntimeError):  # there is no such file
        run_elsewhere("", "sweep.testing.interpreted", "./none.py", "flights.npz")


def executors():
    from sweep.workers.executors import Loky

    engine = Loky(1)
    assert engine.start().submit(asked).result() == "0"
    engine.stop()


def remote():
    import distributed
    from sweep.workers.remote import _new_warden

    scheduler = SimpleNamespace(address="tcp://127.0.0.1:9")
    distributed.get_worker = lambda: SimpleNamespace(scheduler=scheduler)
    warden = _new_warden()
    warden.stdin.close()
    assert warden.wait() == 0


def asked():
    import kernels
    from numba import config

    return str(config.DISABLE_JIT)


if __name__ == "__main__":
    import sweep

    STARTERS = {
        "sweep/cli/page_beside.py": page_beside,
        "sweep/published/trying.py": trying,
        "sweep/replays/video.py": video,
        "sweep/store/repository.py": repository,
        "sweep/testing/elsewhere.py": elsewhere,
        "sweep/web/compiling.py": compiling,
        "sweep/web/launching.py": launching,
        "sweep/workers/executors.py": executors,
        "sweep/workers/remote.py": remote,
    }
    for name in json.loads(sys.argv[1]):
        STARTERS[name]()
"""
STARTS = {"Popen", "ProcessPoolExecutor", "create_subprocess_exec", "execv", "spawnv"}
STARTS_OF_MODULES = {"subprocess", "multiprocessing", "pty", "os.system", "os.popen"}
WORDS = STARTS | {name.removeprefix("os.") for name in STARTS_OF_MODULES}


def starts_processes(text: str) -> bool:
    """Whether a module names what starts processes."""
    nodes = [*ast.walk(ast.parse(text))]
    imported = {
        name
        for node in nodes
        if isinstance(node, ast.Import | ast.ImportFrom)
        for name in (
            [alias.name for alias in node.names] + [getattr(node, "module", None) or ""]
        )
    }
    called = {
        getattr(node, "attr", getattr(node, "id", ""))
        for node in nodes
        if isinstance(node, ast.Attribute | ast.Name)
    }
    return bool(STARTS & (imported | called) or STARTS_OF_MODULES & imported)


def starters() -> list[str]:
    """The modules that start processes. To parse all would take ten seconds: so only
    those are parsed that have one of the words somewhere.
    """
    return [
        path.relative_to(ROOT).as_posix()
        for path in sorted((ROOT / "sweep").glob("**/*.py"))
        if any(word in (text := path.read_text()) for word in WORDS)
        and starts_processes(text)
    ]


@pytest.mark.skipif(sys.platform != "linux", reason="asks the kernel of Linux")
@pytest.mark.parametrize(
    "listed",
    [
        pytest.param(lambda: ["sweep/web/compiling.py"], id="one"),
        pytest.param(starters, marks=pytest.mark.slow, id="every one"),
    ],
)
def test_no_process_of_ours_opens_settings_that_lie_in_the_folder(
    tmp_path: Path, listed: Callable[[], list[str]]
) -> None:
    """Nor in the folder above it. `import numba` alone does, which shows that the
    kernel would tell.
    """
    mine = Hostile(tmp_path, set())
    launched(SMALL, mine.folder / "results")
    for folder in (mine.folder, mine.folder.parent):
        for name in LAID:
            (folder / name).write_text("# of a stranger\n")
    opened = Opened(mine.folder, mine.folder.parent)
    mine.run("import numba")
    assert opened.names() & {*LAID} == {".numba_config.yaml"}
    mine.run(ALL, json.dumps(listed()))
    assert opened.names() & {*LAID} == set()
    opened.close()


def test_each_module_that_starts_a_process_is_tried() -> None:
    assert re.findall(r'^        "(sweep/.*\.py)": ', ALL, re.MULTILINE) == starters()


FIRST = """
import os
{before}
import sweep.trial.numba_errors
from numba import config

first = config.DISABLE_JIT
os.environ["NUMBA_SHOW_HELP"] = "1"  # numba reads all settings again
config.reload_config()
print(first, config.DISABLE_JIT)
"""


@pytest.mark.parametrize(("before", "obeyed"), [("", 0), ("import numba", 1)])
def test_a_program_that_imports_sweep_first_obeys_no_settings_of_numba(
    tmp_path: Path, before: str, obeyed: int
) -> None:
    """One that has imported numba before has rules of its own."""
    mine = Hostile(tmp_path, set())
    (mine.folder / ".numba_config.yaml").write_text("disable_jit: 1\n")
    assert mine.run(FIRST.format(before=before)) == f"{obeyed} {obeyed}\n"
