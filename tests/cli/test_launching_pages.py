"""Commands that open a page which follows, or makes, a launch."""

import http.client
import json
import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest

from tests.commands import SWEEP, sweep
from tests.patience import PATIENCE
from tests.studies import SMALL, launched

LONG = SMALL.replace("steps: 9", "steps: 20000000")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "spec.yaml").write_text(SMALL)
    (tmp_path / "long.yaml").write_text(LONG)
    return tmp_path


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with specs, one of which is wrong, and with results."""
    filled = tmp_path_factory.mktemp("filled")
    (filled / "deeper").mkdir()
    (filled / "spec.yaml").write_text(SMALL)
    (filled / "long.yaml").write_text(LONG)
    (filled / "bad.yaml").write_text(SMALL.replace("steps: 9", "stepps: 9"))
    launched(SMALL, filled / "results")
    return filled


@contextmanager
def started(folder: Path, *words: str) -> Iterator["subprocess.Popen[str]"]:
    """A command in a process of its own, whose stderr is read."""
    with subprocess.Popen(
        [*SWEEP, *words],
        cwd=folder,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        env=os.environ | {"BROWSER": "true"},
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def line_with(process: "subprocess.Popen[str]", words: str) -> str:
    """The next line of stderr that has these words."""
    [line] = lines_with(process, words)
    return line


def lines_with(process: "subprocess.Popen[str]", *words: str) -> list[str]:
    """The next line of stderr that has each of these words, in whichever order a page
    and its launch say them.
    """
    assert process.stderr
    found, wanted = dict[str, str](), {*words}
    while wanted:
        line = process.stderr.readline()
        assert line, f"it ended without saying {wanted}"
        found |= {one: line.strip() for one in wanted if one in line}
        wanted -= found.keys()
    return [found[one] for one in words]


def asked(url: str, question: str) -> Any:
    """What the page is told."""
    address = urlsplit(url)
    connection = http.client.HTTPConnection(address.netloc, timeout=PATIENCE)
    try:
        connection.request("GET", f"{address.path}ask/{question}")
        return json.loads(connection.getresponse().read())
    finally:
        connection.close()


def assert_gone(process: "subprocess.Popen[str]", url: str) -> None:
    """No process holds the stderr of the command any more, and nobody answers."""
    assert process.stderr
    process.stderr.read()
    with pytest.raises(ConnectionRefusedError):
        asked(url, "studies")


@pytest.mark.slow
def test_the_page_of_a_launch_stays_until_ctrl_c(folder: Path) -> None:
    words = ("launch", "spec.yaml", "--show", "--no-open", "--workers", "1")
    with started(folder, *words) as process:
        stays = "the explorer stays open until Ctrl-C"
        url, _ = lines_with(process, "http://", stays)
        assert url.endswith("#study=small")
        assert asked(url, "state?study=small")["counts"] == {"done": 6}
        assert asked(url, "launch") == {"file": "spec.yaml", "started": None}
        found = asked(url, "refine?study=small&between=separation_weight+0+1")
        assert found["command"] == "sweep launch spec.yaml --workers 1"
        assert found["why_not"] == ""
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0
        assert_gone(process, url)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_the_page_ends_with_a_launch_that_is_ended(
    folder: Path, number: signal.Signals, code: int
) -> None:
    words = ("launch", "long.yaml", "--show", "--no-open", "--workers", "1")
    with started(folder, *words) as process:
        url = line_with(process, "http://")
        while not asked(url, "state?study=small").get("running"):
            pass
        process.send_signal(number)
        assert process.wait(PATIENCE) == code
        assert_gone(process, url)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["launch", "spec.yaml", "--no-open"], "--no-open: needs --show"),
        (["launch", "spec.yml", "--show"], "spec.yml: no such file"),
        (["show", "--launch", "lacking.yaml"], "lacking.yaml: no such file"),
        (["show", "--launch", "bad.yaml"], 'bad.yaml:5: unknown parameter "stepps"'),
        (["show", "other", "--launch", "spec.yaml"], "other: no study has been"),
        (
            ["show", "small", "--to", "x.html", "--launch", "spec.yaml"],
            "--launch: is for the explorer",
        ),
        (["view", "--launch", "spec.yaml"], "--launch spec.yaml: exists already"),
        (
            ["view", "spec.yaml", "--launch", "long.yaml"],
            "--launch long.yaml: exists already",
        ),
        (
            ["view", "spec.yaml", "--launch", "deeper/new.yaml"],
            "--launch deeper/new.yaml: must be in the folder .",
        ),
        (
            ["view", "small", "--launch", "new.yaml"],
            "--launch new.yaml: small is a stored study; use sweep show small --launch",
        ),
    ],
)
def test_what_cannot_be_launched_is_said_before_a_page_opens(
    filled: Path, words: list[str], said: str
) -> None:
    ended = sweep(filled, *words)
    assert ended.returncode == 2
    assert said in ended.stderr
    assert ended.stdout == ""
