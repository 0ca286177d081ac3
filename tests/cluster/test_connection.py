"""A connection to a scheduler that is cut, or answers nothing, at any moment of the
start of a launch.
"""

import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress

import pytest

from sweep.errors import WorkersError
from sweep.workers import cluster as engine
from sweep.workers.cluster import Dask
from sweep.workers.connection import THREAD, exposed
from sweep.workers.tasks import Tasks
from tests import runner_jobs
from tests.cluster.started import TESTS, Cluster, cluster, until
from tests.faults.jobs import square
from tests.lines import HERE, Line


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    """A cluster of one worker for all tests."""
    with cluster(tmp_path_factory.mktemp("cluster"), 1, **TESTS) as made:
        yield made


@pytest.fixture
def line(made: Cluster) -> Iterator[Line]:
    """A line of the launching process alone to the scheduler."""
    assert made.line.target
    with closing(Line(made.line.target)) as line:
        yield line.mend()


def dask(line: Line) -> Dask:
    return Dask(f"tcp://{HERE}:{line.port}")


def connecting() -> set[threading.Thread]:
    """The threads of connections that are made or open."""
    return {thread for thread in threading.enumerate() if thread.name == THREAD}


@pytest.mark.slow
def test_each_packet_of_the_start_may_be_the_last_of_its_connection(
    line: Line, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The first connection is closed at once; each later one carries one packet more
    than that before, until one is enough: so they are cut while connecting,
    subscribing, counting workers, asking them, and sending the first task.
    """
    monkeypatch.setattr(engine, "CONNECT_SECONDS", 300.0)
    cuts = [0]

    def cut(number: int) -> None:
        if number - cuts[-1] == len(cuts):
            cuts.append(number)
            line.reset()

    line.greets = lambda number: number > 1
    line.passes = cut
    launch = dask(line)
    try:
        results = runner_jobs.run_all(range(6), square, launch)
    finally:
        launch.stop()
    assert sorted(results) == [(job, job * job) for job in range(6)]
    assert len(cuts) > 15
    assert "does not answer yet" in caplog.text
    assert "is lost; waiting up to 10 minutes for it to come back" in caplog.text


def test_one_that_is_lost_again_and_again_is_given_up(
    line: Line, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It answers each time, and is cut before it has said which workers it has."""
    asked = []

    def ask(tasks: Tasks, **_: object) -> None:
        line.reset()
        tasks._connection.client.close()
        asked.append(tasks)
        if len(asked) == 3:  # now the time is over
            monkeypatch.setattr(engine, "AWAY_SECONDS", 0.0)
        raise ConnectionError("cut")

    monkeypatch.setattr(Tasks, "ask_workers", ask)
    launch = dask(line)
    launch.connect()
    with pytest.raises(
        WorkersError, match=r"has been away for 0 minutes .*the same command resumes"
    ):
        runner_jobs.run_all(range(6), square, launch)
    assert len(asked) == 3


@pytest.mark.parametrize(
    "said", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"SSH-2.0-OpenSSH_9.2\r\n"]
)
def test_what_is_no_scheduler_is_refused_soon(
    said: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It says something else, or nothing for as long as one listens; no thread of ours
    stays behind."""
    monkeypatch.setattr(engine, "CONNECT_SECONDS", 60.0 if said else 0.5)
    before = connecting()
    with socket.create_server((HERE, 0)) as server, ExitStack() as connections:

        def answer() -> None:
            with suppress(OSError):
                while True:
                    connection, _ = server.accept()
                    connections.enter_context(connection).sendall(said)

        answering = threading.Thread(target=answer)
        answering.start()
        address = f"tcp://{HERE}:{server.getsockname()[1]}"
        words = (
            "the program that answers is not a dask scheduler"
            if said
            else f"no dask scheduler answers at {address}: "
        )
        with pytest.raises(WorkersError, match=words):
            Dask(address).connect()
        server.shutdown(socket.SHUT_RDWR)
        answering.join()
    until(lambda: not connecting() - before, "the thread of the connection ends")


def test_a_plain_address_elsewhere_is_neither_one_here_nor_an_encrypted_one() -> None:
    assert [exposed(f"tcp://{host}:8786") for host in (HERE, "localhost", "[::1]")] == [
        False
    ] * 3
    assert exposed("tcp://192.0.2.1:8786")
    assert not exposed("tls://192.0.2.1:8786")


def test_that_others_may_reach_a_scheduler_is_said_once(
    line: Line, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(
        engine, "exposed", lambda address: address == f"tcp://{HERE}:{line.port}"
    )
    launch = dask(line)
    for _ in range(2):
        launch.connect()
        launch.stop()
    assert caplog.text.count("the connection is not encrypted: anybody who can") == 1
