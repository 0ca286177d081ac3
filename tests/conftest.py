"""Settings of all tests."""

# isort: off
# Before anything that looks at its environment is imported.
from tests import environment  # noqa: F401

# isort: on

import fcntl
import gc
import os
import signal
import time
from collections import Counter
from collections.abc import Generator, Iterator
from functools import cache
from importlib import import_module
from pkgutil import walk_packages
from typing import TYPE_CHECKING, Any

import sweep  # isort: skip (closes the folder of kernels)
import pytest
from hypothesis import settings
from numba.core.event import Event, Listener, register
from typer.main import get_command

from kernels.caching import FOLDER
from kernels.metrics import METRICS
from kernels.models import MODELS
from sweep.design.jobs import Job
from sweep.store import provenance
from sweep.trial.simulation import run
from sweep.workers import flying
from tests.builders import every_metric, job

if TYPE_CHECKING:
    from playwright.sync_api import Browser

settings.register_profile("kernels", deadline=None, derandomize=True)
settings.load_profile("kernels")

# A shell starts its background jobs deaf to Ctrl-C, and nohup its jobs to SIGHUP, which
# tests of interruptions need.
signal.signal(signal.SIGINT, signal.default_int_handler)
signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collecting leaves a million objects that stay: nobody looks for garbage among
    them, now or later.
    """
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What needs a browser is slow, but for one look at each page."""
    for item in items:
        in_a_browser = "browser" in getattr(item, "fixturenames", ())
        if in_a_browser and not item.get_closest_marker("smoke"):
            item.add_marker(pytest.mark.slow)


def pytest_runtest_teardown(item: pytest.Item) -> None:
    """An error that is a value of a case, and was raised, keeps all that was there: a
    server with its pages and their flights.
    """
    for value in getattr(getattr(item, "callspec", None), "params", {}).values():
        if isinstance(value, BaseException):
            value.__traceback__ = value.__context__ = None


LISTED_SECONDS = 1.0
FOR_ALL = "before the first test"


class Compiled(Listener):
    """Counts the kernels that each file of tests compiles, with their seconds of
    processor. What a kernel calls is compiled with it, and is one with it.
    """

    def __init__(self) -> None:
        self.kernels: Counter[str] = Counter()
        self.seconds: Counter[str] = Counter()
        self.before = False
        """Whether what is compiled now is for all tests."""
        self._began: list[float] = []

    def on_start(self, event: Event) -> None:  # noqa: ARG002 (numba's interface)
        self._began.append(time.process_time())

    def on_end(self, event: Event) -> None:  # noqa: ARG002
        began = self._began.pop()
        if not self._began:
            test = os.environ.get("PYTEST_CURRENT_TEST", "")
            place = FOR_ALL if self.before else test.partition("::")[0]
            self.kernels[place] += 1
            self.seconds[place] += time.process_time() - began


COMPILED = Compiled()
register("numba:compile", COMPILED)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Modules end with the interpreter as they do elsewhere."""
    gc.unfreeze()
    if hasattr(session.config, "workeroutput"):
        session.config.workeroutput["kernels"] = dict(COMPILED.kernels)
        session.config.workeroutput["seconds"] = dict(COMPILED.seconds)


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """A worker has ended, and says what it has compiled."""
    said = getattr(node, "workeroutput", {})
    COMPILED.kernels.update(said.get("kernels", {}))
    COMPILED.seconds.update(said.get("seconds", {}))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say which files of tests compiled how many kernels, in how many seconds."""
    total, seconds = COMPILED.kernels.total(), COMPILED.seconds.total()
    terminalreporter.section(f"{total} kernels compiled in {seconds:.0f} s")
    for place, its_own in COMPILED.seconds.most_common():
        if its_own >= LISTED_SECONDS:
            count = COMPILED.kernels[place]
            terminalreporter.line(f"{its_own:6.1f} s {count:4} {place}")


@pytest.fixture(scope="session")
def browser() -> "Iterator[Browser]":
    """One browser for all tests of a worker: playwright runs once in a thread."""
    from tests.web.chromium import running_browser  # only pages need playwright

    with running_browser() as browser:
        yield browser


@pytest.fixture(scope="session", autouse=True)
def alone() -> Iterator[None]:
    """A launch flies trials together where some test has compiled that already. So it
    does only where a test says so.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flying, "worth_flying_together", lambda *_: False)
        yield


@pytest.fixture(scope="session", autouse=True)
def no_compiler_for_gpus() -> Iterator[None]:
    """To compile a model for a GPU takes 5 to 20 s. A check of a model does it only
    where a test says so.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sweep.testing.devices.find_spec", lambda _name: None)
        yield


@pytest.fixture(scope="session", autouse=True)
def without_waiting() -> Iterator[None]:
    """A launch within a test's process asks git once what the checkout is, which takes
    eight processes, and waits for no disk: it flushes what is open, seventeen times.

    What git says and what is flushed, and when, have tests of their own, which replace
    these. A launch in a process of its own has the true ones.
    """
    state = cache(provenance.git_state)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(provenance, "git_state", lambda folder: dict(state(folder)))
        patch.setattr(os, "fsync", os.fstat)
        yield


@pytest.fixture(scope="session", autouse=True)
def faces_are_whole() -> None:
    """A face keeps each name that was taken. If a test replaced one behind the face,
    what others get would depend on who took it first. So tests replace names of faces.
    """
    for module in walk_packages(sweep.__path__, "sweep."):
        if module.ispkg:
            package = import_module(module.name)
            for name in dir(package):
                getattr(package, name)


@pytest.fixture(scope="session", autouse=True)
def commands_are_told_once() -> Iterator[None]:
    """A command within a test's process is found among all. The options of all are read
    from the code once, which takes 10 ms.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("typer.main.get_command", cache(get_command))
        yield


@pytest.fixture(scope="session", autouse=True)
def compiled(tmp_path_factory: pytest.TempPathFactory) -> None:
    """The kernels of all models and metrics are compiled once, shared out among the
    workers of a test run.

    Without it every worker compiles what it meets first, and so do the processes that
    its tests start meanwhile. The first job has what all have in common; with it
    compiled, the others can be compiled at the same time.
    """
    worker = os.environ.get("PYTEST_XDIST_WORKER")
    if worker is None:
        return
    COMPILED.before = True
    jobs = compiled_at_first()
    others = list(range(1, len(jobs)))
    for number in [0, *(others if worker == "gw0" else reversed(others))]:
        with (tmp_path_factory.getbasetemp().parent / f"compiled-{number}").open(
            "w"
        ) as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            run(jobs[number])
    COMPILED.before = False


def compiled_at_first() -> list[Job]:
    """The trials whose kernels all tests share: each model, and all metrics.

    What a test compiles besides is of models, metrics or maps that it makes up, or of
    trials in lanes or on a device.
    """
    jobs = [job(model, metrics=("speed",), n=4, steps=2) for model in MODELS]
    for model in ("nguyen2024", "strombom2014"):  # together they have all metrics
        jobs.append(job(model, metrics=every_metric(model), n=4, steps=2))
    jobs.append(job("vasarhelyi2018", "real", metrics=("speed",), n=4, steps=2))
    return jobs


def pytest_report_header(config: pytest.Config) -> str | None:
    """What several workers compile before their first test, so that nobody wonders."""
    if not config.getoption("numprocesses", None):
        return None
    return (
        f"kernels: {len(MODELS)} models and {len(METRICS)} metrics are compiled first,"
        f" in 70 s of processor where {FOLDER} has none"
    )
