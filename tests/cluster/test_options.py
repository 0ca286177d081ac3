"""Options of a cluster that cannot be are said at once,
in one line, before any work.
"""

import importlib.util
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from sweep.workers import cluster
from tests.commands import sweep
from tests.lines import HERE, Line
from tests.studies import SMALL

DASK = ["--executor", "dask"]


@pytest.fixture
def refused(tmp_path: Path) -> Callable[..., str]:
    """What a launch with such options says, which ends with exit code 2 and stores
    nothing.
    """
    (tmp_path / "small.yaml").write_text(SMALL, encoding="utf-8")

    def run(*options: str) -> str:
        done = sweep(tmp_path, "launch", "small.yaml", *options)
        assert (done.returncode, done.stdout) == (2, "")
        assert [path.name for path in tmp_path.iterdir()] == ["small.yaml"]
        [line] = done.stderr.splitlines()
        return line

    return run


def test_options_that_do_not_go_together(refused: Callable[..., str]) -> None:
    either = (
        "--executor dask: give either --address tcp://HOST:PORT or --scheduler-file"
        " FILE"
    )
    assert refused(*DASK) == either
    assert refused(*DASK, "--address", "tcp://a:1", "--scheduler-file", "b") == either
    assert (
        refused("--address", "tcp://a:1")
        == "--address: only a dask cluster has one; add --executor dask"
    )
    assert refused("--scheduler-file", "b").startswith(
        "--scheduler-file: only a dask cluster has one"
    )
    assert refused(*DASK, "--workers", "2", "--address", "tcp://a:1").startswith(
        "--workers: a dask cluster has"
    )
    assert refused(*DASK, "--scheduler-file", "b").startswith(
        "b: no such file; `dask scheduler"
    )
    assert (
        refused(*DASK, "--address", "a:1")
        == "--address a:1: give it as the scheduler prints it, e.g. tcp://10.0.0.1:8786"
    )


def test_a_missing_package_is_named(
    refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        "sweep.workers.engines.find_spec",
        lambda name: None if name == "distributed" else find(name),
    )
    words = '--executor dask: needs dask.distributed: pip install "boidsweep[dask]"'
    assert refused(*DASK, "--address", "tcp://a:1") == words


def test_a_scheduler_that_does_not_answer(
    refused: Callable[..., str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(cluster, "CONNECT_SECONDS", 0.5)
    with closing(Line()) as cut:
        address = f"tcp://{HERE}:{cut.port}"
        said = refused(*DASK, "--address", address)
    assert said.startswith(f"no dask scheduler answers at {address}: ")
