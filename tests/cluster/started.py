"""A dask cluster on this machine, started by dask's own commands; nothing of it is left
at the end.
"""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from urllib.parse import urlsplit

from tests import ROOT
from tests.lines import HERE, Line
from tests.patience import PATIENCE

TESTS = {"PYTHONPATH": str(ROOT)}
"""By which workers find the jobs of tests."""
SETTINGS = {"DASK_LOGGING__DISTRIBUTED": "info", "PYTHONUNBUFFERED": "1"}


def until(condition: Callable[[], bool], what: str) -> None:
    """Wait for a condition, however slow the machine is."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline, f"in vain: {what}"
        time.sleep(0.05)


class Cluster:
    """A scheduler and workers, each a process in a session of its own, with a log file
    in `folder`.

    The scheduler takes a free port whenever it is started; `line` leads to it, from
    where everybody expects it.
    """

    def __init__(
        self, folder: Path, environment: dict[str, str], protocol: str = "tcp"
    ) -> None:
        self.folder = folder
        self.environment = os.environ | SETTINGS | environment
        self.line = Line()
        self.protocol = protocol
        self.address = f"{protocol}://{HERE}:{self.line.port}"
        self.processes: list[subprocess.Popen[bytes]] = []
        self.logs: list[Path] = []
        self.scheduler = self.start_scheduler()

    def start_scheduler(self, *options: str) -> "subprocess.Popen[bytes]":
        """A scheduler at our address."""
        told = self.folder / f"scheduler-{len(self.logs)}.json"
        usual = [
            "--host",
            HERE,
            "--port",
            "0",
            "--protocol",
            self.protocol,
            "--no-dashboard",
        ]
        usual += ["--dashboard-address", f"{HERE}:0"]
        self.scheduler = self._started(
            "dask_scheduler", [*usual, "--scheduler-file", str(told), *options], {}
        )
        until(
            lambda: told.exists() and told.read_text().endswith("}"),
            "the scheduler listens",
        )
        self.line.cut()
        self.line.target = urlsplit(json.loads(told.read_text())["address"]).port
        self.line.mend()
        return self.scheduler

    def start_worker(
        self, *options: str, **environment: str
    ) -> "subprocess.Popen[bytes]":
        """A worker process of one thread, without a nanny unless `options` say
        otherwise.
        """
        plain = [
            "--nthreads",
            "1",
            "--no-dashboard",
            "--death-timeout",
            "60",
            "--local-directory",
            str(self.folder),
        ]
        nanny = [] if "--nanny" in options else ["--no-nanny"]
        return self._started(
            "dask_worker", [self.address, *plain, *nanny, *options], environment
        )

    def _started(
        self, command: str, options: Sequence[str], environment: dict[str, str]
    ) -> "subprocess.Popen[bytes]":
        self.logs.append(self.folder / f"{len(self.logs)}-{command}.log")
        with self.logs[-1].open("wb") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", f"distributed.cli.{command}", *options],
                cwd=self.folder,
                env=self.environment | environment,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self.processes.append(process)
        return process

    def end(self) -> None:
        """Kill everything, with what it has started."""
        for process in self.processes:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
        self.line.close()


@contextmanager
def cluster(folder: Path, workers: int, **environment: str) -> Iterator[Cluster]:
    """A scheduler and so many workers."""
    made = Cluster(folder, environment)
    try:
        for _ in range(workers):
            made.start_worker()
        yield made
    finally:
        made.end()
