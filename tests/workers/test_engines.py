"""Engines are entries: each conforms to what the drive loop asks, and so does one of a
package.
"""

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from sweep.workers.engines import ENGINES, MEMBERS, EngineOptions
from sweep.workers.executors import ExecutorFactory, NotYetError
from sweep.workers.watch import Limits
from tests.cases import slow_but
from tests.cluster.started import TESTS, cluster, until
from tests.commands import started_in_turn, sweep
from tests.other_packages import install
from tests.patience import PATIENCE
from tests.runner_jobs import square, square_or_raise
from tests.studies import SMALL, launched, same

INLINE = '''"""An engine with one thread."""

from concurrent.futures import ThreadPoolExecutor

from sweep.errors import WorkersError
from sweep.workers.engines import Engine
from sweep.workers.executors import FliesOnProcessors
from sweep.workers.watch import LimitKeeper


class OneThread(FliesOnProcessors):
    workers = 1
    pool = None

    def start(self):
        self.pool = self.pool or ThreadPoolExecutor(1)
        return self.pool

    def stop(self):
        if self.pool:
            self.pool.shutdown(cancel_futures=True)
        self.pool = None

    def check(self):
        pass

    def watch(self, limits):
        return LimitKeeper()


def make(options):
    if options.workers > 1:
        raise WorkersError("--workers: a thread is one worker")
    return OneThread()


ENGINE = Engine("a thread of the process that launches", make)
'''


@contextmanager
def _local(_folder: Path) -> Iterator[ExecutorFactory]:
    yield ENGINES["local"].make(EngineOptions(workers=2))


@contextmanager
def _dask(folder: Path) -> Iterator[ExecutorFactory]:
    with cluster(folder, 1, **TESTS) as made:
        yield ENGINES["dask"].make(EngineOptions(address=made.address))


@contextmanager
def _wasm(_folder: Path) -> Iterator[ExecutorFactory]:
    yield ENGINES["wasm"].make(EngineOptions(workers=2))


@contextmanager
def _of_a_package(_folder: Path) -> Iterator[ExecutorFactory]:
    names: dict[str, Any] = {}
    exec(INLINE, names)  # as it stands in the package
    yield names["ENGINE"].make(EngineOptions())


HERE = {"local": _local, "dask": _dask, "wasm": _wasm, "of a package": _of_a_package}
"""The engine of a GPU is the pool of processes of "local", whose workers fly trials in
another way: see test_gpu.
"""


@pytest.mark.parametrize("name", slow_but(["of a package"], HERE))
def test_an_engine_conforms(name: str, tmp_path: Path) -> None:
    (tmp_path / "engine").mkdir()
    with HERE[name](tmp_path / "engine") as engine:
        try:
            until(lambda: _is_ready(engine), "a worker joins")
            running = engine.start()
            assert engine.start() is running
            _check_jobs(running.submit)
            assert engine.workers >= 1
            engine.check()
            assert engine.watch(Limits()) is not None
            engine.stop()
            engine.stop()
            until(lambda: _is_ready(engine), "a worker is there again")
            _check_jobs(engine.start().submit)
            whole = launched(SMALL, tmp_path / "here")
            assert same(launched(SMALL, tmp_path / "there", engine), whole)
        finally:
            engine.stop()


def _is_ready(engine: ExecutorFactory) -> bool:
    with suppress(NotYetError):
        engine.start()
        return True
    return False


def _check_jobs(submit: Callable[..., Any]) -> None:
    """A job has its result, and one that raises is lost alone."""
    raising = submit(square_or_raise, 3)
    assert submit(square, 2).result(PATIENCE) == square(2)
    with pytest.raises(ValueError, match="three is not allowed"):
        raising.result(PATIENCE)
    assert submit(square, 4).result(PATIENCE) == square(4)


def test_an_engine_of_a_package_launches_and_one_that_lacks_members_is_refused(
    tmp_path: Path,
) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL)
    lacking = INLINE.replace("OneThread(FliesOnProcessors)", "OneThread").replace(
        "def watch", "def look"
    )
    engines = {"thread": "inline.engine:ENGINE", "lacking": "inline.lacking:ENGINE"}
    packages = install(
        tmp_path,
        {"boidsweep.engines": engines},
        {"__init__.py": "", "engine.py": INLINE, "lacking.py": lacking},
        name="inline",
    )
    launch = ("launch", "spec.yaml", "--executor", "thread")
    two_workers, lacks, nothing, done = started_in_turn(
        tmp_path,
        packages,
        (*launch, "--workers", "2"),
        ("launch", "spec.yaml", "--executor", "lacking"),
        ("status", "small"),
        (*launch, "--json", "--quiet"),
    )
    assert two_workers.returncode == 2
    assert two_workers.stderr == "--workers: a thread is one worker\n"
    assert lacks.returncode == 2
    assert lacks.stderr == 'executor "lacking": the engine lacks watch, flying\n'
    assert nothing.stderr.startswith("results: no such folder of results")
    assert json.loads(done.stdout)["new"] == {"done": 6}


def test_the_members_of_an_engine_are_those_of_its_protocol() -> None:
    protocol = {name for name in vars(ExecutorFactory) if not name.startswith("_")}
    assert {*MEMBERS} == protocol


def test_a_name_that_no_engine_has_is_refused(tmp_path: Path) -> None:
    (tmp_path / "spec.yaml").write_text(SMALL)
    done = sweep(tmp_path, "launch", "spec.yaml", "--executor", "dsk")
    assert done.returncode == 2
    assert 'unknown executor "dsk"; did you mean "dask"?' in done.stderr
    assert not (tmp_path / "results").exists()
