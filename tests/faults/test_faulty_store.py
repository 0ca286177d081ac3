"""Launches into an object store that fails, repeats, cuts and comes late: the tables
are the undisturbed ones.
"""

import http.client
import random
import subprocess
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from sweep.store import locations
from sweep.store.locations import ATTEMPTS, ObjectPath
from tests.faults import campaign
from tests.faults.campaign import tables
from tests.http_servers import HttpServer, Request
from tests.object_stores import ObjectStore, object_store
from tests.patience import PATIENCE
from tests.studies import launched, relaunch

LAUNCH = [*campaign.LAUNCH[:3], "launch", "spec.yaml", "--workers", "1", "--results"]
LAUNCH_SECONDS = 500.0
HOP = {"connection", "transfer-encoding", "content-length", "date", "server"}
AWAY_EVERY = 60
FAILING = ("500", "503", "reset before", "reset after", "cut")
"""Faults after which a request is made again."""
FAULTS = ("500", "503", "reset before", "reset after", "cut", "twice", "late", "slow")


class Between:
    """A proxy before an object store: faults by a seeded generator, a draw for each
    request.

    Of each AWAY_EVERY requests in a row the last `away` meet no server. A lock is asked
    for three times, not patiently: no request for it fails more than twice in a row.
    """

    def __init__(
        self, target: int, seed: int, shares: dict[str, float], seconds: float = 0.0
    ) -> None:
        self.drawn, self.shares, self.seconds = (
            random.Random(seed),
            dict(shares),
            seconds,
        )
        self.away = self.shares.pop("away", 0)
        self.counts: Counter[str] = Counter()
        self.in_a_row: Counter[str] = Counter()
        self.late: list[threading.Timer] = []
        self.drawing = threading.Lock()
        self.target = target
        self.server = HttpServer(self.pass_on)
        self.port = self.server.port

    def close(self) -> None:
        """After the last of what comes late."""
        for timer in self.late:
            timer.join()
        self.server.close()

    def fault(self, method: str, path: str) -> str:
        """What happens to a request; "" for nothing."""
        with self.drawing:
            self.counts["requests"] += 1
            if (
                self.away
                and self.counts["requests"] % AWAY_EVERY >= AWAY_EVERY - self.away
            ):
                self.counts["away"] += 1
                return "reset before"
            [fault] = self.drawn.choices(
                [*self.shares, ""],
                [*self.shares.values(), 1 - sum(self.shares.values())],
            )
            self.in_a_row[path] += 1 if fault in FAILING else -self.in_a_row[path]
            if "lock" in path and self.in_a_row[path] == ATTEMPTS:
                return ""
        if (fault in ("twice", "late") and method != "PUT") or (
            fault == "cut" and method != "GET"
        ):
            return ""
        self.counts[fault] += 1
        return fault

    def pass_on(self, asked: Request) -> None:
        """One request, with its fault."""
        body = body_of(asked)
        fault = self.fault(asked.command, asked.path)
        time.sleep(self.seconds + (0.5 if fault == "slow" else 0))
        if fault in ("500", "503"):
            self.say(asked, int(fault), [], b"")
            return
        if fault == "reset before":
            asked.close_connection = True
            return
        # Of one connection the next request has the same object: it is read now.
        whole = (asked.command, asked.path, body, dict(asked.headers.items()))
        status, headers, content = self.ask(*whole)
        if fault == "twice":
            status, headers, content = self.ask(*whole)
        if fault == "late":
            seconds = 1.0 + self.counts["late"] % 4
            self.late.append(threading.Timer(seconds, self.ask, whole))
            self.late[-1].start()
        if fault == "reset after":
            asked.close_connection = True
            return
        self.say(
            asked, status, headers, content, cut=fault == "cut" and len(content) > 1
        )

    def ask(
        self, method: str, path: str, body: bytes, headers: dict[str, str]
    ) -> tuple[int, list[tuple[str, str]], bytes]:
        """What the store itself answers."""
        connection = http.client.HTTPConnection(
            "127.0.0.1", self.target, timeout=PATIENCE
        )
        try:
            connection.request(method, path, body, headers)
            answer = connection.getresponse()
            return answer.status, answer.getheaders(), answer.read()
        finally:
            connection.close()

    def say(
        self,
        asked: Request,
        status: int,
        headers: list[tuple[str, str]],
        content: bytes,
        *,
        cut: bool = False,
    ) -> None:
        """Answer, or the first half of it."""
        length = {name.lower(): value for name, value in headers}.get(
            "content-length", "0"
        )
        asked.send_response(status)
        for name, value in headers:
            if name.lower() not in HOP:
                asked.send_header(name, value)
        asked.send_header(
            "Content-Length", length if asked.command == "HEAD" else str(len(content))
        )
        asked.end_headers()
        with suppress(OSError):
            asked.wfile.write(content[: len(content) // 2] if cut else content)
        asked.close_connection = asked.close_connection or cut


def body_of(asked: Request) -> bytes:
    """The bytes of a request, in pieces as they come where it does not say how many
    they are.
    """
    if "chunked" not in (asked.headers.get("Transfer-Encoding") or ""):
        return asked.rfile.read(int(asked.headers.get("Content-Length") or 0))
    raw = b""
    while int(size := asked.rfile.readline(), 16):
        raw += size + asked.rfile.read(int(size, 16) + 2)
    raw += size
    while (line := asked.rfile.readline()).strip():
        raw += line
    return raw + line


@pytest.fixture(scope="module")
def server() -> Iterator[ObjectStore]:
    with object_store() as started:
        yield started


USUAL = {
    "500": 0.025,
    "503": 0.025,
    "reset before": 0.025,
    "reset after": 0.025,
    "cut": 0.05,
    "twice": 0.05,
}


def whole(folder: Path, spec: str) -> dict[str, str]:
    launched(spec, folder / "whole")
    return tables(folder / "whole" / "faulty")


@pytest.mark.slow
def test_a_launch_into_a_store_that_fails_has_the_tables_of_an_undisturbed_one(
    server: ObjectStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each launch stores points of its own, so that there are parts to read, to store
    and to merge.
    """
    monkeypatch.setattr(locations, "FIRST_PAUSE", 0.01)
    points = ["[0.5]", "[0.5, 1]", "[0.5, 1, 1.5]"]
    specs = [
        campaign.SPEC.replace("replicates: 30", "replicates: 3").replace(
            "[0.5, 1, 1.5, 2]", one
        )
        for one in points
    ]
    between = Between(server.port, 5, USUAL | {"late": 0.05})
    results = server.results("faults", between.port)
    try:
        for spec in specs:
            relaunch(spec, results)
    finally:
        between.close()
    assert tables(server.results("faults") / "faulty") == whole(tmp_path, specs[-1])
    assert 50 < between.counts["requests"] < 500
    assert sum(between.counts[fault] for fault in FAULTS) > 5


def started(folder: Path, place: str, *options: str) -> "subprocess.Popen[str]":
    return subprocess.Popen(
        [*LAUNCH, place, *options],
        cwd=folder,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "shares"),
    [
        ("usual", USUAL | {"slow": 0.02}),
        ("late", {"late": 0.3}),
        ("away", {"away": 20}),
        ("killed", {}),
        ("killed-and-faults", USUAL),
    ],
)
def test_launches_that_fail_and_are_killed_end_with_the_tables_of_an_undisturbed_one(
    server: ObjectStore, tmp_path: Path, name: str, shares: dict[str, float]
) -> None:
    between = Between(server.port, 11, shares)
    place = server.url(f"slow-{name}", between.port)
    (tmp_path / "spec.yaml").write_text(campaign.SPEC)
    try:
        for kill in range(8 if name.startswith("killed") else 0):
            launch, end = (
                started(tmp_path, place),
                between.counts["requests"] + 20 + 7 * kill,
            )
            while launch.poll() is None and between.counts["requests"] < end:
                time.sleep(0.01)
            launch.kill()
            launch.communicate()
        last = started(tmp_path, place)
        _, errors = last.communicate(timeout=LAUNCH_SECONDS)
    finally:
        between.close()
    assert last.returncode == 0, errors
    assert tables(server.results(f"slow-{name}") / "faulty") == whole(
        tmp_path, campaign.SPEC
    )
    print(name, dict(between.counts))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "faults"), [(4, {}), (2, USUAL)], ids=["peace", "faults"]
)
def test_shares_at_once_store_every_trial_over_a_slow_line(
    server: ObjectStore, tmp_path: Path, number: int, faults: dict[str, float]
) -> None:
    """40 ms a request, and a part every 0.2 s."""
    between = Between(server.port, 1, faults, seconds=0.04)
    place = server.url(f"shares-{number}", between.port)
    (tmp_path / "spec.yaml").write_text(campaign.SPEC)
    try:
        shares = [
            started(tmp_path, place, "--shard", f"{k}/{number}")
            for k in range(1, number + 1)
        ]
        said = [share.communicate(timeout=LAUNCH_SECONDS)[1] for share in shares]
    finally:
        between.close()
    assert [share.returncode for share in shares] == [0] * number, said
    store = server.results(f"shares-{number}") / "faulty"
    assert isinstance(store, ObjectPath)
    assert tables(store) == whole(tmp_path, campaign.SPEC)
