"""An explorer that is killed during a launch changes nothing of it."""

import http.client
import os
import random
import signal
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from sweep.campaigns.launching import launch
from sweep.campaigns.progress import Progress
from sweep.store.writer import Writer
from sweep.tables.stored_study import StoredStudy
from sweep.workers.chunks import Chunks
from sweep.workers.executors import Serial
from tests.faults.shows import nursery
from tests.patience import PATIENCE
from tests.studies import SMALL, launched, read, same

QUESTIONS = (
    "studies",
    "state?study=small",
    "points?study=small",
    "trials?study=small",
    "figure?study=small",
    "refine?study=small&between=separation_weight+0+1",
)
SEED = 7


class Watchers:
    """One explorer after the other: each is asked something, and killed after the next
    trial, before it is asked, while it answers, or when it has answered.
    """

    def __init__(self, results: Path, seed: int) -> None:
        self.results, self.random = results, random.Random(seed)
        self.nursery = nursery()
        self.kills = self.answered = 0
        self.page = 0
        self.connection: http.client.HTTPConnection | None = None

    def look(self) -> None:
        """Open an explorer and ask it."""
        assert self.nursery.stdin
        assert self.nursery.stdout
        print(self.results, "small", file=self.nursery.stdin, flush=True)
        page, url = self.nursery.stdout.readline().split()
        self.page = int(page)
        address = urlsplit(url)
        self.connection = http.client.HTTPConnection(address.netloc, timeout=PATIENCE)
        asked = self.random.choice(QUESTIONS)
        if self.kills % 4:
            self.connection.request("GET", f"{address.path}ask/{asked}")
        if self.kills % 4 == 2:
            self.answered += self.connection.getresponse().status in (200, 400)

    def kill(self) -> None:
        """Kill the explorer, and wait until it is gone."""
        if not self.page:
            return
        assert self.connection
        assert self.nursery.stdout
        os.kill(self.page, signal.SIGKILL)
        assert self.nursery.stdout.readline() == "gone\n"
        self.connection.close()
        self.kills, self.page = self.kills + 1, 0

    def close(self) -> None:
        self.kill()
        assert self.nursery.stdin
        assert self.nursery.stdout
        self.nursery.stdin.close()
        self.nursery.stdout.close()
        assert self.nursery.wait(PATIENCE) == 0


@pytest.fixture
def watchers(tmp_path: Path) -> Iterator[Watchers]:
    watchers = Watchers(tmp_path / "watched", SEED)
    yield watchers
    watchers.close()


@pytest.mark.slow
@pytest.mark.parametrize(
    "kills", [4, pytest.param(200, marks=pytest.mark.slow)], ids=str
)
def test_explorers_that_are_killed_change_no_bit(
    watchers: Watchers, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kills: int
) -> None:
    spec = SMALL.replace("replicates: 3", f"replicates: {kills}")
    alone = launched(spec, tmp_path / "alone")
    # A chunk is one trial, however fast the machine is, and each has its report.
    monkeypatch.setitem(Chunks.__init__.__kwdefaults__, "seconds", 1e-9)
    monkeypatch.setattr("sweep.workers.chunks.MOST_A_SECOND", 1e12)
    monkeypatch.setitem(Writer.__init__.__kwdefaults__, "rows", 2)

    def report(_progress: Progress) -> None:
        watchers.kill()
        if watchers.kills < kills:
            watchers.look()

    launch(read(spec), watchers.results, Serial(), report=report)
    assert watchers.kills == kills
    assert watchers.answered == kills // 4
    watched = StoredStudy("small", watchers.results)
    assert same(watched, alone)
    assert names(watchers.results / "small") == names(tmp_path / "alone" / "small")


def names(study: Path) -> set[str]:
    """What lies in a study, but for the names of its parts."""
    found = (path.relative_to(study) for path in study.rglob("*"))
    return {path.as_posix() for path in found if path.parts[0] != "parts"}
